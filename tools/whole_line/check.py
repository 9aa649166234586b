"""Check the tables of the whole line as they are on disk, without the planner's help."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from tools.whole_line.layout import TRAIN_KM, Layout, Passage
from tools.whole_line.runs import UNIT_S, Usual
from tools.whole_line.trips import Trip

TURN_BACK_S = 120
APART_S = 60
"""Least between two trains at a platform track, and between conflicting movements. [s]"""
CLEAR_KM = 0.03
"""Least from a stop mark to the fouling zone ahead. [km]"""


@dataclass(frozen=True, slots=True)
class Call:
    """A row of ``calls.csv``."""

    train: str
    station: str
    track: str
    arrival_s: int
    departure_s: int


@dataclass(frozen=True)
class Booked:
    """Services and calls as the files have them."""

    layout: Layout
    next_train: Mapping[str, str]
    calls: Mapping[str, Sequence[Call]]

    def direction(self, train: str) -> str:
        """Return the direction of a train."""
        km = self.layout.station_km
        ends = self.calls[train]
        return "rising" if km[ends[0].station] < km[ends[-1].station] else "falling"

    def passages(self, train: str) -> Iterator[tuple[float, Passage]]:
        """Yield the movements of a train over nodes with their times. [s]"""
        direction = self.direction(train)
        for start, end in pairwise(self.calls[train]):
            run_s = end.arrival_s - start.departure_s
            for passage in self.layout.passages(start.track, end.track, direction):
                share = self.layout.share((start.station, end.station), passage.node.km, direction)
                yield start.departure_s + share * run_s, passage


def check_folder(
    folder: Path, layout: Layout, trips: Sequence[Trip], usual: Usual
) -> dict[str, int]:
    """
    Count the trains of a folder, and what is wrong with them.

    Parameters
    ----------
    folder
        Folder of the scenario.
    layout
        The tracks.
    trips
        Public minutes.
    usual
        Least runs and dwells.

    Returns
    -------
    dict[str, int]
        Count by what is counted.
    """
    booked = _read(folder, layout)
    coupled = sum(bool(train) for train in booked.next_train.values())
    handed = sum(trip.through and trip.direction == "falling" for trip in trips)
    taken = sum(trip.through and trip.direction == "rising" for trip in trips)
    return {
        "services": len(booked.calls),
        "calls": sum(len(calls) for calls in booked.calls.values()),
        "services whose stock works a next one": coupled,
        "services that end and are stabled": len(booked.calls) - coupled - handed,
        "services whose stock comes from the siding": len(booked.calls) - coupled - taken,
        "services to the Yokohama line": handed,
        "services from the Yokohama line": taken,
        "calls outside the public minute": _missed(booked, trips),
        "mistakes: couplings": _coupling_mistakes(booked),
        "mistakes: trains too close at a platform track": _platform_mistakes(booked),
        "mistakes: runs or dwells too short": _run_mistakes(booked, usual),
        "mistakes: trains that change their order on a track": _order_mistakes(booked),
        "mistakes: conflicting movements too close at points": _points_mistakes(booked),
        "mistakes: stop marks too close to points": _mark_mistakes(layout),
        "mistakes: tracks not covered by blocks": _block_mistakes(folder, layout),
    }


def _rows(folder: Path, name: str) -> list[dict[str, str]]:
    with (folder / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _read(folder: Path, layout: Layout) -> Booked:
    calls: dict[str, list[Call]] = {}
    for row in _rows(folder, "calls.csv"):
        times = (_seconds(row["arrival"]), _seconds(row["departure"]))
        call = Call(row["train"], row["station"], row["track"], *times)
        calls.setdefault(row["train"], []).append(call)
    following = {row["train"]: row["next_train"] for row in _rows(folder, "services.csv")}
    return Booked(layout, following, calls)


def _seconds(clock: str) -> int:
    hours, minutes, seconds = map(int, clock.split(":"))
    return 3600 * hours + 60 * minutes + seconds


def _missed(booked: Booked, trips: Sequence[Trip]) -> int:
    count = 0
    for trip in trips:
        calls = booked.calls[trip.train]
        times = [call.departure_s for call in calls[:-1]] + [calls[-1].arrival_s]
        count += sum(
            time_s // 60 != minute for time_s, minute in zip(times, trip.minutes, strict=True)
        )
    return count


def _coupling_mistakes(booked: Booked) -> int:
    pairs = [(train, after) for train, after in booked.next_train.items() if after]
    count = len(pairs) - len({after for _, after in pairs})
    for train, after in pairs:
        last, first = booked.calls[train][-1], booked.calls[after][0]
        good = (last.station, last.track) == (first.station, first.track)
        good &= first.arrival_s == last.departure_s
        good &= first.departure_s - last.arrival_s >= TURN_BACK_S
        good &= booked.direction(train) != booked.direction(after)
        count += not good
    return count


def _platform_mistakes(booked: Booked) -> int:
    held: dict[tuple[str, str], list[Call]] = {}
    for calls in booked.calls.values():
        for call in calls:
            held.setdefault((call.station, call.track), []).append(call)
    count = 0
    for calls_here in held.values():
        calls_here.sort(key=lambda call: (call.arrival_s, call.departure_s))
        for before, after in pairwise(calls_here):
            same_stock = booked.next_train[before.train] == after.train
            least_s = 0 if same_stock else APART_S
            count += after.arrival_s - before.departure_s < least_s
    return count


def _run_mistakes(booked: Booked, usual: Usual) -> int:
    count = 0
    for calls in booked.calls.values():
        for start, end in pairwise(calls):
            least_s = UNIT_S * usual.least_run[start.station, end.station]
            count += end.arrival_s - start.departure_s < least_s
        count += sum(
            call.departure_s - call.arrival_s < UNIT_S * usual.least_dwell[call.station]
            for call in calls[1:]
        )
    return count


def _order_mistakes(booked: Booked) -> int:
    """Count stretches between stations that trains leave in another order than they came."""
    starts: dict[tuple[str, str], list[tuple[float, str]]] = {}
    ends: dict[tuple[str, str], list[tuple[float, str]]] = {}
    for train, calls in booked.calls.items():
        for start, end in pairwise(calls):
            for stretch, begins_s, ends_s in _stretches(booked, start, end):
                starts.setdefault(stretch, []).append((begins_s, train))
                ends.setdefault(stretch, []).append((ends_s, train))
    return sum(
        [train for _, train in sorted(found)] != [train for _, train in sorted(ends[stretch])]
        for stretch, found in starts.items()
    )


def _stretches(
    booked: Booked, start: Call, end: Call
) -> Iterator[tuple[tuple[str, str], float, float]]:
    """Yield the stretches from station to station with the times at both ends. [s]"""
    km = booked.layout.station_km
    low_km, high_km = sorted((km[start.station], km[end.station]))
    along = sorted((name for name in km if low_km <= km[name] <= high_km), key=km.__getitem__)
    if km[end.station] == low_km:
        along.reverse()
    run_s = end.arrival_s - start.departure_s
    for stretch in pairwise(along):
        shares = [(km[name] - km[start.station]) / (high_km - low_km) for name in stretch]
        begins_s, ends_s = (start.departure_s + abs(share) * run_s for share in shares)
        yield stretch, begins_s, ends_s


def _points_mistakes(booked: Booked) -> int:
    over: dict[str, list[tuple[float, str, Passage]]] = {}
    for train in booked.calls:
        for time_s, passage in booked.passages(train):
            over.setdefault(passage.node.id, []).append((time_s, train, passage))
    count = 0
    for movements in over.values():
        movements.sort(key=lambda movement: movement[:2])
        for index, (time_s, _, passage) in enumerate(movements):
            for later_s, _, other in movements[index + 1 :]:
                if later_s >= time_s + APART_S:
                    break
                count += passage.conflicts(other)
    return count


def _mark_mistakes(layout: Layout) -> int:
    count = 0
    for platform in layout.platforms.values():
        track = layout.tracks[platform.track]
        low_km, high_km = track.start.fouling_km[1], track.end.fouling_km[0]
        for direction in ("rising", "falling"):
            if track.direction not in {direction, "both"}:
                continue
            front_km = platform.front_km(direction)
            if direction == "rising":
                good = front_km + CLEAR_KM <= high_km and front_km - TRAIN_KM >= low_km
            else:
                good = front_km - CLEAR_KM >= low_km and front_km + TRAIN_KM <= high_km
            count += not good
    return count


def _block_mistakes(folder: Path, layout: Layout) -> int:
    ends: dict[str, list[tuple[str, str]]] = {}
    for row in _rows(folder, "blocks.csv"):
        ends.setdefault(row["track"], []).append((row["start_km"], row["end_km"]))
    count = 0
    for track in layout.tracks.values():
        blocks = ends.get(track.id, [("", "")])
        good = blocks[0][0] == str(track.start.km) and blocks[-1][1] == str(track.end.km)
        good &= all(before[1] == after[0] for before, after in pairwise(blocks))
        count += not good
    return count
