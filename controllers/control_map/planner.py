"""
The plan of the control map: a run curve for every train, leader first.

Each train first runs as fast as bands and obstructions allow. Where they make it slower, it runs
up to them at the speed with which it comes furthest: who brakes late stands before an obstruction
that is about to go, and has to start anew; who comes slower passes it moving.
"""

from typing import NamedTuple

import numpy as np

from kankaku.controllers.ceiling import ceiling_here_mps
from kankaku.controllers.control_map.planned_map import (
    MOST_OLD,
    Aims,
    Horizon,
    Known,
    MapPlan,
    Scratch,
    blank_map,
    scratch_for,
)
from kankaku.controllers.control_map.planned_run import (
    PlannedTrains,
    RunPlace,
    RunTask,
    run,
    trains_with,
)
from kankaku.controllers.control_map.way_ahead import (
    Ends,
    EndsOfAuthority,
    Grid,
    Obstructions,
    Order,
    Others,
    lower_to_announced,
    lower_to_bands,
    lower_to_obstructions,
)
from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import Plain, compiled, formula
from kankaku.railway.motion.traction_table import level_gain_mps
from kankaku.railway.plan.brake_table import braking_v2_at, nearly_braked_stop_m
from kankaku.railway.step.state import NOTHING

CAPS_MPS = 1.5
"""Distance between the speeds that are tried. [m/s]"""
LOSS_S = 10.0
"""A lower speed is taken for this much time lost, at most. [s]"""
LEAST_MPS = 1.0
"""Nobody is asked to go slower. [m/s]"""
CREEP_M = 3.0
"""Who stands between stations stays there rather than move up by less. [m]"""
REACH_M = 3000.0
"""Bands and obstructions further ahead than this concern nobody. [m]"""


class MapScene(NamedTuple):
    """What all runs of a map are made from."""

    grid: Grid
    known: Known
    trains: PlannedTrains
    order: Order
    obstructions: Obstructions
    horizon: Horizon


@compiled
def make_map(
    now_s: float, told: Plain, line: Plain, fixed: tuple[Plain, Plain, Plain, Plain], before: Plain
) -> Plain:
    """
    Plan the run of every train on the line, leader first.

    Parameters
    ----------
    now_s
        The first moment. [s]
    told
        When each train has reported last, and its front, speed and call then, and since when it
        stands there; as in :class:`~kankaku.controllers.centre.reports.Reports`.
    line
        What is known by wire: the fields of :class:`~kankaku.railway.step.state.Whereabouts`, how
        far everything is granted, and what is not.
    fixed
        Fields of :class:`PlannedTrains`, :class:`Order`, :class:`Obstructions`, :class:`Horizon`.
    before
        Fields of the map that trains have gone by since their reports.

    Returns
    -------
    Plain
        The fields of :class:`MapPlan`.
    """
    trains, horizon = trains_with(fixed[0]), Horizon(*fixed[3])
    grid = Grid(now_s, trains.step_s, horizon.moments)
    known, tail_m = _known(told, line, trains)
    scene = MapScene(grid, known, trains, Order(*fixed[1]), Obstructions(*fixed[2]), horizon)
    earlier, rows = MapPlan(*before), line[0][5]
    plan, scratch = (
        blank_map(now_s, rows, trains.length_m.size, grid.moments),
        scratch_for(grid.moments),
    )
    others = Others(plan.place, plan.rear_m, tail_m, known.gone, scene.order)
    _plan_all(scene, others, earlier, plan, scratch)
    return (
        plan.made_s,
        plan.rows,
        plan.place,
        plan.front_m,
        plan.speed_mps,
        plan.rear_m,
        plan.ahead_m,
        plan.free_m,
        plan.planned,
        plan.free_by,
        plan.slowed_by,
    )


@compiled
def _known(told: Plain, line: Plain, trains: PlannedTrains) -> tuple[Known, FloatArray]:
    """Return what the centre knows of trains, and where their tails are by their reports."""
    (since_s, reported_m, speed_mps, call, stopped_s), (whereabouts, granted_to_m, granted_by) = (
        told,
        line,
    )
    seen_m, present = whereabouts[0], whereabouts[3]
    size = present.size
    leaves_s, gone = np.full(size, np.inf), np.zeros(size, dtype=np.bool_)
    for row in whereabouts[5]:
        if np.isfinite(stopped_s[row]):
            ready_s = stopped_s[row] + trains.minimum_dwell_s[row, call[row]]
            leaves_s[row] = max(trains.booked_departure_s[row, call[row]], ready_s)
    tail_m = np.empty(size)
    for row in range(size):
        # Detection at both ends of the line is by wire.
        gone[row] = not present[row] and seen_m[row] > trains.origin_m[row]
        tail_m[row] = reported_m[row] - trains.length_m[row]
    known = Known(
        since_s,
        reported_m,
        speed_mps,
        call,
        leaves_s,
        gone,
        granted_to_m,
        granted_by,
    )
    return known, tail_m


