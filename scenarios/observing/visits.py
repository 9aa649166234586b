"""Visits of trains to stations, as they were observed, and what can be wrong with their source."""

from dataclasses import dataclass, field
from typing import NamedTuple

from kankaku.railway.errors import KankakuError
from kankaku.scenarios.drafts.provenance_notes import SourceNotes

MOST_TOLD = 20
"""Mistakes of a source. [-]"""


class EventsError(KankakuError):
    """
    Observed events that cannot be used.

    Parameters
    ----------
    mistakes
        Everything that is wrong, a sentence each: file, row, what is wrong, what is allowed.
    """

    verdict = "cannot be used"

    def __init__(self, mistakes: tuple[str, ...]) -> None:
        more = len(mistakes) - MOST_TOLD
        kept = mistakes[:MOST_TOLD] + ((f"and {more} more mistakes",) if more > 0 else ())
        super().__init__("\n".join(kept))
        self._mistakes = kept

    @property
    def sentences(self) -> tuple[str, ...]:
        """Everything that is wrong, a sentence each."""
        return self._mistakes


class Visit(NamedTuple):
    """A train at a station; times count from one midnight for all days of a source."""

    train: str
    """Identifier, unlike that of every other train of every day."""
    station: str
    place: str
    """Where trains follow each other: platform, or station with direction; empty if unknown."""
    day_s: float
    """Midnight at which its day of service begins. [s]"""
    arrival_s: float | None
    """Nothing if nobody saw it. [s]"""
    departure_s: float | None
    """The same. [s]"""
    booked_dwell_s: float | None = None
    """Nothing if the source does not have it. [s]"""


@dataclass
class ObservedEvents:
    """All visits of a source."""

    visits: list[Visit]
    notes: SourceNotes
    names: dict[str, str] = field(default_factory=dict)
    """Names by station."""
