"""What is allowed in a scenario but doubtful: whoever made it should look there again."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from statistics import median

import numpy as np

from kankaku.railway.motion.feasibility import starting_needs_n
from kankaku.railway.plan.earth import distance_m
from kankaku.railway.plan.line import Direction, Station
from kankaku.railway.plan.met import lines_met
from kankaku.railway.plan.scenario import Scenario

STRAIGHT, STRAIGHT_M = 1.05, 150.0
"""A straight way may be longer than the chainage by this share and length: maps are not exact."""
BENT = 0.4
"""A straight way of less than this share of the chainage is a strange line. [-]"""
RESERVE = 1.25
"""A train starts on a gradient with this much of the force that it needs, or there is doubt."""
LONGER, LONGER_S = 1.5, 30.0
"""Booked run times above the usual one by this share and time are told."""
TURN_RESERVE_S = 10.0


def doubts(scenario: Scenario) -> list[str]:
    """
    Return what is doubtful in line, trains and timetable, without a controller.

    Parameters
    ----------
    scenario
        Valid.

    Returns
    -------
    list[str]
        A sentence each, with the file.
    """
    return [
        *_off_the_map(scenario.line.stations),
        *_weak_starts(scenario),
        *_unusual_runs(scenario),
        *_short_turns(scenario),
    ]


def _off_the_map(stations: Sequence[Station]) -> Iterator[str]:
    known = [s for s in stations if s.longitude_deg is not None and s.latitude_deg is not None]
    for one, other in pairwise(known):
        places = [(s.longitude_deg or 0.0, s.latitude_deg or 0.0) for s in (one, other)]
        straight_m = distance_m(*places)
        along_m = other.chainage_m - one.chainage_m
        if straight_m > STRAIGHT * along_m + STRAIGHT_M or straight_m < BENT * along_m:
            yield (
                f"stations.csv: {one.id!r} and {other.id!r} lie {straight_m:.0f} m apart on the "
                f"map, and {along_m:.0f} m along the line"
            )


def _weak_starts(scenario: Scenario) -> Iterator[str]:
    line = scenario.line
    met_on = lines_met(line, [service.route for service in scenario.timetable.services])
    told: set[tuple[str, str]] = set()
    for service in scenario.timetable.services:
        train_type = scenario.train_types[service.train_type]
        starts = service.calls[:-1]
        if not starts:
            continue
        places_m = np.array([call.stop_m for call in starts])
        needs_n = starting_needs_n(met_on[service.route], train_type, places_m)
        force_n = train_type.traction.starting_force_n
        for call, need_n in zip(starts, needs_n.tolist(), strict=True):
            key = service.train_type, call.station
            if force_n < RESERVE * need_n and key not in told:
                told.add(key)
                yield (
                    f"rolling_stock.toml: {service.train_type} starts at {call.station!r} with "
                    f"{force_n / 1000.0:.0f} kN, and needs {need_n / 1000.0:.0f} kN to move at all"
                )


def _unusual_runs(scenario: Scenario) -> Iterator[str]:
    runs_s: dict[tuple[str, str, str], list[tuple[float, str]]] = {}
    for service in scenario.timetable.services:
        for call, after in pairwise(service.calls):
            leg = service.train_type, call.station, after.station
            run_s = after.arrival_s - call.departure_s
            runs_s.setdefault(leg, []).append((run_s, service.train))
    for (kind, start, end), found in runs_s.items():
        usual_s = median(run_s for run_s, _ in found)
        slow = [
            (run_s, train)
            for run_s, train in found
            if run_s > LONGER * usual_s and run_s > usual_s + LONGER_S
        ]
        if slow:
            longest_s, train = max(slow)
            more = f", and {len(slow) - 1} more trains" if len(slow) > 1 else ""
            yield (
                f"calls.csv: {kind} {train!r} from {start!r} to {end!r} is booked {longest_s:.0f} "
                f"s, usual are {usual_s:.0f} s{more}"
            )


def _short_turns(scenario: Scenario) -> Iterator[str]:
    by_train = {service.train: service for service in scenario.timetable.services}
    found: dict[str, list[float]] = {}
    for service in by_train.values():
        follower = by_train.get(service.next_train)
        if follower is not None:
            last = service.calls[-1]
            turn_s = follower.calls[0].departure_s - last.arrival_s
            if turn_s < follower.turn_back_s + TURN_RESERVE_S:
                found.setdefault(last.station, []).append(turn_s)
    for station, turns_s in found.items():
        yield (
            f"calls.csv: at {station!r} {len(turns_s)} turn-backs have less than "
            f"{TURN_RESERVE_S:g} s in hand, the shortest one is {min(turns_s):.0f} s"
        )


def is_falling(scenario: Scenario, route: Sequence[str]) -> bool:
    """
    Return whether trains of a route run towards lower chainage.

    Parameters
    ----------
    scenario
        The scenario.
    route
        Tracks in running order.

    Returns
    -------
    bool
        Never on a chain.
    """
    return scenario.line.track_by_id[route[0]].direction is Direction.FALLING
