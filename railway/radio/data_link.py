"""
The radio between the centre and the trains: cycles, delays, losses and acknowledgements.

In every cycle each train reports to the centre, and half a cycle later the centre sends each
train its commands. What is said does not matter here, only what arrives, and when.
"""

import math
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled, formula, plain
from kankaku.railway.plan.radio_spec import (
    NEVER,
    TOLERANCE_S,
    RadioSpec,
    cycle_at,
    telegram_cycle_at,
    telegram_sent_s,
)
from kankaku.railway.plan.world import World
from kankaku.railway.randomness import stream
from kankaku.railway.step.state import RadioState

CHUNK_CYCLES = 1024
"""Losses and delays are drawn for so many cycles at once. [-]"""


class Lane(NamedTuple):
    """What is under way in one direction; whoever carries it writes to its arrays."""

    arrival_s: FloatArray
    """When each message arrives; inf for none. [s], shape (n_slots, n_trains)"""
    said: IntArray
    """What it says. shape (n_slots, n_kinds, n_trains)"""
    newest: IntArray
    """The newest of each kind that has arrived. shape (n_kinds, n_trains)"""
    due_s: FloatArray
    """When the next message is sent, and when the first of those under way arrives. [s], (2,)"""
    version: IntArray
    """Another one when something else has arrived. shape (1,)"""
    first: int
    """The first cycle that losses and delays are drawn for."""
    lost: BoolArray
    """shape (n_cycles, n_trains)"""
    delay_s: FloatArray
    """[s], shape (n_cycles, n_trains)"""
    outage_s: FloatArray
    """Begin and end of each outage. [s], shape (n_outages, 2)"""
    silenced: BoolArray
    """Whose messages it loses. shape (n_outages, n_trains)"""


class Air(NamedTuple):
    """A radio, for compiled functions that let it carry what is due."""

    cycle_s: float
    up: Lane
    """Reports and acknowledgements."""
    down: Lane
    """Commands."""


