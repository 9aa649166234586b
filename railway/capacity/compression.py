"""
Compression of a timetable: the booked trains moved together until their blocking times touch.

Every train keeps its own pattern: its tracks, run times, dwells and place in the order. Trains that
run on different tracks of a section are in each other's way on their common tracks only, and
at the points where those begin and end.

References
----------
.. [1] UIC Code 406, *Capacity*, 2nd edition, 2013, chapter 4.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.capacity.blocking_time import (
    EXACT_M,
    Given,
    Search,
    SharedTrack,
    leg_headway,
    needed_eoa_m,
)
from kankaku.railway.motion.journey import Journey
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.timetable import Service
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight

ROUGH = Search(sample_s=0.5, exact_s=0.05)
"""How the moment is searched at which two trains touch."""
LOOK_S = 1.0
"""Moments at which a train ahead is looked at first. [s]"""

Shifts = Mapping[tuple[int, int], float]
"""By how much a train must be moved against one ahead of it, at least; rows of both. [s]"""


def common_ways(line: Line, leader: Service, follower: Service) -> tuple[SharedTrack, ...]:
    """
    Return where a train can be in the way of another.

    Parameters
    ----------
    line
        The line.
    leader
        The train that goes first.
    follower
        The other one.

    Returns
    -------
    tuple[SharedTrack, ...]
        One for every run of sections that both pass on the same track. The points before it
        are kept for the leader until its tail has cleared them.
    """
    ahead, behind = _track_by_section(line, leader), _track_by_section(line, follower)
    common = [section for section in behind if ahead.get(section) == behind[section]]
    firsts = [section for section in common if section - 1 not in common]
    lasts = [section for section in common if section + 1 not in common]
    ways = []
    for first, last in zip(firsts, lasts, strict=True):
        way = SharedTrack()
        if first - 1 in ahead and first - 1 in behind:
            gate_m, entered_m, throw_s = _points_at_end(line, first - 1)
            way = way._replace(gate_m=gate_m, entered_m=entered_m, throws_s=(throw_s, 0.0))
        if last + 1 < len(line.sections):
            parts_m, cleared_m, throw_s = _points_at_end(line, last)
            throws_s = way.throws_s[0], throw_s
            way = way._replace(parts_m=parts_m, cleared_m=cleared_m, throws_s=throws_s)
        ways.append(way)
    return tuple(ways)


def _track_by_section(line: Line, service: Service) -> dict[int, str]:
    return {line.section_of_track[track]: track for track in service.route}


def _points_at_end(line: Line, section: int) -> tuple[float, float, float]:
    """Return where the points at the end of a section foul from and to, and how long they throw."""
    end_m = line.sections[section].end_m
    turnout = line.turnout_at.get(end_m)
    if turnout is None:
        return end_m, end_m, 0.0
    return turnout.fouling_start_m, turnout.fouling_end_m, turnout.throw_s + turnout.proof_s


def least_shifts_s(world: World, foresight: Foresight, journeys: Sequence[Journey]) -> Shifts:
    """
    Return by how much trains must be moved against those ahead of them.

    Parameters
    ----------
    world
        Line and timetable.
    foresight
        Protection.
    journeys
        One per train, in the order of the timetable.

    Returns
    -------
    Shifts
        For each train and each that uses one of its tracks right before it; negative where the
        booked interval is longer than needed. [s]
    """
    services = world.timetable.services
    last_on_track: dict[str, list[int]] = {}
    shifts_s: dict[tuple[int, int], float] = {}
    for row, service in enumerate(services):
        before = {ahead for track in service.route for ahead in last_on_track.get(track, ())}
        needs = _needs(world, foresight, journeys[row])
        for ahead in sorted(before):
            ways = common_ways(world.line, services[ahead], service)
            givens = [
                Given(world, foresight, journeys[ahead], row, call, ways)
                for call in range(len(needs))
            ]
            shifts_s[ahead, row] = _least_shift_s(givens, journeys[row], needs)
        for track in service.route:
            # Behind a train that leaves the line on the way others still meet those before it.
            kept = last_on_track.get(track, []) if world.leaves_at_stop[row] else []
            last_on_track[track] = [*kept, row]
    return shifts_s


class _Needs(NamedTuple):
    """What a train needs on its way to a call."""

    time_s: FloatArray
    """Moments, even ones. [s], shape (n_times,)"""
    eoa_m: FloatArray
    """The greatest limit that it has needed until then. [m], shape (n_times,)"""


def _needs(world: World, foresight: Foresight, journey: Journey) -> list[_Needs]:
    """Return what a train needs call by call, at first for its stay at its origin."""
    begins_s = [journey.arrival_s[0], *journey.departure_s[:-1].tolist()]
    ends_s = [journey.departure_s[0], *journey.arrival_s[1:].tolist()]
    needs = []
    for call, (begin_s, end_s) in enumerate(zip(begins_s, ends_s, strict=True)):
        # Two moments at least, also for a train that does not stay at its origin.
        samples = max(int(np.ceil((end_s - begin_s) / ROUGH.sample_s)), 1) + 1
        time_s = begin_s + ROUGH.sample_s * np.arange(samples)
        eoa_m = journey.at(time_s)[0]
        if call:
            eoa_m = needed_eoa_m(world, foresight, journey, time_s)
        needs.append(_Needs(time_s, np.maximum.accumulate(eoa_m)))
    return needs


def _bound_s(given: Given, needs: _Needs) -> float:
    """Return what the headway on a leg does not exceed, at little cost."""
    leader = given.leader
    clock_s = np.arange(leader.time_s[0], leader.leaves_s + LOOK_S, LOOK_S)
    eoa_m = np.min([given.eoa_m(way, clock_s) for way in given.ways], axis=0)
    given_at = np.searchsorted(eoa_m, needs.eoa_m - EXACT_M)
    since_s = np.where(given_at > 0, clock_s[np.minimum(given_at, clock_s.size - 1)], -np.inf)
    latest_s = float((since_s[1:] - needs.time_s[:-1]).max())
    return latest_s + given.foresight.release_delay_s


def _least_shift_s(givens: Sequence[Given], follower: Journey, needs: Sequence[_Needs]) -> float:
    bounds_s = [_bound_s(given, need) for given, need in zip(givens, needs, strict=True)]
    greatest_s = -np.inf
    for call in np.argsort(bounds_s)[::-1].tolist():
        if bounds_s[call] <= greatest_s:
            break
        leg = leg_headway(givens[call], follower, ROUGH._replace(above_s=greatest_s))
        greatest_s = max(greatest_s, leg.headway_s)
    return greatest_s


def compressed_shifts_s(rows: Sequence[int], least_s: Shifts) -> dict[int, float]:
    """
    Move some trains together, the first one staying where it is.

    Parameters
    ----------
    rows
        The trains, in the order of the timetable.
    least_s
        By how much a train must be moved against one ahead. [s]

    Returns
    -------
    dict[int, float]
        By how much each is moved; earlier is negative. [s]
    """
    moved_s: dict[int, float] = {}
    for row in rows:
        bounds_s = [
            shift_s + moved_s[ahead]
            for (ahead, behind), shift_s in least_s.items()
            if behind == row and ahead in moved_s
        ]
        moved_s[row] = max(bounds_s, default=0.0)
    return moved_s


def occupation_s(
    journeys: Sequence[Journey], rows: Sequence[int], least_s: Shifts
) -> tuple[float, float]:
    """
    Return how long some trains need, and how long they have, from the first to the last.

    Parameters
    ----------
    journeys
        One per train of the timetable.
    rows
        Two trains or more, in order.
    least_s
        By how much a train must be moved against one ahead. [s]

    Returns
    -------
    tuple[float, float]
        Time between first and last arrival at the end of the journey, compressed and as booked;
        their ratio is the occupation rate. [s]
    """
    first, last = journeys[rows[0]], journeys[rows[-1]]
    booked_s = float(last.arrival_s[-1] - first.arrival_s[-1])
    return booked_s + compressed_shifts_s(rows, least_s)[rows[-1]], booked_s
