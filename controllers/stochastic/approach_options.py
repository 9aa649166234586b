"""Options of the stochastic approach."""

from dataclasses import dataclass, replace

from kankaku.controllers.options import OptionError, require
from kankaku.railway.plan.dwell import DwellDelays


@dataclass(frozen=True, slots=True)
class StochasticApproachOptions:
    """Options of the stochastic approach; what is told is what the scenario says, or else."""

    standing_cost: float = 0.3
    """What a second slower than 10 km/h between stations costs, in seconds of delay. [-]"""
    energy_cost_s_per_kwh: float = 0.02
    """What a kilowatt-hour costs, in seconds of delay. [s/kWh]"""
    learns: bool = True
    """Delays that have been seen change what is expected."""
    told_scale: float = 1.0
    """Factor on the delays that the planner is told of. [-]"""
    told_cap_s: float = 0.0
    """Longest delay that it is told of; 0 for that of the scenario. [s]"""
    told_levels: tuple[float, ...] = ()
    """Cumulative probabilities of another distribution that it is told. [-]"""
    told_delays_s: tuple[float, ...] = ()
    """The delays at these, for a factor of 1. [s]"""

    def __post_init__(self) -> None:
        require("standing_cost", self.standing_cost, 0.0, 100.0)
        require("energy_cost_s_per_kwh", self.energy_cost_s_per_kwh, 0.0, 10.0)
        require("told_scale", self.told_scale, 0.01, 100.0)
        require("told_cap_s", self.told_cap_s, 0.0, 3600.0)
        levels, delays_s = self.told_levels, self.told_delays_s
        if len(levels) != len(delays_s) or len(levels) == 1:
            problem = f"told_levels has {len(levels)} values, told_delays_s {len(delays_s)}"
            raise OptionError(problem, "as many, two at least, or none")
        rising = list(levels) == sorted(set(levels)) and list(delays_s) == sorted(delays_s)
        if levels and not (rising and levels[0] == 0.0 and levels[-1] == 1.0 and delays_s[0] >= 0):
            problem = "told_levels and told_delays_s are no distribution"
            raise OptionError(problem, "levels rising from 0 to 1, delays of 0 or more not falling")

    def told(self, expected: DwellDelays) -> DwellDelays:
        """
        Return what the planner is told of dwell delays.

        Parameters
        ----------
        expected
            What the scenario says.

        Returns
        -------
        DwellDelays
            That, changed by the options.
        """
        if self.told_levels:
            expected = replace(
                expected, levels=self.told_levels, delays_s=self.told_delays_s, scale=1.0
            )
        cap_s = self.told_cap_s or expected.cap_s
        return replace(expected, scale=expected.scale * self.told_scale, cap_s=cap_s)