class Radio:
    """Carries reports and commands; who is asked when does not change what is lost."""

    def __init__(self, world: World, spec: RadioSpec, seed: int) -> None:
        self._spec = spec
        self._up = _Direction(world, spec, seed, "up", carried=2)
        self._down = _Direction(world, spec, seed, "down", carried=1)
        self._nothing_before_s = -np.inf
        self._air: Plain = ()
        self._state = self._known()

    @property
    def until_s(self) -> float:
        """Until then everything that may be lost is drawn. [s]"""
        # Commands are sent half a cycle after reports; a cycle less is on the safe side.
        return (min(self._up.drawn, self._down.drawn) - 1) * self._spec.cycle_s

    @property
    def air(self) -> Plain:
        """The fields of :class:`Air`, until it is asked for something that is not drawn yet."""
        if not self._air:
            self._air = plain(Air(self._spec.cycle_s, self._up.lane, self._down.lane))
        return self._air

    def update(self, time_s: float, present: BoolArray) -> RadioState:
        """
        Return what has arrived; called once per step, or after steps in which others carried it.

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
        if time_s >= self._nothing_before_s:
            drawn = self._up.draw(self._spec.report_cycle(time_s))
            if drawn | self._down.draw(self._spec.telegram_cycle(time_s)):
                self._air = ()
            self._nothing_before_s = carry(time_s, present, self.air)
        if (self._up.version, self._down.version) != self._state[-2:]:
            self._state = self._known()
        return self._state

    def _known(self) -> RadioState:
        # What is lent goes on changing.
        (heard,), (reported, acknowledged) = (
            self._down.lane.newest.copy(),
            self._up.lane.newest.copy(),
        )
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
    """What is under way in one direction, and what is lost there."""

    def __init__(
        self, world: World, spec: RadioSpec, seed: int, direction: str, carried: int
    ) -> None:
        size = world.size
        self._draws = _Draws(world, spec, seed, direction)
        names = world.timetable.trains
        outages = [
            (outage, [not outage.trains or name in outage.trains for name in names])
            for outage in spec.outages
            if (outage.up if direction == "up" else outage.down)
        ]
        # A message's place is taken again when it has long arrived.
        slots = math.ceil(spec.delay_most_s / spec.cycle_s) + 2
        self.lane = Lane(
            np.full((slots, size), np.inf),
            np.full((slots, carried, size), NEVER),
            np.full((carried, size), NEVER),
            np.array([-np.inf, np.inf]),
            np.zeros(1, dtype=np.intp),
            *self._draws.chunk,
            np.array([(outage.from_s, outage.until_s) for outage, _ in outages]).reshape(-1, 2),
            np.array([whose for _, whose in outages], dtype=np.bool_).reshape(-1, size),
        )

    @property
    def version(self) -> int:
        """Another one when something else has arrived."""
        return int(self.lane.version[0])

    @property
    def drawn(self) -> int:
        """The first cycle that is not drawn yet."""
        return self.lane.first + len(self.lane.lost)

    def draw(self, cycle: int) -> bool:
        """Draw what is lost in a cycle, if it is not drawn yet; return whether it was not."""
        if cycle < self.drawn and self.lane.lost.size:
            return False
        first, lost, delay_s = self._draws.until(cycle)
        self.lane = self.lane._replace(first=first, lost=lost, delay_s=delay_s)
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

    @property
    def chunk(self) -> tuple[int, BoolArray, FloatArray]:
        """First cycle of what was drawn last, who loses the messages of each, and delays. [s]"""
        return self._start, self._lost, self._delay_s

    def until(self, cycle: int) -> tuple[int, BoolArray, FloatArray]:
        """Return the draws of a cycle and those about it."""
        # Before the first train stands ready nobody is there to lose anything.
        cycle = max(cycle, self._start)
        while cycle >= self._start + self._lost.shape[0]:
            self._draw_chunk()
        return self.chunk

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


@compiled
def carry(time_s: float, present: BoolArray, fields: Plain) -> float:
    """
    Send and deliver what is due; called once per step.

    Parameters
    ----------
    time_s
        Now. [s]
    present
        Trains on the line; others neither report nor hear. shape (n_trains,)
    fields
        Of :class:`Air`; its arrays are written to.

    Returns
    -------
    float
        Nothing is due before. [s]
    """
    cycle_s, up_fields, down_fields = fields
    up, down = Lane(*up_fields), Lane(*down_fields)
    now_s = time_s + TOLERANCE_S
    _deliver(now_s, present, False, down)
    if now_s >= up.due_s[0]:
        cycle = cycle_at(time_s, cycle_s)
        _send(cycle, cycle * cycle_s, down.newest[0], present, up)
        up.due_s[0] = cycle * cycle_s + cycle_s
    if now_s >= down.due_s[0]:
        cycle = telegram_cycle_at(time_s, cycle_s)
        sent_s = telegram_sent_s(cycle, cycle_s)
        _send(cycle, sent_s, down.newest[0], present, down)
        down.due_s[0] = sent_s + cycle_s
    # What takes no time at all is there at once.
    _deliver(now_s, present, False, down)
    _deliver(now_s, present, True, up)
    next_s = min(up.due_s[0], up.due_s[1], down.due_s[0], down.due_s[1])
    return float(next_s - TOLERANCE_S)


@formula
def _send(cycle: int, sent_s: float, heard: IntArray, present: BoolArray, lane: Lane) -> None:
    """Send one message per train: the cycle, and what the train has heard if there is room."""
    slot, drawn = cycle % lane.arrival_s.shape[0], max(cycle, lane.first) - lane.first
    for train in range(present.size):
        sent = present[train] and not lane.lost[drawn, train]
        for outage in range(lane.silenced.shape[0]):
            from_s, until_s = lane.outage_s[outage, 0], lane.outage_s[outage, 1]
            if from_s <= sent_s < until_s and lane.silenced[outage, train]:
                sent = False
        arrival_s = sent_s + lane.delay_s[drawn, train] if sent else np.inf
        lane.arrival_s[slot, train] = arrival_s
        lane.due_s[1] = min(lane.due_s[1], arrival_s)
        lane.said[slot, 0, train] = cycle
        for kind in range(1, lane.said.shape[1]):
            lane.said[slot, kind, train] = heard[train]


@formula
def _deliver(now_s: float, present: BoolArray, to_centre: bool, lane: Lane) -> None:
    """Let those messages arrive that are due, to the centre or to present trains."""
    if now_s < lane.due_s[1]:
        return
    lane.version[0] += 1
    next_s = np.inf
    for slot in range(lane.arrival_s.shape[0]):
        for train in range(present.size):
            due_s = lane.arrival_s[slot, train]
            if due_s > now_s:
                next_s = min(next_s, due_s)
                continue
            lane.arrival_s[slot, train] = np.inf
            if to_centre or present[train]:
                for kind in range(lane.newest.shape[0]):
                    said = lane.said[slot, kind, train]
                    lane.newest[kind, train] = max(lane.newest[kind, train], said)
    lane.due_s[1] = next_s
