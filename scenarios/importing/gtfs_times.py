"""Booked times of trains: missing ones between timed stops, and dwells that a feed leaves out."""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.sketch import TripCall
from kankaku.scenarios.drafts.stays import LEAST_DWELL_S
from kankaku.scenarios.importing.gtfs_trips import DayTrip

DWELL_S = 30
"""Assumed where arrival and departure are equal, if the run before leaves the time. [s]"""

LeastRun = Callable[[str, str], float]
"""Least run time from a station to another one. [s]"""


class _Time(NamedTuple):
    station: str
    arrival_s: int | None
    departure_s: int | None


class TimesTold:
    """What was done to the times of trains, counted for the notes."""

    def __init__(self) -> None:
        self.between = 0
        self.dwells: list[int] = []
        self.same_time = 0
        self.later = 0
        self.too_fast: dict[tuple[str, str], tuple[int, float, int]] = {}
        """By stations: shortest booked run, least run, how many trains. [s, s, -]"""

    def run(self, pair: tuple[str, str], booked_s: int, least_s: float) -> None:
        """Count a run that is booked faster than possible."""
        if booked_s < least_s - 0.5:
            shortest_s, _, count = self.too_fast.get(pair, (booked_s, least_s, 0))
            self.too_fast[pair] = min(shortest_s, booked_s), least_s, count + 1

    def note(self, notes: SourceNotes) -> None:
        """Tell everything that was counted."""
        if self.same_time:
            notes.assume(
                f"times of {self.same_time} calls that have the time of the call before",
                "between those of the calls around them, by least run times",
                "whole minutes say no more than that",
            )
        if self.between:
            notes.assume(
                f"times of {self.between} calls without times",
                "between the timed calls before and behind, by least run times",
                "stop_times.txt has none there",
            )
        if self.dwells:
            value = (
                f"{DWELL_S} s, taken from the run before, {LEAST_DWELL_S} s if that is short; "
                "at its ends a train stands as long before it begins, and after it has arrived"
            )
            why = f"arrival and departure are equal at {len(self.dwells)} calls"
            notes.assume("dwells", value, why)
        if self.later:
            value = f"{self.later} of them up to half a run later than in the feed"
            notes.assume("booked departures", value, "no dwell fits before them otherwise")
        if self.too_fast:
            count = sum(number for _, _, number in self.too_fast.values())
            worst = sorted(self.too_fast.items(), key=lambda item: item[1][0] - item[1][1])[:5]
            told = ", ".join(
                f"{one} to {other} in {booked_s} s, least {least_s:.0f} s"
                for (one, other), (booked_s, least_s, _) in worst
            )
            what = f"time for {count} runs that are booked faster than this train can"
            notes.miss(f"{what}: {told}", "trains arrive late there, whatever the controller")


def booked_calls(
    trip: DayTrip, station_of: Mapping[str, str], least_run_s: LeastRun, told: TimesTold
) -> tuple[TripCall, ...]:
    """
    Return the booked calls of a train.

    Parameters
    ----------
    trip
        The train; its first and last call have times.
    station_of
        Station by stop.
    least_run_s
        Least run times. [s]
    told
        Counts what was done.

    Returns
    -------
    tuple[TripCall, ...]
        Every one later than the one before. Booked departures hold wherever they can.
    """
    times = [_Time(station_of[call.stop], *_both(call)) for call in trip.calls]
    filled = _filled(_apart(times, told), least_run_s, told)
    return _with_dwells(filled, least_run_s, told)


def _both(call: object) -> tuple[int | None, int | None]:
    return getattr(call, "arrival_s", None), getattr(call, "departure_s", None)


