"""Booked intervals against what controllers allow: where trains are booked too close together."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

from kankaku.controllers import registry
from kankaku.railway.capacity.blocking_time import technical_headways
from kankaku.railway.capacity.permitted import permitted_profile
from kankaku.railway.motion.journey import technical_journey
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.timetable import Service, Timetable
from kankaku.scenarios.drafts.doubts import is_falling
from kankaku.studies.study import foresight_of, world_of

SLOWER_S = 1.0
"""By so much a run may be booked too fast. [s]"""


def booked_intervals_s(scenario: Scenario) -> dict[tuple[str, bool], float]:
    """
    Return the shortest booked interval between two trains on one track, by station.

    Parameters
    ----------
    scenario
        The scenario.

    Returns
    -------
    dict[tuple[str, bool], float]
        From arrival to arrival, by station and whether trains run towards lower chainage; of
        trains that come on the same tracks from the same call before. [s]
    """
    arrivals_s: dict[tuple[str, str, str, bool], list[float]] = {}
    for service in scenario.timetable.services:
        falling = is_falling(scenario, service.route)
        for before, call in pairwise(service.calls):
            key = call.station, call.track, before.station, falling
            arrivals_s.setdefault(key, []).append(call.arrival_s)
    found: dict[tuple[str, bool], float] = {}
    for (station, _, _, falling), times_s in arrivals_s.items():
        ordered = sorted(times_s)
        gaps_s = [later - sooner for sooner, later in pairwise(ordered)]
        place = station, falling
        found[place] = min([*gaps_s, found.get(place, float("inf"))])
    return found


def headway_doubts(scenario: Scenario) -> list[str]:
    """
    Return where trains are booked closer than they can follow each other.

    Parameters
    ----------
    scenario
        Valid.

    Returns
    -------
    list[str]
        For each controller and direction the worst station, and the worst run that lower speeds of
        its protection make longer than booked; a sentence each.
    """
    booked_s = booked_intervals_s(scenario)
    patterns: dict[bool, Service] = {}
    for service in scenario.timetable.services:
        falling = is_falling(scenario, service.route)
        known = patterns.get(falling)
        if known is None or len(service.calls) > len(known.calls):
            patterns[falling] = service
    alone = tuple(replace(one, next_train="", turn_back_s=0.0) for one in patterns.values())
    if not alone:
        return []
    small = replace(scenario, timetable=Timetable(alone))
    kinds: dict[object, ControllerSpec] = {}
    for spec in scenario.controllers:
        if spec.peer is None and spec.by_default:
            options = repr(sorted(spec.protection_options.items()))
            kinds.setdefault((spec.protection, options, spec.radio, spec.driving), spec)
    return [told for spec in kinds.values() for told in _of(small, spec, booked_s)]


def _of(
    scenario: Scenario, spec: ControllerSpec, booked_s: dict[tuple[str, bool], float]
) -> Iterator[str]:
    world = world_of(scenario, scenario.step_s).driven_as(spec.driving)
    foresight = foresight_of(registry.build(spec, world, scenario.radio))
    for row, service in enumerate(scenario.timetable.services):
        journey = technical_journey(world, permitted_profile(world, foresight, row), row)
        headways = technical_headways(world, foresight, journey)
        falling = is_falling(scenario, service.route)
        slow = [
            (run_s - booked, call.station, run_s)
            for at, call in enumerate(service.calls[1:], 1)
            if (run_s := float(journey.arrival_s[at] - journey.departure_s[at - 1]))
            > (booked := call.arrival_s - service.calls[at - 1].departure_s) + SLOWER_S
        ]
        if slow:
            by_s, station, run_s = max(slow)
            yield (
                f"calls.csv: to {station!r} {service.train} is booked {run_s - by_s:.0f} s, under "
                f"{spec.name} it takes {run_s:.0f} s although nobody is ahead"
            )
        late = [
            (headway.headway_s - booked_s[call.station, falling], call.station, headway.headway_s)
            for call, headway in zip(service.calls[1:], headways, strict=True)
            if headway.headway_s > booked_s.get((call.station, falling), float("inf"))
        ]
        if late:
            by_s, station, technical_s = max(late)
            more = f", and into {len(late) - 1} more stations" if len(late) > 1 else ""
            yield (
                f"calls.csv: into {station!r} trains are booked {technical_s - by_s:.0f} s apart, "
                f"under {spec.name} {technical_s:.1f} s are the least{more}"
            )
