"""What somebody outside sees of the line, in arrays and train by train."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import Authority, LineState


class TrainView(NamedTuple):
    """One train at one moment; see :class:`LineView`."""

    train: str
    row: int
    present: bool
    running: bool
    front_m: float
    speed_mps: float
    eoa_m: float
    permitted_mps: float
    delay_s: float
    leader: str
    """The next train ahead on its way; empty for none."""
    next_station: str
    """The station of the call ahead or present; empty beyond the last call."""
    next_stop_m: float


@dataclass(frozen=True, slots=True, eq=False)
class LineView:
    """
    The line at the moment of a decision, before anything is decided.

    Arrays have shape (n_trains,), first train first, and nobody may write to them. What a row
    whose train is not ``present`` tells of places means nothing.
    """

    time_s: float
    """Seconds after midnight. [s]"""
    present: BoolArray
    """The train is on the line."""
    running: BoolArray
    """It is on the line, and no stop holds it."""
    front_m: FloatArray
    """Chainage of the front. [m]"""
    speed_mps: FloatArray
    eoa_m: FloatArray
    """End of authority: the front must be able to stop before this. [m]"""
    eoa_by: IntArray
    """What ends the way: row of the train ahead, a place beside the track (below -1), or -1."""
    permitted_mps: FloatArray
    """Speed that protection permits at the end of the step, whatever is asked for. [m/s]"""
    delay_s: FloatArray
    """
    How late the train is known to be: at the last call, or beyond what is booked next. [s]

    Early is negative. One that has not entered is late from its booked entry on.
    """
    leader: IntArray
    """Row of the next train ahead that shares the way; -1 for none."""
    next_call: IntArray
    """Number of the call ahead, or of the present one."""
    next_stop_m: FloatArray
    """Its stop position; far ahead beyond the last call. [m]"""
    booked_arrival_s: FloatArray
    """Booked arrival there; infinite beyond the last call. [s]"""
    booked_departure_s: FloatArray
    """Booked departure from there; infinite beyond the last call. [s]"""
    world: World = field(repr=False)
    """Line, fleet and timetable: what every controller knows beforehand."""

    @property
    def trains(self) -> tuple[str, ...]:
        """Names of the trains, in the order of rows."""
        return self.world.timetable.trains

    def train(self, train: str | int) -> TrainView:
        """
        Return one train.

        Parameters
        ----------
        train
            Its name, or its row.

        Returns
        -------
        TrainView
            At this moment.

        Raises
        ------
        KeyError
            If there is no such train.
        """
        trains = self.trains
        if train not in trains and train not in range(len(trains)):
            raise KeyError(train)
        row = train if isinstance(train, int) else trains.index(train)
        leader, call = int(self.leader[row]), int(self.next_call[row])
        calls = self.world.timetable.services[row].calls
        return TrainView(
            train=trains[row],
            row=row,
            present=bool(self.present[row]),
            running=bool(self.running[row]),
            front_m=float(self.front_m[row]),
            speed_mps=float(self.speed_mps[row]),
            eoa_m=float(self.eoa_m[row]),
            permitted_mps=float(self.permitted_mps[row]),
            delay_s=float(self.delay_s[row]),
            leader=trains[leader] if leader >= 0 else "",
            next_station=calls[call].station if call < len(calls) else "",
            next_stop_m=float(self.next_stop_m[row]),
        )

    def __iter__(self) -> Iterator[TrainView]:
        """Yield the trains that are on the line."""
        return map(self.train, np.flatnonzero(self.present).tolist())


def line_view(
    world: World, state: LineState, authority: Authority, departed_late_s: FloatArray
) -> LineView:
    """
    Return what is seen of a moment.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    state
        The line.
    authority
        What protection permits.
    departed_late_s
        How late each train departed last; nan if it has not moved since. [s], shape (n_trains,)

    Returns
    -------
    LineView
        With arrays of its own.
    """
    rows, call = np.arange(world.size), state.next_call
    arrival_s, departure_s = (
        world.booked_arrival_s[rows, call],
        world.booked_departure_s[rows, call],
    )
    arrays = (
        state.present.copy(),
        state.running.copy(),
        state.front_m.copy(),
        state.speed_mps.copy(),
        authority.eoa_m.copy(),
        authority.eoa_by.copy(),
        authority.ceiling_mps.copy(),
        _delays_s(world, state, departed_late_s),
        state.leader.copy(),
        call.copy(),
        state.stop_m.copy(),
        arrival_s,
        departure_s,
    )
    for array in arrays:
        array.setflags(write=False)
    return LineView(state.time_s, *arrays, world)


def _delays_s(world: World, state: LineState, departed_late_s: FloatArray) -> FloatArray:
    now_s, rows, call = state.time_s, np.arange(world.size), state.next_call
    before = np.maximum(call - 1, 0)
    booked_s, leaves_s = world.booked_arrival_s[rows, call], world.booked_departure_s[rows, call]
    waits_s = now_s - world.booked_departure_s[rows, before]
    left_s = np.where(np.isnan(departed_late_s), waits_s, departed_late_s)
    # Beyond the last call nothing is booked: there now is earlier than ever.
    running_s = np.where(call > 0, np.maximum(left_s, now_s - booked_s), now_s - booked_s)
    arrived_s = np.where(np.isnan(state.arrival_s), 0.0, state.arrival_s) - booked_s
    standing_s = np.maximum(arrived_s, now_s - leaves_s)
    there_s = np.where(state.running, running_s, standing_s)
    gone = ~state.present & (call > 0)
    waiting_s = np.where(gone, np.nan_to_num(departed_late_s), np.maximum(0.0, now_s - booked_s))
    return np.where(state.present, there_s, waiting_s)


def departed_late_s(world: World, next_call: IntArray, departure_s: FloatArray) -> FloatArray:
    """
    Return how late trains departed last.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    next_call
        The calls ahead. shape (n_trains,)
    departure_s
        Actual departures; nan if not yet. [s], shape (n_trains, n_calls_max)

    Returns
    -------
    FloatArray
        Of the call before; nan if a train has not moved since. [s], shape (n_trains,)
    """
    rows, before = np.arange(world.size), np.maximum(next_call - 1, 0)
    late_s = departure_s[rows, before] - world.booked_departure_s[rows, before]
    return np.where(next_call > 0, late_s, np.nan)
