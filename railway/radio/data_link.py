"""
The radio between the centre and the trains: cycles, delays, losses and acknowledgements.

In every cycle each train reports to the centre, and half a cycle later the centre sends each
train its commands. What is said does not matter here, only what arrives, and when.
"""

import math

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import formula
from kankaku.railway.plan.radio_spec import NEVER, TOLERANCE_S, RadioSpec
from kankaku.railway.plan.world import World
from kankaku.railway.randomness import stream
from kankaku.railway.step.state import RadioState

CHUNK_CYCLES = 1024
"""Losses and delays are drawn for so many cycles at once. [-]"""


class Radio:
    """Carries reports and commands; who is asked when does not change what is lost."""

    def __init__(self, world: World, spec: RadioSpec, seed: int) -> None:
        self._spec = spec
        self._up = _Direction(world, spec, seed, "up", carried=2)
        self._down = _Direction(world, spec, seed, "down", carried=1)
        self._next_report_s = self._next_telegram_s = self._nothing_before_s = -np.inf
        self._everybody = np.ones(world.size, dtype=np.bool_)
        self._state = self._known()

    def update(self, time_s: float, present: BoolArray) -> RadioState:
        """
        Return what has arrived; called once per step.

        Parameters
        ----------
        time_s
            Now. [s]
        present
            Trains on the line; others neither report nor hear. shape (n_trains,)

        Returns
        -------
        RadioState
            A snapshot: its arrays are replaced when anything arrives, and never written to.
        """
        if time_s < self._nothing_before_s:
            return self._state
        spec, now_s = self._spec, time_s + TOLERANCE_S
        arrived = self._down.deliver(now_s, present)
        if now_s >= self._next_report_s:
            cycle = spec.report_cycle(time_s)
            made_s = spec.report_s(cycle)
            said = np.stack((np.full(present.size, cycle), *self._down.newest))
            self._up.send(cycle, made_s, said, present)
            self._next_report_s = made_s + spec.cycle_s
        if now_s >= self._next_telegram_s:
            cycle = spec.telegram_cycle(time_s)
            sent_s = spec.telegram_s(cycle)
            self._down.send(cycle, sent_s, np.full((1, present.size), cycle), present)
            self._next_telegram_s = sent_s + spec.cycle_s
        # What takes no time at all is there at once.
        arrived |= self._down.deliver(now_s, present)
        arrived |= self._up.deliver(now_s, self._everybody)
        if arrived:
            self._state = self._known()
        self._nothing_before_s = (
            min(
                self._next_report_s,
                self._next_telegram_s,
                self._up.next_arrival_s,
                self._down.next_arrival_s,
            )
            - TOLERANCE_S
        )
        return self._state

    def _known(self) -> RadioState:
        (heard,), (reported, acknowledged) = self._down.newest, self._up.newest
        return RadioState(
            reported,
            heard,
            acknowledged,
            self._spec.reports_s(reported),
            self._spec.telegrams_s(heard),
            self._spec.telegrams_s(acknowledged),
            self._up.version,
            self._down.version,
        )


class _Direction:
    """What is under way in one direction."""

    def __init__(
        self, world: World, spec: RadioSpec, seed: int, direction: str, carried: int
    ) -> None:
        size = world.size
        self._spec = spec
        self._draws = _Draws(world, spec, seed, direction)
        names = world.timetable.trains
        self._outages = [
            (outage, np.array([not outage.trains or name in outage.trains for name in names]))
            for outage in spec.outages
            if (outage.up if direction == "up" else outage.down)
        ]
        # A message's place is taken again when it has long arrived.
        slots = math.ceil(spec.delay_most_s / spec.cycle_s) + 2
        self._arrival_s = np.full((slots, size), np.inf)
        self._said = np.full((slots, carried, size), NEVER)
        self._newest = np.full((carried, size), NEVER)
        self.newest: tuple[IntArray, ...] = tuple(self._newest)
        """Cycle of the newest of each kind that has arrived. shape (n_trains,) each"""
        self.version = 0
        """Another one when something else has arrived."""
        self.next_arrival_s = np.inf
        """When the first message arrives of those under way. [s]"""

    def send(self, cycle: int, sent_s: float, said: IntArray, present: BoolArray) -> None:
        """Send one message per train; ``said`` of shape (carried, n_trains) never falls."""
        lost, delay_s = self._draws.of_cycle(cycle)
        sent = present & ~lost
        for outage, concerned in self._outages:
            if outage.from_s <= sent_s < outage.until_s:
                sent &= ~concerned
        slot = cycle % self._arrival_s.shape[0]
        self._arrival_s[slot] = np.where(sent, sent_s + delay_s, np.inf)
        self._said[slot] = said
        self.next_arrival_s = min(self.next_arrival_s, float(self._arrival_s[slot].min()))

    def deliver(self, now_s: float, present: BoolArray) -> bool:
        """Let those messages arrive to present trains that are due; return whether any was."""
        if now_s < self.next_arrival_s:
            return False
        self._newest = self._newest.copy()
        self.next_arrival_s = _deliver(now_s, present, self._arrival_s, self._said, self._newest)
        self.newest = tuple(self._newest)
        self.version += 1
        return True


