"""What becomes of the orders of supervision: stops that last longer, and trains that stay."""

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.loop.agreements import AgreementError, FirstStep
from kankaku.railway.plan.run import Run
from kankaku.railway.step.control import Bound, Command, Controller
from kankaku.railway.step.engine_contract import Engine
from kankaku.railway.step.records import HoldTimes
from kankaku.railway.step.state import NO_HOLD_S, Advice, Authority, LineState, no_orders

ROUNDING_S = 1e-6


class Supervising:
    """
    Asks supervision when something has happened or its time has come, and obeys.

    Parameters
    ----------
    controller
        Layers with a supervision.
    run
        What happens whoever controls the trains.
    """

    def __init__(self, controller: Controller, run: Run) -> None:
        if controller.supervision is None:
            msg = f"controller {controller.name} has no supervision"
            raise ValueError(msg)
        size, calls = run.dwell_delay_s.shape
        self._controller, self._run = controller.name, run
        self._supervision = controller.supervision
        self._memory = self._supervision.initial()
        self._orders = no_orders(size)._replace(again_s=-np.inf)
        self._waiting = np.zeros(size, dtype=np.bool_)
        """Trains whose stop is over and that have not moved since."""
        self._held = np.zeros(size, dtype=np.bool_)
        """Those of them that supervision keeps there."""
        self._nobody_held = True
        self._lifted_s = np.inf
        """When the first of them may go."""
        self._since_s = np.zeros(size)
        self._open_until_s = np.full((size, calls), NO_HOLD_S)
        self._closed_s = np.zeros((size, calls))

    @property
    def quiet_until_s(self) -> float:
        """Before this time nobody need be asked without an event. [s]"""
        return float(self._orders.again_s) if self._nobody_held else -np.inf

    def decide(
        self, state: LineState, authority: Authority, engine: Engine, first: FirstStep | None
    ) -> LineState:
        """
        Ask supervision where it is time to, and hold whom it wants held.

        Parameters
        ----------
        state
            The line.
        authority
            What protection permits.
        engine
            What ends the stops.
        first
            Looks at the orders in the first step of a run.

        Returns
        -------
        LineState
            The same with the orders in force.
        """
        now_s = state.time_s
        if state.events:
            self._take_events(state)
        if state.events or now_s >= self._orders.again_s:
            seen = state._replace(orders=self._orders)
            self._orders, self._memory = self._supervision.supervise(seen, authority, self._memory)
            if first:
                first.look_at(self._supervision, self._orders)
            if self._orders.again_s <= now_s:
                msg = f"supervision of {self._controller} wants to be asked again in the past"
                raise AgreementError(msg)
            self._extend(state, engine)
            self._keep(state)
        elif now_s > self._lifted_s - ROUNDING_S:
            self._keep(state)
        return state._replace(orders=self._orders)

    def lowered(self, advice: Advice) -> Advice:
        """
        Return advice by which those who are held do not depart.

        Parameters
        ----------
        advice
            What operation asks for.

        Returns
        -------
        Advice
            The same where nobody is held.
        """
        if self._nobody_held:
            return advice
        return advice._replace(ceiling_mps=np.where(self._held, 0.0, advice.ceiling_mps))

    def told(self, command: Command) -> Command:
        """
        Return a command that says who is held.

        Parameters
        ----------
        command
            What the drive makes of the lowered advice.

        Returns
        -------
        Command
            The same where nobody is held.
        """
        if self._nobody_held:
            return command
        return command._replace(
            speed_mps=np.where(self._held, 0.0, command.speed_mps),
            bound=np.where(self._held, int(Bound.HELD), command.bound),
        )

    def held(self, arrival_s: FloatArray, end_s: float) -> HoldTimes:
        """
        Return how long every train was held.

        Parameters
        ----------
        arrival_s
            Actual arrivals. [s], shape (n_trains, n_calls_max)
        end_s
            When the run ended. [s]

        Returns
        -------
        HoldTimes
            By train and call.
        """
        world, closed_s = self._run.world, self._closed_s.copy()
        dwell_s = world.minimum_dwell_s[:, :-1] + self._run.dwell_delay_s
        over_s = np.maximum(world.booked_departure_s[:, :-1], arrival_s + dwell_s)
        # What was never reached, or has no end, is no number.
        open_s = np.nan_to_num(np.minimum(self._open_until_s, end_s) - over_s, nan=0.0)
        closed_s[self._held, self._last_call[self._held]] += end_s - self._since_s[self._held]
        return HoldTimes(np.maximum(open_s, 0.0), closed_s)

    def _take_events(self, state: LineState) -> None:
        for row in state.events.released:
            call = int(state.next_call[row]) - 1
            self._open_until_s[row, call] = min(self._open_until_s[row, call], state.time_s)
            self._waiting[row] = True
        for row in (*state.events.departed, *state.events.left):
            self._waiting[row] = False

    def _extend(self, state: LineState, engine: Engine) -> None:
        """Let stops last as long as they are held open, and note until when that was."""
        until_s = self._orders.hold_open_until_s
        engine.hold(until_s)
        stands = np.flatnonzero(state.present & ~state.running)
        calls = state.next_call[stands]
        known_s = self._open_until_s[stands, calls]
        # A hold that is lifted has lasted until now.
        noted_s = np.minimum(known_s, state.time_s)
        self._open_until_s[stands, calls] = np.maximum(noted_s, until_s[stands])

    def _keep(self, state: LineState) -> None:
        """Work out who is held with closed doors, until something changes again."""
        now_s, until_s = state.time_s, self._orders.hold_closed_until_s
        held: BoolArray = self._waiting & (until_s > now_s + ROUNDING_S)
        begins, ends = held & ~self._held, self._held & ~held
        self._since_s[begins] = now_s
        self._closed_s[ends, state.next_call[ends] - 1] += now_s - self._since_s[ends]
        self._held, self._nobody_held = held, not held.any()
        self._last_call = state.next_call - 1
        self._lifted_s = float(np.min(until_s, initial=np.inf, where=held))
