"""
How trains are driven within what they can and may do.

A style makes of a train type what its drivers use of it, and of a line what they keep to. Whatever
plans or foresees the run of an unhindered train takes the *driven* type and the *driven* line;
whatever guards safety takes the train and the line as they are.
"""

from dataclasses import dataclass, replace

from kankaku.railway.plan.line import Line
from kankaku.railway.plan.rolling_stock import TrainType

SLOWEST_SHARE = 0.5
"""Below low limits drivers keep no more than this share of them less. [-]"""


@dataclass(frozen=True, slots=True)
class DrivingStyle:
    """What drivers use of their trains; by default all of it."""

    name: str = "fastest"
    traction_share: float = 1.0
    """Tractive force in use, of the greatest. [-]"""
    station_brake_mps2: float = float("inf")
    """Greatest deceleration for stops and lower limits, if less than the service brake. [m/s2]"""
    below_limit_mps: float = 0.0
    """Speed kept below every limit. [m/s]"""
    coasting_band_mps: float = 0.0
    """From its speed a train coasts until it is slower by so much; 0 to hold it. [m/s]"""
    departure_reaction_s: float = 0.0
    """From when a train may depart until it moves. [s]"""
    driven_speeds: bool = False
    """Drivers keep to the driven speeds of the line, too."""
    late_after_s: float = float("inf")
    """Who departs later than this hurries: no coasting, no driven speeds. [s]"""

    @property
    def lowers(self) -> bool:
        """Whether it leaves anything of trains or line unused."""
        used = self.traction_share, self.station_brake_mps2, self.below_limit_mps
        return used != (1.0, float("inf"), 0.0) or self.idles

    @property
    def idles(self) -> bool:
        """Whether a train that is not late is slower than it could be in this style."""
        return self.driven_speeds or self.coasting_band_mps > 0.0

    @property
    def hurries(self) -> bool:
        """Whether a train that is late is faster than one that is not."""
        return self.idles and self.late_after_s < float("inf")

    @property
    def at_limits(self) -> "DrivingStyle":
        """The same without coasting and driven speeds."""
        return replace(self, driven_speeds=False, coasting_band_mps=0.0)

    @property
    def hurried(self) -> "DrivingStyle":
        """The style of trains that are late, whenever they depart."""
        return self.at_limits if self.hurries else self

    def lag_s(self, train: TrainType) -> float:
        """
        Return from when a train may depart until full traction would have set it off.

        The reaction, and half of the time in which the jerk limit lets the traction rise: a train
        whose acceleration rises evenly is behind by half of that.

        Parameters
        ----------
        train
            What it can do.

        Returns
        -------
        float
            The time. [s]
        """
        rise_s = self.train(train).starting_acceleration_mps2 / train.jerk_mps3
        return self.departure_reaction_s + 0.5 * rise_s

    def train(self, train: TrainType) -> TrainType:
        """
        Return a train as its drivers use it.

        Parameters
        ----------
        train
            What it can do.

        Returns
        -------
        TrainType
            Its traction, its brake for stops and limits, and its speed.
        """
        return replace(
            train,
            traction=train.traction.scaled(self.traction_share),
            service_brake_mps2=min(train.service_brake_mps2, self.station_brake_mps2),
            maximum_speed_mps=self._kept_mps(train.maximum_speed_mps),
        )

    def line(self, line: Line) -> Line:
        """
        Return a line as drivers keep to it.

        Parameters
        ----------
        line
            The line as trains meet it.

        Returns
        -------
        Line
            The same with other limits.
        """
        kept = [replace(one, limit_mps=self._kept_mps(one.limit_mps)) for one in line.limits]
        driven = line.driven_speeds if self.driven_speeds else ()
        limits = sorted((*kept, *driven), key=lambda limit: (limit.start_m, limit.end_m))
        return replace(line, limits=tuple(limits))

    def _kept_mps(self, limit_mps: float) -> float:
        return max(limit_mps - self.below_limit_mps, SLOWEST_SHARE * limit_mps)


FASTEST = DrivingStyle()
"""Everything that trains can and limits allow."""
