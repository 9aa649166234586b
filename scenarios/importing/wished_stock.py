"""The train of the library that is taken where a source has none."""

from typing import Any

from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.stock_library import library_train

DEFAULT = "metro"


def library_stock(name: str, notes: SourceNotes) -> dict[str, dict[str, Any]]:
    """
    Return a train of the library, and note that it is not of the source.

    Parameters
    ----------
    name
        Of the train; the usual one if empty.
    notes
        Of the scenario.

    Returns
    -------
    dict[str, dict[str, Any]]
        One table ``[train.NAME]`` by name.

    Raises
    ------
    DraftError
        If there is none of that name.
    """
    train = library_train(name or DEFAULT)
    why = "it was asked for" if name else "the source names no train, and none was asked for"
    notes.assume("train", f"{train.name!r} of the library: {train.title}", why)
    if train.assumed:
        notes.assume(f"figures of {train.name!r}", train.assumed, f"its source: {train.source}")
    return {train.name: dict(train.entry)}
