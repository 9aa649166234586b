"""What somebody outside asks of the trains until they are asked again."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.errors import KankakuError, suggesting
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NO_HOLD_S, NOTHING, beside

Asked: TypeAlias = FloatArray | Mapping[str, float] | float | None
"""One for each train, for some trains by name, one for all of them, or nothing."""
GENTLE_MPS2 = 0.3
"""A train that is faster than its target speed brakes so hard for it, and no harder. [m/s2]"""
MOST_PLACES = 100_000
"""No line has more places beside its track. [-]"""
OUTSIDE = "outside"
"""The word for why trains are slower, if whoever asks for it has no other one."""


class AdviceError(KankakuError):
    """Advice that cannot be followed: which part of it, for whom, and what is allowed."""


@dataclass(frozen=True, slots=True, eq=False)
class LineAdvice:
    """
    What is asked of the trains; it can only lower what protection permits.

    Each part is an array of shape (n_trains,), a mapping by train, one number for all, or None.
    """

    ceiling_mps: Asked = None
    """
    Speed not to be exceeded at the end of any step, by the service brake if need be. [m/s]

    0 or more; infinite asks for nothing.
    """
    target_mps: Asked = None
    """Speed to come down to gently, by no more than :data:`GENTLE_MPS2`. [m/s], as above"""
    hold_until_s: Asked = None
    """
    No stop that lasts or begins until the next advice is over before. [s]

    Seconds after midnight; minus infinity holds nobody.
    """
    reason: IntArray | None = None
    """Which of the words given to the simulation lowers a train; the first one if None."""
    cause: IntArray | None = None
    """
    For which train, by its row, or place, by ``beside`` its column; nothing if None.

    -1 is for nothing, -2 for the first of the line's turnouts, level crossings and closures.
    """


class Outside(NamedTuple):
    """Advice as layers take it; arrays of shape (n_trains,)."""

    ceiling_mps: FloatArray
    target_mps: FloatArray
    hold_until_s: FloatArray
    reason: IntArray
    cause: IntArray

    @property
    def asked_mps(self) -> FloatArray:
        """The speed that is asked for; infinite where none is. [m/s], shape (n_trains,)"""
        return np.minimum(self.ceiling_mps, self.target_mps)


def nothing_asked(trains: int) -> Outside:
    """
    Return that nobody is asked for anything.

    Parameters
    ----------
    trains
        Number of trains. [-]

    Returns
    -------
    Outside
        It lowers nothing and holds nobody.
    """
    free_mps = np.full(trains, np.inf)
    nobody_s, none = np.full(trains, NO_HOLD_S), np.full(trains, NOTHING, dtype=np.intp)
    return Outside(free_mps, free_mps, nobody_s, np.zeros(trains, dtype=np.intp), none)


def taken(advice: object, world: World, words: int, places: int = MOST_PLACES) -> Outside:
    """
    Return advice as layers take it.

    Parameters
    ----------
    advice
        A :class:`LineAdvice`; None for nothing.
    world
        The trains.
    words
        How many words there are for reasons. [-]
    places
        How many places beside the track there are; where that is not known, a recorder refuses one
        that is not there. [-]

    Returns
    -------
    Outside
        Arrays of its own.

    Raises
    ------
    AdviceError
        If a part is of another size, is for no train, or is no number that is allowed.
    """
    nothing = nothing_asked(world.size)
    if advice is None:
        return nothing
    if not isinstance(advice, LineAdvice):
        where, problem = "advice", f"is a {type(advice).__name__}"
        raise AdviceError(where, problem, "a LineAdvice, or None")
    hold_until_s = _array("hold_until_s", advice.hold_until_s, world, NO_HOLD_S)
    endless = ~(hold_until_s < np.inf)
    if endless.any():
        where = f"hold_until_s: {world.timetable.trains[int(np.argmax(endless))]}"
        raise AdviceError(where, "has no end", "seconds after midnight, or minus infinity")
    reason = _numbers("reason", advice.reason, nothing.reason)
    if reason.min() < 0 or reason.max() >= words:
        told = f"from {reason.min()} to {reason.max()}"
        where = "reason"
        raise AdviceError(where, told, f"from 0 to {words - 1}")
    cause = _numbers("cause", advice.cause, nothing.cause)
    _refuse_unknown_causes(cause, world, places)
    return Outside(
        _speeds("ceiling_mps", advice.ceiling_mps, world),
        _speeds("target_mps", advice.target_mps, world),
        hold_until_s,
        reason,
        cause,
    )


def _speeds(name: str, asked: Asked, world: World) -> FloatArray:
    speeds_mps = _array(name, asked, world, np.inf)
    wrong = ~(speeds_mps >= 0.0)
    if wrong.any():
        row = int(np.argmax(wrong))
        where = f"{name}: {world.timetable.trains[row]}"
        raise AdviceError(where, f"{speeds_mps[row]:g}", "0 m/s or more")
    return speeds_mps


def _array(name: str, asked: Asked, world: World, otherwise: float) -> FloatArray:
    if asked is None:
        return np.full(world.size, otherwise)
    if isinstance(asked, Mapping):
        found, trains = np.full(world.size, otherwise), world.timetable.trains
        for train, value in asked.items():
            if train not in trains:
                allowed = suggesting(str(train), trains, f"one of the {world.size} trains")
                raise AdviceError(name, f"{train!r} is no train", allowed)
            found[trains.index(train)] = _number(f"{name}: {train}", value)
        return found
    try:
        array = np.array(asked, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise AdviceError(name, "holds what is no number", "numbers") from error
    if array.shape not in {(), (world.size,)}:
        allowed = f"one number for each of {world.size} trains, or one for all"
        raise AdviceError(name, f"has shape {array.shape}", allowed)
    return np.array(np.broadcast_to(array, world.size))


def _number(where: str, value: object) -> float:
    if isinstance(value, int | float | np.number) and not isinstance(value, bool):
        return float(value)
    raise AdviceError(where, f"{value!r} is no number", "a number")


def _numbers(name: str, asked: IntArray | None, usual: IntArray) -> IntArray:
    if asked is None:
        return usual
    array = np.asarray(asked)
    if array.shape != usual.shape or array.dtype.kind not in "iu":
        told = f"is {array.dtype} of shape {array.shape}"
        raise AdviceError(name, told, f"a whole number for each of {usual.size} trains")
    return array.astype(np.intp)


def _refuse_unknown_causes(cause: IntArray, world: World, places: int) -> None:
    last = beside(places - 1)
    wrong = (cause < last) | (cause >= world.size)
    if wrong.any():
        row = int(np.argmax(wrong))
        rows = f"0 to {world.size - 1} for the row of a train, {NOTHING} for nothing"
        if places:
            numbers = f"{beside(0)} to {last}" if places > 1 else f"{last}"
            rows += f", {numbers} for a place beside the track"
        where = f"cause: {world.timetable.trains[row]}"
        raise AdviceError(where, f"{cause[row]} is no train and no place", rows)
