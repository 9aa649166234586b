"""Public trains that a new line can begin with, each with its source."""

import tomllib
from collections.abc import Mapping
from importlib.resources import files
from typing import Any, NamedTuple

from kankaku.railway.errors import suggesting
from kankaku.scenarios.drafts.draft import DraftError

FOLDER = "library"


class LibraryTrain(NamedTuple):
    """A train of the library."""

    name: str
    title: str
    source: str
    """Where its figures stand."""
    terms: str
    """Licence of that source; empty where figures were retyped from a publication."""
    assumed: str
    """What the source does not say."""
    entry: Mapping[str, Any]
    """The table ``[train.NAME]`` of ``rolling_stock.toml``."""


def library_names() -> tuple[str, ...]:
    """
    Return the names of all trains of the library.

    Returns
    -------
    tuple[str, ...]
        In alphabetical order.
    """
    places = files("kankaku.scenarios.drafts").joinpath(FOLDER).iterdir()
    return tuple(sorted(place.name[:-5] for place in places if place.name.endswith(".toml")))


def library_train(name: str) -> LibraryTrain:
    """
    Return a train of the library.

    Parameters
    ----------
    name
        Its name.

    Returns
    -------
    LibraryTrain
        The train.

    Raises
    ------
    DraftError
        If there is none of that name.
    """
    known = library_names()
    if name not in known:
        where, allowed = f"train {name!r}", suggesting(name, known, ", ".join(known))
        raise DraftError(where, "is not in the library", allowed)
    place = files("kankaku.scenarios.drafts").joinpath(FOLDER, f"{name}.toml")
    told = tomllib.loads(place.read_text("utf-8"))
    texts = (told["title"], told["source"], told.get("terms", ""), told.get("assumed", ""))
    return LibraryTrain(name, *texts, told["train"])
