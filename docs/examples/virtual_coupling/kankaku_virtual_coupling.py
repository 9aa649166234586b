"""Virtual coupling: close up behind a leader that runs, and match the speed that it announces."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kankaku import Layer
from kankaku.controllers.options import require
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight
from kankaku.railway.step.state import NO_REASON, Advice, Authority, LineState

NO_CEILING_MPS = 1e3
MOVES_MPS = 1.0
"""A leader that is slower than this is not coupled with: it stands, or soon will. [m/s]"""


@dataclass(frozen=True)
class VirtualCouplingOptions:
    """What a scenario may set; the unit is in the name."""

    couple_m: float = 150.0
    """A train couples when it has less than this to spare. [m]"""
    time_gap_s: float = 1.0
    """Running time to keep to spare behind a leader that runs. [s]"""
    announced_s: float = 5.0
    """So far ahead the leader announces what it will do. [s]"""
    closing_s: float = 10.0
    """Time in which a gap that is too large or too small is closed. [s]"""

    def __post_init__(self) -> None:
        require("couple_m", self.couple_m, 0.0, 10_000.0)
        require("time_gap_s", self.time_gap_s, 0.0, 60.0)
        require("announced_s", self.announced_s, 0.0, 60.0)
        require("closing_s", self.closing_s, 1.0, 600.0)


class LastSpeeds(NamedTuple):
    """What is remembered: speeds of a step before, from which accelerations follow."""

    time_s: float
    speed_mps: FloatArray
    """Shape (n_trains,)."""


class VirtualCoupling:
    """Keeps followers at the speed that their leaders announce, and the gap to them constant."""

    reasons = ("virtual_coupling",)

    def __init__(self, world: World, options: VirtualCouplingOptions, foresight: Foresight) -> None:
        self._options, self._size = options, world.size
        self._brake_mps2 = world.of_type("service_brake_mps2")

    def initial(self) -> LastSpeeds:
        """Return that no speed is known."""
        return LastSpeeds(-np.inf, np.zeros(self._size))

    def advise(
        self, state: LineState, authority: Authority, memory: LastSpeeds
    ) -> tuple[Advice, LastSpeeds]:
        """Return the speed of the leader a little later, and what closes the gap."""
        speed_mps, options = state.speed_mps, self._options
        announced_mps = self._announced_mps(state, memory)[state.leader]
        braking_m = 0.5 * np.square(speed_mps) / self._brake_mps2 + authority.delay_s * speed_mps
        spare_m = authority.eoa_m - state.front_m - braking_m
        closing_mps = (spare_m - options.time_gap_s * speed_mps) / options.closing_s
        leader_runs = state.running[state.leader] & (speed_mps[state.leader] > MOVES_MPS)
        # Only where the leader, and nothing beside the track, is what the authority ends at.
        coupled = state.running & state.follows & (authority.eoa_by == state.leader)
        coupled &= (state.leader >= 0) & leader_runs & (spare_m < options.couple_m)
        wanted_mps = np.maximum(announced_mps + closing_mps, 0.0)
        ceiling_mps = np.where(coupled, wanted_mps, NO_CEILING_MPS)
        advice = Advice(ceiling_mps, np.where(coupled, 0, NO_REASON), authority.eoa_by)
        return advice, LastSpeeds(state.time_s, speed_mps.copy())

    def _announced_mps(self, state: LineState, memory: LastSpeeds) -> FloatArray:
        """Return the speed of every train a little later, by what it does and where it stops."""
        speed_mps, ahead_s = state.speed_mps, self._options.announced_s
        since_s = state.time_s - memory.time_s
        if not 0.0 < since_s < np.inf:
            return speed_mps
        faster_mps = np.maximum(speed_mps - memory.speed_mps, 0.0) / since_s * ahead_s
        # Whoever stops soon says so before it brakes: its stop is known.
        coasts_m = state.stop_m - state.front_m - 0.5 * np.square(speed_mps) / self._brake_mps2
        brakes_s = ahead_s - np.maximum(coasts_m, 0.0) / np.maximum(speed_mps, MOVES_MPS)
        slower_mps = self._brake_mps2 * np.maximum(brakes_s, 0.0)
        later_mps: FloatArray = np.maximum(speed_mps + faster_mps - slower_mps, 0.0)
        return later_mps


LAYER = Layer(VirtualCoupling, VirtualCouplingOptions, "matches the speed that a leader announces")
