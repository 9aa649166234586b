"""From a sketch to a draft that the reader of scenarios accepts."""

from copy import deepcopy
from dataclasses import replace
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

from kankaku.scenarios.checks.check_network_timetable import STUCK
from kankaku.scenarios.drafts.draft import Draft, DraftError, write_files
from kankaku.scenarios.drafts.equipment import equip, longest_block_m
from kankaku.scenarios.drafts.layout import Roominess, lay_out
from kankaku.scenarios.drafts.sketch import Sketch
from kankaku.scenarios.drafts.stays import CLEARING_S
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError

ROOMIER = (
    *((CLEARING_S, share) for share in (1.0, 0.8, 0.6, 0.4)),
    (300, 1.0),
    (300, 0.4),
    (600, 0.4),
    (1200, 0.4),
    (1200, 0.2),
)
"""
For so long a platform track stays free between two trains, and so long are blocks over what they
are usually; the first two that are enough, shorter blocks before more tracks. [s], [-]
"""


class UnsoundDraftError(DraftError):
    """
    A draft in which the reader of scenarios finds mistakes.

    Parameters
    ----------
    mistakes
        What it finds.
    """

    def __init__(self, mistakes: tuple[Mistake, ...]) -> None:
        super().__init__("\n".join(map(str, mistakes)))
        self._mistakes = mistakes

    @property
    def sentences(self) -> tuple[str, ...]:
        """What is wrong, a sentence each."""
        return tuple(map(str, self._mistakes))


def completed(sketch: Sketch) -> Draft:
    """
    Lay out a sketch, equip it and check it.

    Parameters
    ----------
    sketch
        Stations, trips and train types.

    Returns
    -------
    Draft
        With the platform tracks, and the blocks, that it needs for no train to wait for ever.

    Raises
    ------
    DraftError
        If no scenario can be made of it; then everything is told that the reader would refuse.
    """
    mistakes: tuple[Mistake, ...] = ()
    usual_m = longest_block_m(sketch.train_types)
    loops = (False, True) if sketch.single_track else (False,)
    for (clearing_s, share), everywhere in product(ROOMIER, loops):
        # What is tried in vain leaves no notes.
        notes = deepcopy(sketch.notes)
        draft = lay_out(replace(sketch, notes=notes), Roominess(clearing_s, everywhere))
        equip(draft, usual_m * share)
        if clearing_s > CLEARING_S:
            value = f"{clearing_s} s or more between two trains, so that there are more of them"
            why = "with fewer tracks trains would wait for each other for ever"
            notes.assume("platform tracks are free", value, why)
        mistakes = mistakes_of(draft)
        if not any(mistake.problem.startswith(STUCK) for mistake in mistakes):
            break
    if mistakes:
        raise UnsoundDraftError(mistakes)
    return draft


def mistakes_of(draft: Draft) -> tuple[Mistake, ...]:
    """
    Return what the reader of scenarios would refuse in a draft.

    Parameters
    ----------
    draft
        The draft.

    Returns
    -------
    tuple[Mistake, ...]
        Empty if it can be run.
    """
    with TemporaryDirectory() as place:
        folder = Path(place) / "draft"
        write_files(draft.files(), folder)
        try:
            load(folder)
        except ScenarioError as error:
            return error.mistakes
    return ()