def _apart(times: Sequence[_Time], told: TimesTold) -> list[_Time]:
    """Return times without those on the way that repeat the time before, or that of the end."""
    made = [times[0]]
    end_s = times[-1].arrival_s
    last_s = times[0].departure_s
    for time in times[1:-1]:
        if time.arrival_s is not None and time.arrival_s in {last_s, end_s}:
            told.same_time += 1
            # A departure that is later counts all the same.
            later = time.departure_s if time.departure_s not in {last_s, end_s} else None
            time = time._replace(arrival_s=None, departure_s=later)  # noqa: PLW2901 - a changed copy
        if time.departure_s is not None:
            last_s = time.departure_s
        made.append(time)
    return [*made, times[-1]]


def _filled(times: Sequence[_Time], least_run_s: LeastRun, told: TimesTold) -> list[TripCall]:
    """Return all times; a call without any has a dwell and a share of the time by least runs."""
    made: list[TripCall] = []
    start = 0
    for number, time in enumerate(times):
        if time.departure_s is None:
            continue
        arrival_s = time.departure_s if time.arrival_s is None else time.arrival_s
        if number - start > 1:
            told.between += sum(
                other.departure_s is None and other.arrival_s is None
                for other in times[start + 1 : number]
            )
            names = [other.station for other in times[start : number + 1]]
            runs_s = [max(1.0, least_run_s(*pair)) for pair in pairwise(names)]
            made += _between(names[1:-1], runs_s, made[-1].departure_s, arrival_s)
        made.append(TripCall(time.station, arrival_s, time.departure_s))
        start = number
    return made


def _between(
    names: Sequence[str], runs_s: Sequence[float], from_s: int, until_s: int
) -> list[TripCall]:
    """Return calls between two times, the time divided as the least runs are."""
    time_s = until_s - from_s
    dwell_s = DWELL_S
    if time_s < sum(runs_s) + DWELL_S * len(names):
        dwell_s = min(LEAST_DWELL_S, time_s // (2 * len(names) + 1))
    scale = (time_s - dwell_s * len(names)) / sum(runs_s)
    made, at_s = [], float(from_s)
    for name, run_s in zip(names, runs_s[:-1], strict=True):
        at_s += run_s * scale
        arrival_s = round(at_s)
        made.append(TripCall(name, arrival_s, arrival_s + dwell_s))
        at_s += dwell_s
    return made


def _with_dwells(
    calls: Sequence[TripCall], least_run_s: LeastRun, told: TimesTold
) -> tuple[TripCall, ...]:
    first = calls[0]
    ready_s = first.arrival_s if first.arrival_s < first.departure_s else -1
    if ready_s < 0:
        ready_s = max(0, first.departure_s - DWELL_S)
        told.dwells.append(first.departure_s - ready_s)
    made = [TripCall(first.station, ready_s, first.departure_s)]
    for call in calls[1:]:
        last = made[-1]
        run_s = least_run_s(last.station, call.station)
        arrival_s, departure_s = call.arrival_s, call.departure_s
        if call is calls[-1]:
            arrival_s = max(arrival_s, last.departure_s + 1)
            if departure_s <= arrival_s:
                departure_s = arrival_s + DWELL_S
                told.dwells.append(DWELL_S)
        elif departure_s <= arrival_s:
            spare_s = int(departure_s - last.departure_s - run_s)
            dwell_s = min(DWELL_S, max(LEAST_DWELL_S, spare_s))
            told.dwells.append(dwell_s)
            arrival_s = max(departure_s - dwell_s, (departure_s + last.departure_s) // 2)
            arrival_s = max(arrival_s, last.departure_s + 1)
            departure_s = max(departure_s, arrival_s + LEAST_DWELL_S)
        elif arrival_s <= last.departure_s:
            arrival_s = last.departure_s + 1
            departure_s = max(departure_s, arrival_s + LEAST_DWELL_S)
        told.later += departure_s > call.departure_s and call is not calls[-1]
        told.run((last.station, call.station), arrival_s - last.departure_s, run_s)
        made.append(TripCall(call.station, arrival_s, departure_s))
    return tuple(made)
