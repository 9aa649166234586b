"""Steps between events, compiled in one piece from what the layers offer."""

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled_with, formula
from kankaku.railway.step.bundles import Lasting, Span
from kankaku.railway.step.reasons import REASON_OF_BOUND, explain
from kankaku.railway.wayside.leaders import lower_to_tails


class Watched(NamedTuple):
    """What ends a bundle beside the engine's own; trackers watch it."""

    until_s: float
    """A step that begins at this time or later needs Python. [s]"""
    front_watch_m: FloatArray
    """So does one in which a front has come to where signalling waits. [m], shape (n_trains,)"""
    tail_watch_m: FloatArray
    """The same of tails. [m], shape (n_trains,)"""
    next_clear_m: FloatArray
    """So does one in which a tail has left its track. [m], shape (n_trains,)"""
    ready: IntArray
    """So does one in which one of these trains has departed. shape (n_ready,)"""
    length_m: FloatArray
    """Lengths of the trains. [m], shape (n_trains,)"""
    present: BoolArray
    running: BoolArray
    rows: IntArray
    """Rows of the trains that are present. shape (n_present,)"""


class BlockRows(NamedTuple):
    """Where a bundle writes what is recorded; rows are steps."""

    at: int
    """Row of its first step."""
    time_s: FloatArray
    front_m: FloatArray
    speed_mps: FloatArray
    eoa_m: FloatArray
    delay_s: FloatArray


class Sampling(NamedTuple):
    """When reasons are sampled, and where they go."""

    until_sample: int
    """Steps from the first one of the bundle to the first one that is sampled. [-]"""
    every: int
    """Steps from one to the next. [-]"""
    found: IntArray
    """From :func:`~kankaku.railway.step.reasons.explain`. shape (n_samples, 3, n_trains)"""
    asked: IntArray
    """Reason of the advice and bound of the command. shape (n_samples, 2, n_trains)"""


@formula
def _is_engines(span: Span, front_m: FloatArray, speed_mps: FloatArray) -> bool:
    """Return whether a train is about to stop, or to leave the line."""
    for place in range(span.rows.size):
        row = span.rows[place]
        speed, front = speed_mps[row], front_m[row]
        halted = speed <= span.halting_mps
        if halted and abs(front - span.aim_m[place]) <= span.near_m:
            return True
        if front + span.lead_s * speed + span.lead_m >= span.end_m[place]:
            return True
    return False


@formula
def _is_trackers(
    watched: Watched, front_m: FloatArray, tail_m: FloatArray, speed_mps: FloatArray
) -> bool:
    """Return whether a train has come to where somebody waits for it, or has departed."""
    for row in watched.ready:
        if speed_mps[row] > 0.0:
            return True
    for row in watched.rows:
        if tail_m[row] >= watched.next_clear_m[row]:
            return True
    for row in range(tail_m.size):
        if front_m[row] >= watched.front_watch_m[row] or tail_m[row] >= watched.tail_watch_m[row]:
            return True
    return False


@formula
def _is_event(
    span: Span, watched: Watched, front_m: FloatArray, tail_m: FloatArray, speed_mps: FloatArray
) -> bool:
    """Return whether the engine or the tracker has something to do."""
    engines = _is_engines(span, front_m, speed_mps)
    return engines or _is_trackers(watched, front_m, tail_m, speed_mps)


@formula
def _move(
    span: Span,
    front_m: FloatArray,
    speed_mps: FloatArray,
    next_mps: FloatArray,
    told_mps: FloatArray,
) -> None:
    """Move the running trains by a step of constant acceleration, and note what was commanded."""
    for row in span.rows:
        told_mps[row] = next_mps[row]
        front_m[row] += 0.5 * (speed_mps[row] + next_mps[row]) * span.step_s
        speed_mps[row] = next_mps[row]