class _Draws:
    """
    Losses and delays by cycle, in one direction.

    They are counted from the cycle in which a train stands ready at its first call, so that
    no controller and no other train changes them.
    """

    def __init__(self, world: World, spec: RadioSpec, seed: int, direction: str) -> None:
        names = world.timetable.trains
        self._spec = spec
        self._streams = [stream(seed, "radio", direction, name) for name in names]
        ready_s = world.booked_arrival_s[:, 0]
        self._first: IntArray = np.floor((ready_s - 1.0) / spec.cycle_s).astype(np.intp)
        self._start = int(self._first.min())
        self._lost = np.zeros((0, len(names)), dtype=np.bool_)
        self._delay_s = np.zeros((0, len(names)))

    def of_cycle(self, cycle: int) -> tuple[BoolArray, FloatArray]:
        """Return who loses the message of a cycle, and the delays of the others. [s]"""
        # Before the first train stands ready nobody is there to lose anything.
        cycle = max(cycle, self._start)
        while cycle >= self._start + self._lost.shape[0]:
            self._draw_chunk()
        return self._lost[cycle - self._start], self._delay_s[cycle - self._start]

    def _draw_chunk(self) -> None:
        spec, size = self._spec, len(self._streams)
        lost_before = self._lost[-1] if self._lost.size else np.zeros(size, dtype=np.bool_)
        self._start += self._lost.shape[0]
        self._lost = np.zeros((CHUNK_CYCLES, size), dtype=np.bool_)
        self._delay_s = np.zeros((CHUNK_CYCLES, size))
        # The chain of Gilbert, 1960: rows of losses last f / (1 - p) in the mean.
        after_arrival = spec.loss_ratio / spec.burst_factor
        after_loss = 1.0 - (1.0 - spec.loss_ratio) / spec.burst_factor
        for row, draws in enumerate(self._streams):
            begin = max(int(self._first[row]) - self._start, 0)
            if begin >= CHUNK_CYCLES:
                continue
            drawn = draws.random((CHUNK_CYCLES - begin, 2))
            starts = self._start <= self._first[row]
            odds = (spec.loss_ratio if starts else -1.0, after_arrival, after_loss)
            _chain(drawn[:, 0], odds, bool(lost_before[row]), self._lost[begin:, row])
            range_s = spec.delay_most_s - spec.delay_least_s
            self._delay_s[begin:, row] = spec.delay_least_s + range_s * drawn[:, 1]


@formula
def _chain(
    drawn: FloatArray,
    odds: tuple[float, float, float],
    lost_before: bool,
    lost: BoolArray,
) -> None:
    """Write who is lost: with the first odds at the beginning, if they are not negative."""
    at_first, after_arrival, after_loss = odds
    before = lost_before
    for index in range(drawn.size):
        chance = after_loss if before else after_arrival
        if index == 0 and at_first >= 0.0:
            chance = at_first
        before = drawn[index] < chance
        lost[index] = before


@formula
def _deliver(
    now_s: float,
    present: BoolArray,
    arrival_s: FloatArray,
    said: IntArray,
    newest: IntArray,
) -> float:
    """Raise ``newest`` by what has arrived, and return when the next message arrives."""
    next_s = np.inf
    for slot in range(arrival_s.shape[0]):
        for train in range(present.size):
            due_s = arrival_s[slot, train]
            if due_s > now_s:
                next_s = min(next_s, due_s)
                continue
            arrival_s[slot, train] = np.inf
            if present[train]:
                for kind in range(newest.shape[0]):
                    newest[kind, train] = max(newest[kind, train], said[slot, kind, train])
    return next_s
