"""From visits to dwells: faults of observation are left out, and counted."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import NamedTuple

from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.observing.event_times import DAY_S
from kankaku.scenarios.observing.visits import EventsError, ObservedEvents, Visit

LONGEST_S = 300.0
"""What lasts longer is a wait or a turn-round, not a dwell. [s]"""
LONGEST_HEADWAY_S = 1800.0
"""Whoever came so long before has no bearing on those who wait now. [s]"""


class Dwell(NamedTuple):
    """A train that came, stood and went on, seen from beginning to end."""

    train: str
    station: str
    departs_s: float
    """Time of day of its departure; beyond midnight it goes on with 24 hours. [s]"""
    dwell_s: float
    headway_s: float | None
    """From the departure of the train before to its arrival; nothing if unknown. [s]"""
    before: int
    """Place of its dwell at the station before; -1 if that one is not known. [-]"""
    booked_s: float | None
    """Its booked dwell; nothing if unknown. [s]"""


@dataclass(frozen=True, slots=True)
class DwellSample:
    """All dwells of a source."""

    dwells: tuple[Dwell, ...]
    names: dict[str, str]
    """Names by station."""
    notes: SourceNotes
    visits: int
    """Visits that they are taken from. [-]"""
    longest_s: float


def dwells_of(events: ObservedEvents, longest_s: float = LONGEST_S) -> DwellSample:
    """
    Return the dwells of observed events.

    Parameters
    ----------
    events
        All visits.
    longest_s
        What lasts longer is no dwell. [s]

    Returns
    -------
    DwellSample
        The dwells; its notes tell what was left out and why.

    Raises
    ------
    EventsError
        If none is left.
    """
    notes = events.notes
    good = [visit for visit in events.visits if not _backwards(visit)]
    if turned := len(events.visits) - len(good):
        notes.miss(f"{turned} visits with a departure before the arrival", "left out")
    by_train = [_merged(visits) for visits in _by_train(good)]
    visits = sum(map(len, by_train))
    if wavered := len(good) - visits:
        value = "from the first arrival to the last departure"
        notes.assume("several rows of a train at one station in a row", value, "a report wavered")
        notes.miss(f"{wavered} rows of reports that wavered", "one visit with the row before")
    headways_s = _headways_s(by_train)
    windows_s = _windows_s(good)
    found: list[Dwell] = []
    tally: dict[str, int] = {}
    for train in by_train:
        before = -1
        for place, visit in enumerate(train):
            is_end = place in {0, len(train) - 1}
            why = _left_out(visit, windows_s[visit.day_s], longest_s, is_end=is_end)
            if why:
                tally[why] = tally.get(why, 0) + 1
                before = -1
                continue
            came_s, went_s = visit.arrival_s or 0.0, visit.departure_s or 0.0
            key = visit.train, visit.station, came_s
            of_day_s, length_s = went_s - visit.day_s, went_s - came_s
            found.append(
                Dwell(
                    *(visit.train, visit.station, of_day_s, length_s),
                    *(headways_s.get(key), before, visit.booked_dwell_s),
                )
            )
            before = len(found) - 1
    for why, count in tally.items():
        notes.miss(f"{count} visits {why}", "left out")
    if not found:
        told = "no train was seen to come, stand and go on; allowed: arrivals and departures"
        raise EventsError((told,))
    return DwellSample(tuple(found), events.names, notes, visits, longest_s)


def _backwards(visit: Visit) -> bool:
    came_s, went_s = visit.arrival_s, visit.departure_s
    return came_s is not None and went_s is not None and went_s < came_s


def _when_s(visit: Visit) -> float:
    known = visit.arrival_s if visit.arrival_s is not None else visit.departure_s
    return known if known is not None else 0.0


def _by_train(visits: Iterable[Visit]) -> Iterator[list[Visit]]:
    ordered = sorted(visits, key=lambda visit: (visit.train, _when_s(visit)))
    for _, own in groupby(ordered, key=lambda visit: visit.train):
        yield list(own)


def _merged(visits: Sequence[Visit]) -> list[Visit]:
    """Return the visits of a train, those to one station in a row as one."""
    merged: list[Visit] = []
    for visit in visits:
        if merged and merged[-1].station == visit.station:
            booked_s = merged[-1].booked_dwell_s
            merged[-1] = merged[-1]._replace(
                departure_s=visit.departure_s,
                booked_dwell_s=visit.booked_dwell_s if booked_s is None else booked_s,
            )
        else:
            merged.append(visit)
    return merged


def _windows_s(visits: Iterable[Visit]) -> dict[float, tuple[float, float]]:
    """Return from when to when something was seen, by day."""
    windows_s: dict[float, tuple[float, float]] = {}
    for visit in visits:
        for time_s in (visit.arrival_s, visit.departure_s):
            if time_s is not None:
                first_s, last_s = windows_s.get(visit.day_s, (time_s, time_s))
                windows_s[visit.day_s] = min(first_s, time_s), max(last_s, time_s)
    return windows_s


def _left_out(
    visit: Visit, window_s: tuple[float, float], longest_s: float, *, is_end: bool
) -> str:
    """Return why a visit is no dwell; empty if it is one."""
    came_s, went_s = visit.arrival_s, visit.departure_s
    if came_s is None or went_s is None:
        return f"without {'an arrival' if came_s is None else 'a departure'}"
    if is_end:
        return "at either end of what was seen of a train, where it may lay over"
    if went_s == came_s:
        return "of no length: the train passed, or the report is too coarse"
    if went_s - came_s > longest_s:
        return f"of more than {longest_s:g} s: a wait or a turn-round"
    # Long dwells are cut off there, so that short ones would count too much.
    is_cut = went_s < window_s[0] + longest_s or came_s > window_s[1] - longest_s
    return f"within {longest_s:g} s of either end of what was seen of a day" if is_cut else ""


def _headways_s(by_train: Sequence[Sequence[Visit]]) -> dict[tuple[str, str, float], float]:
    """Return departure-to-arrival intervals by train, station and arrival."""
    by_place: dict[str, list[Visit]] = {}
    for train in by_train:
        for place, visit in enumerate(train):
            # Without platform or direction, trains from the same station follow each other.
            came_from = train[place - 1].station if place else ""
            key = visit.place or (f"{visit.station} from {came_from}" if came_from else "")
            if key:
                by_place.setdefault(key, []).append(visit)
    found: dict[tuple[str, str, float], float] = {}
    for visits in by_place.values():
        visits.sort(key=_when_s)
        for one, other in pairwise(visits):
            if one.departure_s is None or other.arrival_s is None or one.train == other.train:
                continue
            headway_s = other.arrival_s - one.departure_s
            if 0.0 < headway_s <= LONGEST_HEADWAY_S:
                found[other.train, other.station, other.arrival_s] = headway_s
    return found


def clock_hour(dwell: Dwell) -> int:
    """
    Return the hour in which a train departs.

    Parameters
    ----------
    dwell
        Its dwell.

    Returns
    -------
    int
        From 0; after midnight it goes on with 24. [h]
    """
    return int(dwell.departs_s % (4 * DAY_S)) // 3600
