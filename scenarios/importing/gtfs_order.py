"""The order of stations along a line, from the stations that its trains call at."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.importing.gtfs_trips import DayTrip


def line_order(trips: Sequence[DayTrip], station_of: Mapping[str, str]) -> tuple[str, ...]:
    """
    Return the stations of the main line, as trains of direction 0 meet them.

    Parameters
    ----------
    trips
        The trains of the day.
    station_of
        Station by stop.

    Returns
    -------
    tuple[str, ...]
        Of the pattern with most stations, with those of others that go on from its ends, or call
        between two of its stations.
    """
    patterns: Counter[tuple[str, ...]] = Counter()
    zero: Counter[tuple[str, ...]] = Counter()
    for trip in trips:
        pattern = without_returns([station_of[call.stop] for call in trip.calls])
        patterns[pattern] += 1
        zero[pattern] += trip.direction == 0
    ordered = sorted(patterns, key=lambda pattern: (-len(pattern), -patterns[pattern], pattern))
    main = max(
        (pattern for pattern in ordered if len(pattern) == len(ordered[0])),
        key=lambda pattern: (2 * zero[pattern] > patterns[pattern], patterns[pattern]),
    )
    line = [*main]
    grown = True
    while grown:
        grown = False
        for pattern in ordered:
            longer = _grown(line, pattern)
            grown = grown or len(longer) > len(line)
            line = longer
    return tuple(line)


def without_returns(stations: Sequence[str]) -> tuple[str, ...]:
    """
    Return the longest part of a way that comes to no station twice.

    Parameters
    ----------
    stations
        In running order.

    Returns
    -------
    tuple[str, ...]
        The first of the longest parts.
    """
    start, longest = 0, (0, 0)
    last: dict[str, int] = {}
    for number, name in enumerate(stations):
        start = max(start, last.get(name, -1) + 1)
        last[name] = number
        if number + 1 - start > longest[1] - longest[0]:
            longest = start, number + 1
    return tuple(stations[longest[0] : longest[1]])


def _grown(line: list[str], pattern: Sequence[str]) -> list[str]:
    """Return a line with those stations of a pattern that have one place only on it."""
    at = {name: number for number, name in enumerate(line)}
    common = [(place, at[name]) for place, name in enumerate(pattern) if name in at]
    if not common or len(common) == len(pattern):
        return line
    rises = common[-1][1] >= common[0][1]
    if len(common) == 1:
        # It meets the line at one station: before its first, or behind its last one.
        rises = (common[0][1] == 0) is (common[0][0] > 0)
    if not rises:
        pattern = pattern[::-1]
        common = [(len(pattern) - 1 - place, number) for place, number in reversed(common)]
    if any(after[1] <= before[1] for before, after in pairwise(common)):
        return line
    longer = list(line)
    (first, low), (last, high) = common[0], common[-1]
    if high == len(line) - 1:
        longer += pattern[last + 1 :]
    for before, after in reversed(list(pairwise(common))):
        if after[1] == before[1] + 1:
            longer[after[1] : after[1]] = pattern[before[0] + 1 : after[0]]
    if low == 0:
        longer[:0] = pattern[:first]
    return longer


def along(
    trips: Sequence[DayTrip], station_of: Mapping[str, str], line: Sequence[str], notes: SourceNotes
) -> list[DayTrip]:
    """
    Return trains as far as they run along a line.

    Parameters
    ----------
    trips
        The trains.
    station_of
        Station by stop.
    line
        Stations in order.
    notes
        Are told who is cut and who is left out.

    Returns
    -------
    list[DayTrip]
        With calls in one direction, every station once.
    """
    at = {name: number for number, name in enumerate(line)}
    kept, cut, out = [], [], []
    for trip in trips:
        places = [at.get(station_of[call.stop], -1) for call in trip.calls]
        start, end = _longest_run(places)
        if end - start < 2:
            out.append(trip.id)
            continue
        if end - start < len(places):
            cut.append(trip.id)
        kept.append(replace(trip, calls=trip.calls[start:end]))
    effect = "they run along the longest part of the main line that they have"
    _tell(notes, "trains that leave the main line or come back to a station", cut, effect)
    effect = "they do not run: two stations in a row on the main line they have not"
    _tell(notes, "trains of other branches", out, effect)
    return kept


def _tell(notes: SourceNotes, who: str, trains: Sequence[str], effect: str) -> None:
    if trains:
        more = f" and {len(trains) - 8} more" if len(trains) > 8 else ""
        notes.miss(f"{len(trains)} {who}: {', '.join(trains[:8])}{more}", effect)


def _longest_run(places: Sequence[int]) -> tuple[int, int]:
    """Return the ends of the longest part in one direction; places off the line are below 0."""
    best, start = (0, 0), 0
    for number in range(1, len(places) + 1):
        part = places[start : number + 1]
        steps = {after > before for before, after in pairwise(part)}
        if number == len(places) or min(part) < 0 or len(steps) > 1 or len({*part}) < len(part):
            if number - start > best[1] - best[0] and places[start] >= 0:
                best = start, number
            # The next part may turn back where this one ends.
            before = places[number - 1]
            turns = number < len(places) and min(before, places[number]) >= 0
            start = number - 1 if turns and before != places[number] else number
    return best
