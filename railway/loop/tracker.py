"""Turns what an engine observes into the state of the line: calls, leaders, events."""

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.failures.unit_failures import Units
from kankaku.railway.loop.compiled_loop import Watched
from kankaku.railway.plan.world import World
from kankaku.railway.radio.data_link import Radio
from kankaku.railway.step.engine_contract import Observation
from kankaku.railway.step.state import Events, LineState, beside
from kankaku.railway.wayside.leaders import Leaders
from kankaku.railway.wayside.signalling import Wayside

NO_EVENTS = Events()


class Tracker:
    """Keeps calls, leaders and masks; they change with events only."""

    def __init__(
        self,
        world: World,
        wayside: Wayside | None = None,
        radio: Radio | None = None,
        units: Units | None = None,
    ) -> None:
        size = world.size
        self._world = world
        self._wayside = wayside or Wayside(world)
        self._radio = radio
        self._units = units
        self._leaders = Leaders(world)
        self._asks = world.line.first_come
        self._next_clear_m = self._leaders.next_clear_m.copy()
        self._leader = self._leaders.leader.copy()
        self._follows = self._leaders.follows.copy()
        self._granted_m = self._leaders.granted_to_m.copy()
        self._granted_by = self._leaders.granted_by.copy()
        self._present = np.zeros(size, dtype=np.bool_)
        self._running = np.zeros(size, dtype=np.bool_)
        self._next_call = np.zeros(size, dtype=np.intp)
        self._stop_m = world.stop_m[:, 0].copy()
        self._last_arrival_s = np.full(size, np.nan)
        self._calls_version = self._grants = 0
        self._ready: list[int] = []
        self._watched = self._who_is_watched()
        self._unfinished = size
        # Who moves now began to a step ago, and might have departed a reaction before.
        self._late_s = world.step_s + world.reaction_s
        self._fastest_mps = max(kind.maximum_speed_mps for kind in world.train_types)
        self._no_clearing_before_s = -np.inf
        shape = (size, world.stop_m.shape[1] - 1)
        self.arrival_s: FloatArray = np.full(shape, np.nan)
        self.departure_s: FloatArray = np.full(shape, np.nan)
        self.stop_error_m: FloatArray = np.full(shape, np.nan)
        self.completed = np.zeros(size, dtype=np.bool_)

    @property
    def finished(self) -> bool:
        """Every train has left the line."""
        return self._unfinished == 0

    @property
    def radio(self) -> Radio | None:
        """What carries commands; None under a controller without."""
        return self._radio

    def watched(self, until_s: float) -> Watched:
        """
        Return what has to be watched between events.

        Parameters
        ----------
        until_s
            From this time on somebody else wants to be asked. [s]

        Returns
        -------
        Watched
            As long as the state of the line is the one that was returned last.
        """
        if self._asks or self._units:
            until_s = -np.inf
        next_s, front_watch_m, tail_watch_m = self._wayside.watch
        return Watched(
            min(until_s, self._leaders.next_s, next_s),
            front_watch_m,
            tail_watch_m,
            self._next_clear_m,
            *self._watched,
        )

    def update(self, seen: Observation) -> LineState:
        """
        Return the state of the line.

        Parameters
        ----------
        seen
            What the engine observed.

        Returns
        -------
        LineState
            A snapshot: arrays are not written to afterwards.
        """
        tail_m, clear_to_m = self._leaders.tails_and_clearance_m(seen.front_m, self._granted_m)
        departed = self._departures(seen) if self._ready else ()
        rows = self._clearings(seen.time_s, tail_m)
        events = NO_EVENTS
        happened = departed or seen.entered or seen.stopped or seen.released or seen.left
        if happened or rows is not None:
            events = self._take_events(seen, departed, rows)
        thrown = seen.time_s >= self._leaders.next_s and self._leaders.thrown(seen.time_s)
        if self._asks:
            thrown |= self._leaders.ask(seen.front_m, self._stop_m, self._present, seen.time_s)
        if thrown:
            self._show_leaders()
        trains = seen.front_m, tail_m, seen.speed_mps
        signalled = self._wayside.update(seen.time_s, trains, self._present, events)
        if events or signalled or thrown:
            events = events._replace(signalled=signalled)
            self._grant()
            clear_to_m = self._leaders.tails_and_clearance_m(seen.front_m, self._granted_m)[1]
        return LineState(
            seen.time_s,
            seen.front_m,
            tail_m,
            seen.speed_mps,
            self._present,
            self._running,
            self._leader,
            self._follows,
            clear_to_m,
            self._granted_m,
            self._granted_by,
            self._next_call,
            self._stop_m,
            self._last_arrival_s,
            events,
            self._wayside.state,
            self._calls_version,
            # Both only rise, so their sum is another one whenever either is.
            self._grants + self._wayside.version,
            self._radio.update(seen.time_s, self._present) if self._radio else None,
            self._units.update(seen.time_s, seen.front_m, seen.speed_mps) if self._units else None,
        )

    def _grant(self) -> None:
        """Work out how far points and obstructions let each train go."""
        self._grants += 1
        known, granted_to_m = self._wayside.state, self._leaders.granted_to_m
        self._granted_m = np.minimum(granted_to_m, known.obstructed_m)
        obstructed_by = beside(known.obstructed_by)
        self._granted_by = np.where(
            known.obstructed_m < granted_to_m, obstructed_by, self._leaders.granted_by
        )

    def _clearings(self, time_s: float, tail_m: FloatArray) -> IntArray | None:
        if time_s < self._no_clearing_before_s:
            return None
        to_go_m = self._next_clear_m - tail_m
        nearest_m = float(to_go_m.min())
        if nearest_m > 0.0:
            # Twice the highest speed of all: no tail can get there any sooner.
            self._no_clearing_before_s = time_s + 0.5 * nearest_m / self._fastest_mps
            return None
        return np.flatnonzero(to_go_m <= 0.0)

    def _departures(self, seen: Observation) -> tuple[int, ...]:
        moving = tuple(row for row in self._ready if seen.speed_mps[row] > 0.0)
        if moving:
            self._ready = [row for row in self._ready if row not in moving]
        return moving

    def _take_events(
        self, seen: Observation, departed: tuple[int, ...], cleared: IntArray | None
    ) -> Events:
        # Fresh copies: the arrays of earlier states must not change under their readers.
        self._calls_version += 1
        self._present = self._present.copy()
        self._running = self._running.copy()
        self._next_call = self._next_call.copy()
        self._stop_m = self._stop_m.copy()
        self._last_arrival_s = self._last_arrival_s.copy()
        for row in departed:
            call = self._next_call[row]
            self.departure_s[row, call - 1] = seen.time_s - self._late_s
        for row in seen.entered:
            self._present[row] = True
            self._running[row] = True
        for row in seen.stopped:
            call = self._next_call[row]
            self._running[row] = False
            self.arrival_s[row, call] = seen.time_s
            self.stop_error_m[row, call] = seen.front_m[row] - self._stop_m[row]
            self._last_arrival_s[row] = seen.time_s
        for row in seen.released:
            self._running[row] = True
            self._next_call[row] += 1
            self._stop_m[row] = self._world.stop_m[row, self._next_call[row]]
            if row in seen.left:
                self.departure_s[row, self._next_call[row] - 1] = seen.time_s
                departed = (*departed, row)
            else:
                self._ready.append(row)
        for row in seen.left:
            self._present[row] = self._running[row] = False
            self.completed[row] = True
            self._unfinished -= 1
        self._leaders.enter(seen.entered, seen.time_s)
        self._find_leaders(seen.left, cleared, seen.time_s)
        return Events(
            seen.entered,
            seen.stopped,
            seen.released,
            departed,
            () if cleared is None else tuple(cleared.tolist()),
            seen.left,
        )

    def _find_leaders(self, left: tuple[int, ...], cleared: IntArray | None, time_s: float) -> None:
        """Let those who have cleared a track or left the line lead nobody there any more."""
        if cleared is not None:
            self._leaders.clear(cleared, time_s)
        self._no_clearing_before_s = -np.inf
        for row in left:
            self._leaders.leave(row, time_s)
        self._show_leaders()
        self._watched = self._who_is_watched()

    def _who_is_watched(self) -> tuple[IntArray, FloatArray, BoolArray, BoolArray, IntArray]:
        """Return who is about to depart, all lengths, and who is on the line; events change it."""
        ready = np.array(self._ready, dtype=np.intp)
        present, running = self._present, self._running
        return ready, self._world.length_m, present, running, np.flatnonzero(present)

    def _show_leaders(self) -> None:
        self._leader = self._leaders.leader.copy()
        self._follows = self._leaders.follows.copy()
        self._next_clear_m = self._leaders.next_clear_m.copy()
