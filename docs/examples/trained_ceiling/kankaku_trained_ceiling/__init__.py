"""A trained policy: a table of few numbers says how fast to run towards a leader's platform."""

import json
from dataclasses import dataclass
from importlib.resources import files
from itertools import pairwise

import numpy as np

from kankaku import Layer
from kankaku.controllers.forecast import DepartureForecast
from kankaku.controllers.options import OptionError, require
from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight
from kankaku.railway.step.state import NO_REASON, Advice, Authority, LineState

NO_CEILING_MPS = 1e3
WEIGHTS = "weights.json"
_TRAINED = json.loads(files(__package__).joinpath(WEIGHTS).read_text("utf-8"))["weights"]


@dataclass(frozen=True)
class TrainedCeilingOptions:
    """The weights; ``train`` finds them, and a scenario may set others."""

    gap_m: tuple[float, ...] = tuple(_TRAINED["gap_m"])
    """Columns of the table: way to the end of authority, rising. [m]"""
    wait_s: tuple[float, ...] = tuple(_TRAINED["wait_s"])
    """Rows: until the leader may depart, less than 0 if it overstays, rising. [s]"""
    ceiling_kmh: tuple[float, ...] = tuple(_TRAINED["ceiling_kmh"])
    """The table, row after row. [km/h]"""
    leader_factor: float = _TRAINED["leader_factor"]
    """So much of the leader's own speed is added. [-]"""
    slowest_kmh: float = 8.0
    """No ceiling is lower than this. [km/h]"""

    def __post_init__(self) -> None:
        require("leader_factor", self.leader_factor, 0.0, 10.0)
        require("slowest_kmh", self.slowest_kmh, 0.0, 100.0)
        for name in ("gap_m", "wait_s"):
            knots = getattr(self, name)
            if len(knots) < 2 or any(not here < there for here, there in pairwise(knots)):
                problem = f"{name} is {list(knots)}"
                raise OptionError(problem, "two or more numbers that rise")
        many = len(self.gap_m) * len(self.wait_s)
        if len(self.ceiling_kmh) != many:
            problem = f"ceiling_kmh has {len(self.ceiling_kmh)} numbers"
            raise OptionError(problem, f"{many} of them")
        for value in self.ceiling_kmh:
            require("ceiling_kmh", value, 0.0, 1000.0)


class TrainedCeiling:
    """Looks up a ceiling by way, by the leader's wait or overstay, and by its speed."""

    reasons = ("trained_ceiling",)

    def __init__(self, world: World, options: TrainedCeilingOptions, foresight: Foresight) -> None:
        self._world, self._forecast = world, DepartureForecast(world)
        self._rows = np.arange(world.size)
        self._gap_m, self._wait_s = np.array(options.gap_m), np.array(options.wait_s)
        shape = self._wait_s.size, self._gap_m.size
        self._table_mps = np.array(options.ceiling_kmh).reshape(shape) / 3.6
        self._leader_factor = options.leader_factor
        self._slowest_mps = options.slowest_kmh / 3.6

    def initial(self) -> None:
        """Return the memory before the first step: none is needed."""

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        """Return the ceilings of those whose leader is in the way to their next stop."""
        ready_s, _ = self._forecast.ready_and_earliest_s(state)
        booked_s = self._world.booked_departure_s[self._rows, state.next_call]
        wait_s = (np.maximum(ready_s, booked_s) - state.time_s)[state.leader]
        gap_m = authority.eoa_m - state.front_m
        behind = state.running & state.follows & (state.leader >= 0)
        behind &= (authority.eoa_m < state.stop_m) & np.isfinite(wait_s)
        behind &= gap_m < self._gap_m[-1]
        leader_mps = state.speed_mps[state.leader] * self._leader_factor
        looked_up_mps = self._looked_up_mps(gap_m, np.where(behind, wait_s, 0.0)) + leader_mps
        ceiling_mps = np.where(behind, np.maximum(looked_up_mps, self._slowest_mps), NO_CEILING_MPS)
        return Advice(ceiling_mps, np.where(behind, 0, NO_REASON), authority.eoa_by), None

    def _looked_up_mps(self, gap_m: FloatArray, wait_s: FloatArray) -> FloatArray:
        """Interpolate in the table, linear in both directions; it goes on flat beyond its ends."""
        row, down = _between(self._wait_s, wait_s)
        column, along = _between(self._gap_m, gap_m)
        table_mps = self._table_mps
        upper_mps = (1.0 - along) * table_mps[row, column] + along * table_mps[row, column + 1]
        row += 1
        lower_mps = (1.0 - along) * table_mps[row, column] + along * table_mps[row, column + 1]
        found_mps: FloatArray = (1.0 - down) * upper_mps + down * lower_mps
        return found_mps


def _between(knots: FloatArray, at: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return after which knot places lie, and which part of the way to the next one."""
    inside = np.clip(at, knots[0], knots[-1])
    place = np.clip(np.searchsorted(knots, inside, side="right") - 1, 0, knots.size - 2)
    return place, (inside - knots[place]) / (knots[place + 1] - knots[place])


LAYER = Layer(TrainedCeiling, TrainedCeilingOptions, "a trained table of ceilings behind a leader")
