"""Layers that do what somebody outside asks for, as far as the layers below let them."""

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from kankaku.live.line_advice import GENTLE_MPS2, Outside, nothing_asked
from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import Plain, formula, formula_with
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import LayerSteps, offered
from kankaku.railway.step.control import Operation, Supervision
from kankaku.railway.step.state import Advice, Authority, LineState, Orders, no_orders


@formula
def lower_to_asked(
    speed_mps: FloatArray,
    rows: IntArray,
    asked: tuple[FloatArray, FloatArray, IntArray, IntArray],
    gentle_mps: float,
    told: Plain,
) -> None:
    """
    Lower ceilings to what is asked for, and write why and for what.

    Parameters
    ----------
    speed_mps
        Speeds. [m/s], shape (n_trains,)
    rows
        Trains on the line. shape (n_present,)
    asked
        Ceilings and target speeds, [m/s], reasons and causes. shape (n_trains,) each
    gentle_mps
        By so much a target speed slows a train in a step. [m/s]
    told
        The advice, written to.
    """
    ceiling_mps, target_mps, reason, cause = asked
    for train in rows:
        lowest = min(ceiling_mps[train], max(target_mps[train], speed_mps[train] - gentle_mps))
        if lowest < told[0][train]:
            told[0][train], told[1][train], told[2][train] = lowest, reason[train], cause[train]


@cache
def _lowered(advise: Callable[..., Any]) -> Callable[..., Any]:
    """Return the compiled step of what is asked for over that of an operation."""

    def outside(
        instant: Plain, authority: Plain, fields: Plain, memory: Plain, after: Plain, told: Plain
    ) -> bool:
        inner, own, asked, gentle_mps = fields
        asks: bool = advise(instant, authority, inner, memory, after, own)
        rows = instant[1][5]
        for train in rows:
            told[0][train], told[1][train] = own[0][train], own[1][train]
            told[2][train] = own[2][train]
        lower_to_asked(instant[1][2], rows, asked, gentle_mps, told)
        return asks

    return formula_with(outside, advise)


class OutsideOperation:
    """
    Lowers what an operation advises to what somebody outside asks for.

    Parameters
    ----------
    operation
        The operation below.
    world
        The trains.
    words
        Why somebody outside may slow trains.
    """

    def __init__(self, operation: Operation[Any], world: World, words: tuple[str, ...]) -> None:
        self._operation = operation
        self._gentle_mps = GENTLE_MPS2 * world.step_s
        self.reasons = tuple(dict.fromkeys((*operation.reasons, *words)))
        self._numbers = np.array([self.reasons.index(word) for word in words], dtype=np.intp)
        self.ask(nothing_asked(world.size))

    def ask(self, outside: Outside) -> None:
        """
        Take what is asked for from now on.

        Parameters
        ----------
        outside
            Its reasons count through the words that this was made with.
        """
        reason = self._numbers[outside.reason]
        self._asked = outside.ceiling_mps, outside.target_mps, reason, outside.cause

    def initial(self) -> Any:  # noqa: ANN401 - the memory of the operation below
        """Return the memory before the first step."""
        return self._operation.initial()

    def advise(
        self,
        state: LineState,
        authority: Authority,
        memory: Any,  # noqa: ANN401 - that of the operation below
    ) -> tuple[Advice, Any]:
        """Return the advice of the operation, lowered to what is asked for."""
        advice, memory = self._operation.advise(state, authority, memory)
        told = advice.ceiling_mps.copy(), advice.reason.copy(), advice.cause.copy()
        rows = state.whereabouts[5]
        lower_to_asked(state.speed_mps, rows, self._asked, self._gentle_mps, told)
        return Advice(*told), memory

    @property
    def steps(self) -> Callable[[LineState, Any], LayerSteps]:
        """
        What returns the compiled step.

        Raises
        ------
        AttributeError
            If the operation below offers none.
        """
        if not offered(self._operation, "steps", "advise"):
            msg = f"{type(self._operation).__name__} offers no compiled step"
            raise AttributeError(msg)
        return self._steps

    def _steps(self, state: LineState, memory: Any) -> LayerSteps:  # noqa: ANN401 - as above
        operation: Any = self._operation
        inner: LayerSteps = operation.steps(state, memory)
        fields = inner.fields, inner.told, self._asked, self._gentle_mps
        told = tuple(part.copy() for part in inner.told)
        return LayerSteps(_lowered(inner.function), fields, inner.memory, told, inner.until_s)

    def resumed(self, memory: Any, after: Plain) -> Any:  # noqa: ANN401 - as above
        """Return the memory after a bundle of steps."""
        operation: Any = self._operation
        return operation.resumed(memory, after)


class HeldMemory(NamedTuple):
    """What the supervision below has ordered last, and remembers."""

    orders: Orders
    inner: Any


class OutsideSupervision:
    """
    Extends stops as somebody outside asks for, beside what a supervision orders.

    Parameters
    ----------
    supervision
        The supervision below; None where nobody decides.
    world
        The trains.
    """

    def __init__(self, supervision: Supervision[Any] | None, world: World) -> None:
        self._supervision, self._size = supervision, world.size
        self._hold_until_s, self._again_s = no_orders(world.size).hold_open_until_s, np.inf

    def ask(self, hold_until_s: FloatArray, again_s: float) -> None:
        """
        Take whom to hold from now on.

        Parameters
        ----------
        hold_until_s
            No stop is over before. [s], shape (n_trains,)
        again_s
            When something else may be asked for. [s]
        """
        self._hold_until_s, self._again_s = hold_until_s, again_s

    def initial(self) -> HeldMemory:
        """Return the memory before the first step."""
        orders = no_orders(self._size)._replace(again_s=-np.inf)
        inner = self._supervision.initial() if self._supervision else None
        return HeldMemory(orders, inner)

    def supervise(
        self, state: LineState, authority: Authority, memory: HeldMemory
    ) -> tuple[Orders, HeldMemory]:
        """Return the orders of the supervision below, and holds beside them."""
        orders, inner = memory
        if self._supervision is None:
            orders = no_orders(self._size)
        elif state.events or state.time_s >= orders.again_s:
            # It sees its own orders as those in force, as it would alone.
            seen = state._replace(orders=orders)
            orders, inner = self._supervision.supervise(seen, authority, inner)
        until_s = np.maximum(orders.hold_open_until_s, self._hold_until_s)
        # When all have left, nobody waits for another decision.
        asked_s = self._again_s if self._again_s > state.time_s else np.inf
        again_s = min(orders.again_s, asked_s)
        told = orders._replace(hold_open_until_s=until_s, again_s=again_s)
        return told, HeldMemory(orders, inner)