@formula
def _plan_all(
    scene: MapScene, others: Others, earlier: MapPlan, plan: MapPlan, scratch: Scratch
) -> None:
    """Write the runs and bands of all trains on the line, leader first."""
    grid, known, trains = scene.grid, scene.known, scene.trains
    for place in range(plan.rows.size):
        row = plan.rows[place]
        for moment in range(grid.moments):
            plan.rear_m[place, moment] = others.tail_m[row]
            plan.front_m[place, moment] = plan.ahead_m[place, moment] = known.front_m[row]
    for row in plan.rows:
        age = np.round((grid.now_s - known.since_s[row]) / trains.step_s)
        old = int(min(age, MOST_OLD + 1.0))
        if old <= MOST_OLD:
            plan.planned[row] = True
            present = _at_present(row, old, known, earlier, trains, scratch)
            _look_ahead(scene, others, row, present, plan, scratch)
            _plan_train(scene, row, old, present, plan, scratch)


@formula
def _look_ahead(
    scene: MapScene,
    others: Others,
    row: int,
    place: RunPlace,
    plan: MapPlan,
    scratch: Scratch,
) -> None:
    """Write how far the way of a train is free at every moment, by bands and obstructions."""
    known, trains = scene.known, scene.trains
    eoas = EndsOfAuthority(scratch.eoa_m, scratch.eoa_by)
    ends = Ends(place.front_m, others.tail_m[row], place.front_m + REACH_M)
    eoa_m, eoa_by = eoas
    for moment in range(eoa_m.size):
        eoa_m[moment], eoa_by[moment] = trains.far_m, NOTHING
    lower_to_bands(eoas, row, ends, scene.grid, others)
    lower_to_obstructions(eoas, row, ends, scene.grid, others, scene.obstructions)
    granted = known.granted_to_m[row] < eoa_m[0]
    plan.free_by[row] = known.granted_by[row] if granted else eoa_by[0]
    plan.free_m[row] = min(eoa_m[0], known.granted_to_m[row]) - trains.margin_m
    to_stop_m = trains.stop_m[row, place.call] - place.front_m
    waits = place.speed_mps == 0.0 and place.leaves_s == np.inf
    if waits and min(plan.free_m[row] - place.front_m, to_stop_m) < CREEP_M < to_stop_m:
        for moment in range(eoa_m.size):
            eoa_m[moment], eoa_by[moment] = place.front_m, plan.free_by[row]


@formula
def _plan_train(
    scene: MapScene, row: int, old: int, place: RunPlace, plan: MapPlan, scratch: Scratch
) -> None:
    """Write the run and the band of a train that may go as far as was looked ahead."""
    trains, eoas = scene.trains, EndsOfAuthority(scratch.eoa_m, scratch.eoa_by)
    at = plan.place[row]
    front_m, speed_mps, ahead_m = plan.front_m[at], plan.speed_mps[at], plan.ahead_m[at]
    for _ in range(2):
        hindered = _choose(trains, row, place, scene.grid, scratch, (front_m, speed_mps))
        plan.slowed_by[row] = scratch.eoa_by[hindered] if hindered else NOTHING
        _write_rears(scene, row, old, scratch, front_m, plan.rear_m[at])
        _write_stopping(trains, row, front_m, speed_mps, ahead_m)
        announced = scene.obstructions
        if not lower_to_announced(eoas, row, place.front_m, scene.grid, ahead_m, announced):
            break
    for moment in range(ahead_m.size):
        ahead_m[moment] += trains.margin_m


@formula
def _at_present(
    row: int, old: int, known: Known, earlier: MapPlan, trains: PlannedTrains, scratch: Scratch
) -> RunPlace:
    """Return where a train is that has gone by what was planned before since its report."""
    since_s, at = known.since_s[row], earlier.place[row]
    for step in range(old):
        moment = int(np.round((since_s - earlier.made_s) / trains.step_s)) + step + 1
        moment = min(max(moment, 0), earlier.speed_mps.shape[1] - 1)
        scratch.cap_mps[step] = earlier.speed_mps[at, moment] if earlier.planned[row] else 0.0
    kept_m = earlier.free_m[row] if earlier.planned[row] else known.front_m[row]
    kept_v2 = braking_v2_at(trains.braking, row, kept_m)
    for moment in range(old + 1):
        scratch.kept_v2_m2ps2[moment] = kept_v2
    place = RunPlace(known.front_m[row], known.speed_mps[row], known.call[row], known.leaves_s[row])
    task = RunTask(
        since_s,
        scratch.cap_mps[:old],
        scratch.kept_v2_m2ps2[: old + 1],
        scratch.path_m[: old + 1],
        scratch.path_mps[: old + 1],
    )
    place, _, _ = run(trains, row, place, task)
    return place


