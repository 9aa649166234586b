"""Why trains had not finished when a run ended."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray
from kankaku.railway.motion.feasibility import gradients, starting_needs_n
from kankaku.railway.plan.disruptions import Disruptions
from kankaku.railway.plan.world import World
from kankaku.railway.step.records import Unfinished
from kankaku.railway.step.state import NOTHING, Authority, LineState, beside
from kankaku.railway.wayside.trackside import places_beside

STANDING_MPS = 0.05
"""Up to this speed a train stands. [m/s]"""
HELD_M = 50.0
"""A train that could go on by more than this is not held by its authority. [m]"""
AT_STOP_M = 1.0
"""A front this near to a stop position stands at it. [m]"""


class Ending(NamedTuple):
    """The last moment of a run."""

    state: LineState
    authority: Authority
    completed: BoolArray
    """Trains that have left the line. shape (n_trains,)"""
    disruptions: Disruptions


def unfinished(world: World, ending: Ending) -> tuple[Unfinished, ...]:
    """
    Return the trains that had not finished, and what held each of them.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    ending
        The last moment of the run.

    Returns
    -------
    tuple[Unfinished, ...]
        First train first.
    """
    return tuple(_told(world, ending, row) for row in np.flatnonzero(~ending.completed).tolist())


def _told(world: World, ending: Ending, row: int) -> Unfinished:
    state = ending.state
    service = world.timetable.services[row]
    front_m = float(state.front_m[row])
    next_call = int(state.next_call[row])
    if not state.present[row]:
        other, why = _not_let_in(world, ending, row)
        sentence = f"{service.train} never entered the line at {service.origin!r}{why}"
        return Unfinished(row, "never_entered", other, front_m, sentence)
    if not state.running[row]:
        station = service.calls[next_call].station
        sentence = f"{service.train} still stood at {station!r}: its stop was not over"
        return Unfinished(row, "dwelling", station, front_m, sentence)
    place = _place(world, state, row)
    if state.speed_mps[row] > STANDING_MPS:
        return Unfinished(row, "running", "", front_m, f"{service.train} was still running {place}")
    return _standing(world, ending, row, place)


def _standing(world: World, ending: Ending, row: int, place: str) -> Unfinished:
    state, train = ending.state, world.timetable.trains[row]
    front_m = float(state.front_m[row])
    kind = world.train_types[world.type_index[row]]
    front = np.array([front_m])
    force_n = kind.traction.starting_force_n
    line = world.line_of(row)
    if force_n <= float(starting_needs_n(line, kind, front)[0]):
        permil = 1000.0 * float(gradients(line, kind, front)[0])
        why = f"{permil:.3g} permil against {force_n / 1000.0:.4g} kN starting force"
        return Unfinished(row, "stalled", "", front_m, f"{train} stalled {place}: {why}")
    if ending.authority.eoa_m[row] - front_m < HELD_M:
        cause, name = _ahead(world, ending, row)
        if cause:
            joined = "behind" if cause == "train_ahead" else "held by"
            sentence = f"{train} stood {place}, {joined} {name}"
            return Unfinished(row, cause, name, front_m, sentence)
    return Unfinished(row, "standing", "", front_m, f"{train} stood {place}")


def _ahead(world: World, ending: Ending, row: int) -> tuple[str, str]:
    """Return what bounds the way of a train first, and its name: a train or an obstruction."""
    state, wayside = ending.state, ending.state.wayside
    leader = int(state.leader[row])
    if world.line.network and state.granted_to_m[row] <= state.clear_to_m[row]:
        return _not_granted(world, ending, int(state.granted_by[row]))
    in_force = wayside.concerns[row] & (wayside.from_s == -np.inf)
    start_m = np.where(in_force, wayside.start_m, np.inf)
    nearest_m = float(start_m.min(initial=np.inf))
    if nearest_m <= state.clear_to_m[row]:
        return "obstruction", places_beside(world.line, ending.disruptions)[int(start_m.argmin())]
    if leader >= 0 and state.clear_to_m[row] < world.far_m:
        return "train_ahead", world.timetable.trains[leader]
    return "", ""


def _not_granted(world: World, ending: Ending, by: int) -> tuple[str, str]:
    """Return for what the way of a train ends: points, or a train that goes first on its track."""
    if by > NOTHING:
        return "train_ahead", world.timetable.trains[by]
    if by < NOTHING:
        return "obstruction", places_beside(world.line, ending.disruptions)[beside(by)]
    return "", ""


def _not_let_in(world: World, ending: Ending, row: int) -> tuple[str, str]:
    """Return the train for which another one did not enter, and how that is told."""
    trains = world.timetable.trains
    if not world.line.network:
        other = _at_origin(world, ending.state, row)
        return other, f": {other} was there" if other else ""
    stock = int(world.stock_from[row])
    if stock >= 0:
        return trains[stock], f": {trains[stock]} had not brought its stock"
    for one in world.enters_after[row]:
        clear_m = world.passages[one.row][one.passage].clear_m
        passed = ending.state.present[one.row] and ending.state.tail_m[one.row] >= clear_m
        if not passed and not ending.completed[one.row]:
            return trains[one.row], f": {trains[one.row]} goes first there"
    return "", ""


def _at_origin(world: World, state: LineState, row: int) -> str:
    """Return the train that stands where another one is to enter; empty if there is none."""
    origin_m, track = world.stop_m[row, 0], world.timetable.services[row].calls[0].track
    tail_m = origin_m - world.length_m[row]
    for other in np.flatnonzero(state.present).tolist():
        on_track = track in world.timetable.services[other].route
        if on_track and state.front_m[other] > tail_m and state.tail_m[other] < origin_m:
            return world.timetable.trains[other]
    return ""


def _place(world: World, state: LineState, row: int) -> str:
    front_m, call = float(state.front_m[row]), int(state.next_call[row]) - 1
    if call >= 0 and abs(front_m - world.stop_m[row, call]) <= AT_STOP_M:
        return f"at {world.timetable.services[row].calls[call].station!r}"
    chainage_m = float(world.chainage_m(row, np.array(front_m)))
    return f"at km {chainage_m / 1000.0:.3f}"
