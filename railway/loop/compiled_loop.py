"""Steps between events, compiled in one piece from what the layers offer."""

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, formula, formula_with
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
        if tail_m[row] >= min(watched.next_clear_m[row], watched.tail_watch_m[row]):
            return True
        if front_m[row] >= watched.front_watch_m[row]:
            return True
    return False


@formula
def is_event(
    span: Span, watched: Watched, front_m: FloatArray, tail_m: FloatArray, speed_mps: FloatArray
) -> bool:
    """
    Return whether the engine or the tracker has something to do.

    Parameters
    ----------
    span
        What the engine leaves to whoever commands.
    watched
        What the tracker waits for.
    front_m, tail_m
        Fronts and tails. [m], shape (n_trains,)
    speed_mps
        Speeds. [m/s], shape (n_trains,)

    Returns
    -------
    bool
        Then the step needs Python.
    """
    engines = _is_engines(span, front_m, speed_mps)
    return engines or _is_trackers(watched, front_m, tail_m, speed_mps)


@formula
def clear(watched: Watched, lasting: Lasting, tail_m: FloatArray, clear_to_m: FloatArray) -> None:
    """
    Work out how far the way of each train is clear.

    Parameters
    ----------
    watched
        Who is on the line.
    lasting
        What is granted, and who follows whom.
    tail_m
        Tails. [m], shape (n_trains,)
    clear_to_m
        Written to. [m], shape (n_trains,)
    """
    for row in watched.rows:
        clear_to_m[row] = lasting.granted_to_m[row]
    lower_to_tails(clear_to_m, tail_m, watched.rows, (lasting.leader, lasting.follows))


@formula
def move(
    span: Span,
    watched: Watched,
    trains: tuple[FloatArray, FloatArray, FloatArray],
    next_mps: FloatArray,
    told_mps: FloatArray,
) -> None:
    """
    Move the running trains by a step of constant acceleration, and note what was commanded.

    Parameters
    ----------
    span
        Who takes commands, and for how long.
    watched
        Lengths.
    trains
        Fronts, tails [m] and speeds; written to. [m/s], shape (n_trains,) each
    next_mps
        Speeds at the end of the step. [m/s], shape (n_trains,)
    told_mps
        The same of those who take commands; written to. [m/s], shape (n_running,)
    """
    front_m, tail_m, speed_mps = trains
    for place in range(span.rows.size):
        row = span.rows[place]
        told_mps[place] = next_mps[row]
        front_m[row] += 0.5 * (speed_mps[row] + next_mps[row]) * span.step_s
        tail_m[row] = front_m[row] - watched.length_m[row]
        speed_mps[row] = next_mps[row]


@formula
def keep(
    kept: BlockRows,
    at: int,
    trains: tuple[FloatArray, FloatArray, IntArray],
    ends: tuple[FloatArray, FloatArray],
) -> None:
    """
    Record the start of a step, of trains that are on the line.

    Parameters
    ----------
    kept
        Where it is recorded.
    at
        In which row. [-]
    trains
        Fronts [m] and speeds [m/s], shape (n_trains,) each, and who is on the line.
    ends
        Ends of authority [m], and delays with which they count. [s], shape (n_trains,) each
    """
    front_m, speed_mps, rows = trains
    for row in rows:
        kept.front_m[at, row], kept.speed_mps[at, row] = front_m[row], speed_mps[row]
        kept.eoa_m[at, row], kept.delay_s[at, row] = ends[0][row], ends[1][row]


@formula
def sample(
    sampling: Sampling, at: int, watched: Watched, layers: tuple[Plain, Plain, IntArray]
) -> None:
    """
    Keep why trains are as fast as they are.

    Parameters
    ----------
    sampling
        Where it is kept.
    at
        Number of the sample. [-]
    watched
        Who is on the line, and who runs.
    layers
        Authority, advice, and what bounds the drive.
    """
    authority, advice, bound = layers
    why = bound, (authority[3], authority[4]), (advice[1], advice[2])
    explain(watched.running, watched.rows, why, REASON_OF_BOUND, sampling.found[at])
    for row in watched.rows:
        sampling.asked[at, 0, row], sampling.asked[at, 1, row] = advice[1][row], bound[row]


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
        Compiled at its first call. It takes fronts, tails, speeds and an array for clear ways; a
        span, what is watched and what lasts, plain; of protection and operation the fields, the
        memory, another one like it, and what it tells, and of the drive the fields and what it
        tells; an array for what is commanded, shape (n_steps, n_running); and where it writes. It
        returns how many steps it took, how many samples, and the steps from then to the next one.
        Fronts, tails and speeds are then those after the last step, and of the two memories the
        other one is the newer after an odd number of steps.
    """

    def bundle(
        trains: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
        plains: tuple[Plain, Plain, Plain],
        layers: tuple[Plain, Plain, Plain],
        told_mps: FloatArray,
        kept_fields: Plain,
        sampling_fields: Plain,
    ) -> tuple[int, int, int]:
        span, watched, lasting = Span(*plains[0]), Watched(*plains[1]), Lasting(*plains[2])
        kept, sampling = BlockRows(*kept_fields), Sampling(*sampling_fields)
        guarding, permitted, permitted_after, authority = layers[0]
        operating, planned, planned_after, advice = layers[1]
        driving, told = layers[2]
        front_m, tail_m, speed_mps, clear_to_m = trains
        whereabouts = front_m, tail_m, speed_mps, watched.present, watched.running, watched.rows
        until_s = min(span.until_s, watched.until_s)
        taken, samples, until_sample = 0, 0, sampling.until_sample
        for step in range(told_mps.shape[0]):
            now_s = span.time_s[step]
            if now_s >= until_s or is_event(span, watched, front_m, tail_m, speed_mps):
                break
            clear(watched, lasting, tail_m, clear_to_m)
            instant = now_s, whereabouts, clear_to_m, plains[2]
            protect(instant, guarding, permitted, permitted_after, authority)
            if advise(instant, authority, operating, planned, planned_after, advice):
                break
            command(instant, authority, advice, driving, told)
            permitted, permitted_after = permitted_after, permitted
            planned, planned_after = planned_after, planned
            kept.time_s[kept.at + step] = now_s
            places = front_m, speed_mps, watched.rows
            keep(kept, kept.at + step, places, (authority[0], authority[2]))
            if until_sample == 0:
                sample(sampling, samples, watched, (authority, advice, told[1]))
                samples, until_sample = samples + 1, sampling.every
            until_sample -= 1
            move(span, watched, (front_m, tail_m, speed_mps), told[0], told_mps[step])
            taken += 1
        return taken, samples, until_sample

    return formula_with(bundle, protect, advise, command)
