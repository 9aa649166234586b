"""Options of the control map."""

from dataclasses import dataclass

from kankaku.controllers.options import require


@dataclass(frozen=True, slots=True)
class ControlMapOptions:
    """Options of the control map."""

    margin_m: float = 25.0
    """Between the place before which a train can stop and the rear of the band ahead. [m]"""
    delay_s: float = 3.0
    """Longest delay of a message that a train brakes. [s]"""
    horizon_s: float = 60.0
    """How far the map reaches. [s]"""
    tolerance_m: float = 30.0
    """By how much a train may be ahead of its plan before it is braked. [m]"""
    smooth_brake_kmhps: float = 2.0
    """Deceleration to a lower planned speed. [km/h/s]"""

    reserve_s: float = 15.0
    """How much longer than it has to a train ahead is expected to stand at its stop. [s]"""
    early_s: float = 20.0
    """How much earlier than booked trains are to arrive. [s]"""

    def __post_init__(self) -> None:
        require("margin_m", self.margin_m, 0.0, 1000.0)
        require("delay_s", self.delay_s, 0.0, 30.0)
        require("horizon_s", self.horizon_s, 10.0, 600.0)
        require("tolerance_m", self.tolerance_m, 5.0, 1000.0)
        require("smooth_brake_kmhps", self.smooth_brake_kmhps, 0.2, 12.0)
        require("reserve_s", self.reserve_s, 0.0, 600.0)
        require("early_s", self.early_s, 0.0, 3600.0)
