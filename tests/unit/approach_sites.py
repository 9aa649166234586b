"""Sites with a gate: a plain train whose run-in has closed forms, and a real one on hills."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kankaku.controllers.operation.approach_plan import ApproachPoint, Site, approach_point
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.line import Gradient, Line, SpeedLimit
from kankaku.railway.plan.profile import build_profile
from kankaku.railway.plan.rolling_stock import RunningResistance, Traction, TrainType
from kankaku.testing.example_lines import commuter_train, straight_line

GRAVITY = 9.80665
GATE_M, STOP_M, END_M = 1790.0, 2000.0, 3000.0
OPENS_S = 25.0
TOP_MPS = 20.0
EXACT_S = 0.05
"""How exactly a plan has to be in time. [s]"""


def plain_train(acceleration_mps2: float = 0.9, brake_mps2: float = 1.0) -> TrainType:
    """Constant acceleration and brake, no resistance, no rotating masses."""
    train = commuter_train(brake_mps2=brake_mps2)
    return replace(
        train,
        rotating_mass_ratio=0.0,
        traction=Traction(acceleration_mps2 * train.mass_kg, 100.0, 200.0),
        resistance=RunningResistance(0.0, 0.0, 0.0),
        maximum_speed_mps=TOP_MPS,
    )


def line_of(gradients: Sequence[Gradient] = (), limits: Sequence[SpeedLimit] = ()) -> Line:
    return straight_line({"west": 300.0, "east": STOP_M}, END_M, gradients, limits)


HILLY = line_of(
    [Gradient(300.0, 900.0, 0.012), Gradient(1300.0, 1900.0, -0.015)],
    [SpeedLimit(900.0, 1200.0, 15.0), SpeedLimit(1700.0, 1850.0, 13.0)],
)


def site_of(
    train: TrainType, line: Line | None = None, *, delay_s: float = 0.0, gate_m: float = GATE_M
) -> Site:
    """A gate that opens for good at once."""
    return Site(
        profile=build_profile(line or line_of(), [train]),
        row=0,
        train_type=train,
        stop_m=STOP_M,
        delay_s=delay_s,
        eoa_m=np.array([gate_m, END_M]),
        since_departure_s=np.array([0.0, OPENS_S]),
    )


def point_of(site: Site) -> ApproachPoint:
    point = approach_point(site)
    assert point is not None
    return point


class Level(NamedTuple):
    """Uniform motion: accelerations to the stop and from the gate, all in closed form."""

    speeding_mps2: float
    braking_mps2: float
    delay_s: float = 0.0
    gate_m: float = GATE_M

    def on_pattern_m(self, speed_mps: FloatArray | float) -> FloatArray:
        """Where v^2 / 2 = b (gate - x - v tau)."""
        ahead_m = np.multiply(speed_mps, self.delay_s)
        return self.gate_m - ahead_m - 0.5 * np.square(speed_mps) / self.braking_mps2

    def run_in_s(self, speed_mps: FloatArray | float) -> FloatArray:
        """From the pattern: speed up at a, then brake at b into the stop."""
        way_m = STOP_M - self.on_pattern_m(speed_mps)
        a, b = self.speeding_mps2, self.braking_mps2
        peak_mps = np.sqrt((2.0 * a * b * way_m + b * np.square(speed_mps)) / (a + b))
        time_s: FloatArray = (peak_mps - speed_mps) / a + peak_mps / b
        return time_s

    def best_speed_mps(self) -> float:
        """Minimise over speeds 1 mm/s apart."""
        speeds_mps = np.arange(0.0, TOP_MPS, 0.001)
        return float(speeds_mps[np.argmin(self.run_in_s(speeds_mps))])
