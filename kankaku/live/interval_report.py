"""What came of advice in the interval that it was for, and what protection cut off it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kankaku.live.line_advice import Outside
from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.meters.energy_meter import EnergyMeter
from kankaku.railway.meters.standstill import StandstillWatch
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Bound, Command
from kankaku.railway.step.reasons import nothing_found
from kankaku.railway.step.state import LineState, Reason
from kankaku.railway.step.step_block import StepBlock

PROTECTING = (
    Reason.LINE_LIMIT,
    Reason.TRAIN_AHEAD,
    Reason.OBSTRUCTION_AHEAD,
    Reason.EMERGENCY,
)
"""Where one of these is why a train is as fast as it is, protection made it slower."""
SHIELDED = np.isin(np.arange(len(Reason)), PROTECTING)
"""The same by number of the reason."""
CUTTING = np.isin(np.arange(len(Bound)), (Bound.CEILING, Bound.LIMIT, Bound.EMERGENCY))
"""Whether a bound is protection's, by its number."""


@dataclass(frozen=True, slots=True, eq=False)
class IntervalReport:
    """What happened between two decisions; arrays of shape (n_trains,)."""

    from_s: float
    """When the interval began. [s]"""
    to_s: float
    """When it ended. [s]"""
    cut_mps: FloatArray
    """
    By how much protection let a train go slower than was asked, in the first step. [m/s]

    0 where nothing was asked, or where a train was slower for other reasons.
    """
    shield_s: FloatArray
    """For how long protection was why a train was as fast as it was, by the second. [s]"""
    reason: IntArray
    """A :class:`~kankaku.railway.step.state.Reason`: of the last second, for each train."""
    stops: IntArray
    """Standstills between stations that began; empty if nobody measures them. [-]"""
    stood_s: FloatArray
    """For how long trains stood between stations; empty if nobody measures it. [s]"""
    energy_j: FloatArray
    """Net energy that was taken from the line; empty if nobody measures it. [J]"""


class Tally:
    """
    Hears of every step, and adds up what counts between two decisions.

    Parameters
    ----------
    world
        The trains.
    sample_s
        From one sample of reasons to the next. [s]
    stops, energy
        Measure standstills between stations, or energy, too, which takes some time.
    """

    def __init__(self, world: World, sample_s: float, *, stops: bool, energy: bool) -> None:
        self._world, self._sample_s = world, sample_s
        self._watch = StandstillWatch(world) if stops else None
        self._meter = EnergyMeter(world) if energy else None
        self._shield_s = np.zeros(world.size)
        self._reason: IntArray = nothing_found(1, world.size)[0, 0]
        self._known = self._measured()

    @property
    def wants_blocks(self) -> bool:
        """Reasons alone are not enough."""
        return self._watch is not None or self._meter is not None

    def hear(self, block: StepBlock | None, reasons: Sequence[IntArray]) -> None:
        """Hear of the steps since the last time."""
        for found in reasons:
            self._shield_s += self._sample_s * SHIELDED[found[0]]
            self._reason = found[0]
        if block is None:
            return
        if self._watch:
            self._watch.add(block)
        if self._meter:
            self._meter.add(block)

    def report(
        self, span_s: tuple[float, float], asked: Outside, first: Command | None, state: LineState
    ) -> IntervalReport:
        """
        Return what happened since the last report.

        Parameters
        ----------
        span_s
            When the interval began and ended. [s]
        asked
            What was asked for.
        first
            The command of its first step.
        state
            The line in that step.

        Returns
        -------
        IntervalReport
            Of this interval alone.
        """
        before, self._known = self._known, self._measured()
        shield_s, self._shield_s = self._shield_s, np.zeros(self._world.size)
        cut_mps = np.zeros(self._world.size)
        if first is not None:
            wanted = np.minimum(asked.asked_mps, self._world.of_type("maximum_speed_mps"))
            cut = state.running & CUTTING[first.bound] & (asked.asked_mps < np.inf)
            cut_mps[cut] = np.maximum(wanted - first.speed_mps, 0.0)[cut]
        grown = [now - then for now, then in zip(self._known, before, strict=True)]
        return IntervalReport(
            *span_s, cut_mps, shield_s, self._reason, grown[0].astype(np.intp), grown[1], grown[2]
        )

    def _measured(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return standstills, how long they lasted, and net energy, so far."""
        none: FloatArray = np.zeros(0)
        stops, stood_s, energy_j = none, none, none
        size = self._world.size
        if self._watch:
            found = self._watch.standstills()
            stops, stood_s = np.zeros(size), np.zeros(size)
            np.add.at(stops, found.row, 1.0)
            np.add.at(stood_s, found.row, found.duration_s)
        if self._meter:
            account = self._meter.account()
            energy_j = account.consumed_j - account.recovered_j
        return stops, stood_s, energy_j