@formula
def _keep(
    kept: BlockRows,
    at: int,
    front_m: FloatArray,
    speed_mps: FloatArray,
    ends: tuple[FloatArray, FloatArray],
) -> None:
    """Record the start of a step."""
    for row in range(front_m.size):
        kept.front_m[at, row], kept.speed_mps[at, row] = front_m[row], speed_mps[row]
        kept.eoa_m[at, row], kept.delay_s[at, row] = ends[0][row], ends[1][row]


@formula
def _sample(
    sampling: Sampling, at: int, found: IntArray, reason: IntArray, bound: IntArray
) -> None:
    """Keep why trains are as fast as they are."""
    for row in range(reason.size):
        sampling.asked[at, 0, row], sampling.asked[at, 1, row] = reason[row], bound[row]
        for part in range(3):
            sampling.found[at, part, row] = found[part, row]


@cache
def steps_of(
    protect: Callable[..., Any], advise: Callable[..., Any], command: Callable[..., Any]
) -> Callable[..., Any]:
    """
    Return the compiled loop over the steps of three layers.

    Parameters
    ----------
    protect, advise, command
        Compiled steps as :mod:`kankaku.railway.step.bundles` says.

    Returns
    -------
    Callable[..., Any]
        Compiled at its first call. It takes fronts and speeds, a span, what is watched and what
        lasts, plain; fields and memories of the layers, the drive's fields; and where it writes.
        It returns how many steps it took, the fronts and speeds after the last of them, what was
        commanded, shape (n_steps, n_trains), both memories, how many samples it took, and the
        steps from then to the next one.
    """

    def bundle(
        start: tuple[FloatArray, FloatArray],
        plains: tuple[Plain, Plain, Plain],
        layers: tuple[tuple[Plain, Plain], tuple[Plain, Plain], Plain],
        kept_fields: Plain,
        sampling_fields: Plain,
    ) -> tuple[int, FloatArray, FloatArray, FloatArray, Plain, Plain, int, int]:
        span, watched, lasting = Span(*plains[0]), Watched(*plains[1]), Lasting(*plains[2])
        kept, sampling = BlockRows(*kept_fields), Sampling(*sampling_fields)
        (guarding, permitted), (operating, planned), driving = layers
        front_m, speed_mps = start[0].copy(), start[1].copy()
        until_s = min(span.until_s, watched.until_s)
        most = span.time_s.size
        told_mps = np.zeros((most, front_m.size))
        taken, samples, until_sample = 0, 0, sampling.until_sample
        for step in range(most):
            now_s, tail_m = span.time_s[step], front_m - watched.length_m
            if now_s >= until_s or _is_event(span, watched, front_m, tail_m, speed_mps):
                break
            clear_to_m = lasting.granted_to_m.copy()
            lower_to_tails(clear_to_m, tail_m, lasting.leader, lasting.follows)
            masks = watched.present, watched.running, watched.rows
            trains = (front_m, tail_m, speed_mps, *masks)
            instant = now_s, trains, clear_to_m, plains[2]
            authority, permitted_after = protect(instant, guarding, permitted)
            advice, planned_after, asks = advise(instant, authority, operating, planned)
            if asks:
                break
            permitted, planned = permitted_after, planned_after
            next_mps, bound = command(instant, authority, advice, driving)
            kept.time_s[kept.at + step] = now_s
            _keep(kept, kept.at + step, front_m, speed_mps, (authority[0], authority[2]))
            if until_sample == 0:
                causes = (authority[3], authority[4]), (advice[1], advice[2])
                found = explain(watched.running, bound, *causes, REASON_OF_BOUND)
                _sample(sampling, samples, found, advice[1], bound)
                samples, until_sample = samples + 1, sampling.every
            until_sample -= 1
            _move(span, front_m, speed_mps, next_mps, told_mps[step])
            taken += 1
        told_mps = told_mps[:taken]
        return taken, front_m, speed_mps, told_mps, permitted, planned, samples, until_sample

    return compiled_with(bundle, protect, advise, command)