@formula
def _choose(
    trains: PlannedTrains,
    row: int,
    place: RunPlace,
    grid: Grid,
    scratch: Scratch,
    written: tuple[FloatArray, FloatArray],
) -> int:
    """Write a train's run under its ends; return the last moment one made it slower, or 0."""
    for moment in range(grid.moments):
        bound_m = min(scratch.eoa_m[moment], trains.far_m) - trains.margin_m
        scratch.end_v2_m2ps2[moment] = braking_v2_at(trains.braking, row, bound_m)
    cap_mps = scratch.cap_mps[: grid.moments - 1]
    for moment in range(cap_mps.size):
        cap_mps[moment] = np.inf
    task = RunTask(grid.now_s, cap_mps, scratch.end_v2_m2ps2, written[0], written[1])
    after, arrival_s, hindered = run(trains, row, place, task)
    call = place.call + 1 if place.leaves_s < np.inf else place.call
    due_s = trains.booked_arrival_s[row, call] - trains.early_s
    if hindered or arrival_s < due_s < np.inf:
        aims = Aims(
            call,
            due_s,
            grid.now_s + grid.step_s * (grid.moments - 1),
            ceiling_here_mps(trains.ceiling, row, place.front_m),
        )
        _slow_down(trains, row, place, (after, arrival_s, hindered), aims, (task, scratch))
    return hindered


@formula
def _slow_down(
    trains: PlannedTrains,
    row: int,
    place: RunPlace,
    fastest: tuple[RunPlace, float, int],
    aims: Aims,
    tasks: tuple[RunTask, Scratch],
) -> None:
    """Write a slower run that comes as far, or arrives when it is due, if there is one."""
    (after, arrival_s, hindered), (task, scratch) = fastest, tasks
    early = arrival_s < aims.due_s < np.inf
    # Once nothing is in its way any more it may run as it likes.
    held = hindered or task.cap_mps.size
    best_m = _reached_m(trains, row, after, arrival_s, aims)
    trial = RunTask(
        task.now_s,
        task.cap_mps,
        task.end_v2_m2ps2,
        scratch.trial_front_m,
        scratch.trial_speed_mps,
    )
    cap = aims.fastest_mps - CAPS_MPS
    while cap > LEAST_MPS:
        for moment in range(held):
            task.cap_mps[moment] = cap
        after, arrival_s, touched = run(trains, row, place, trial)
        reached_m = _reached_m(trains, row, after, arrival_s, aims)
        if early and arrival_s > aims.due_s:
            return
        if not early and reached_m < best_m - LOSS_S * aims.fastest_mps:
            return
        best_m = max(best_m, reached_m)
        for moment in range(task.front_m.size):
            task.front_m[moment] = trial.front_m[moment]
            task.speed_mps[moment] = trial.speed_mps[moment]
        if hindered and not touched:
            return
        cap -= CAPS_MPS


@formula
def _write_rears(
    scene: MapScene,
    row: int,
    old: int,
    scratch: Scratch,
    front_m: FloatArray,
    rear_m: FloatArray,
) -> None:
    """Write the rear of a band: the tail before the longest delay, but never before its report."""
    known, trains, horizon = scene.known, scene.trains, scene.horizon
    reported_m = known.front_m[row] - trains.length_m[row]
    for moment in range(rear_m.size):
        rear_m[moment] = reported_m
    if old > horizon.old_steps:
        # It may have braked since, and nobody would know.
        return
    path_m = scratch.path_m[: old + horizon.moments]
    for moment in range(front_m.size):
        path_m[old + moment] = front_m[moment]
    leaves = leaving_step(path_m, known.leaves_s[row] < np.inf)
    for moment in range(max(horizon.old_steps - old, 0), horizon.moments):
        step = moment + old - horizon.old_steps
        if step > leaves:
            step = max(step - horizon.reserve_steps, leaves)
        rear_m[moment] = path_m[step] - trains.length_m[row]
        if path_m[step] >= trains.end_m:
            rear_m[moment] = trains.far_m


@formula
def _write_stopping(
    trains: PlannedTrains,
    row: int,
    front_m: FloatArray,
    speed_mps: FloatArray,
    stopping_m: FloatArray,
) -> None:
    for moment in range(front_m.size):
        front, speed = front_m[moment], speed_mps[moment]
        stopping_m[moment] = nearly_braked_stop_m(trains.braking, row, front, speed)


@formula
def leaving_step(front_m: FloatArray, stands: bool) -> int:
    """
    Return after which step of a run a train leaves a stop.

    Parameters
    ----------
    front_m
        The run. [m], shape (n_steps + 1,)
    stands
        It stands at its stop in the beginning.

    Returns
    -------
    int
        The last step at which it stands there; past the end if it does not leave one.
    """
    for step in range(front_m.size - 1):
        moves = front_m[step + 1] > front_m[step]
        if stands and moves:
            return step
        stands = not moves
    return front_m.size


@formula
def _reached_m(
    trains: PlannedTrains, row: int, after: RunPlace, arrival_s: float, aims: Aims
) -> float:
    """Return how far a run comes: on from a stop, and back what it has to catch up in speed."""
    if arrival_s < np.inf:
        on_m = aims.fastest_mps * (aims.end_s - arrival_s)
        reached_m: float = trains.stop_m[row, aims.call] + on_m
        return reached_m
    missing_mps = max(aims.fastest_mps - after.speed_mps, 0.0)
    half_mps = 0.5 * aims.fastest_mps
    gain = level_gain_mps(trains.ceiling.traction, row, half_mps) / trains.step_s
    short_m: float = 0.5 * missing_mps * missing_mps / gain
    return after.front_m - short_m
