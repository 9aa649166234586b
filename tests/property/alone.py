"""A run of one train integrated in time, in steps of five milliseconds, over the exact line."""

from bisect import bisect_right
from collections.abc import Sequence
from math import sqrt

from kankaku.railway.plan.line import Gradient, SpeedLimit
from kankaku.railway.plan.rolling_stock import TrainType
from tests.property.dense_run import GRAVITY, inertial_kg, pull_n, rolling_n

STEP_S = 0.005
ARRIVED_M = 1e-4


class Hills:
    """Height of a line of gradients, averaged over a train in closed form."""

    def __init__(self, gradients: Sequence[Gradient], length_m: float) -> None:
        self._length_m = length_m
        self._edges_m, self._slopes = [-1e6], [0.0]
        for stretch in sorted(gradients, key=lambda one: one.start_m):
            if stretch.start_m > self._edges_m[-1]:
                self._edges_m.append(stretch.start_m)
                self._slopes.append(0.0)
            self._slopes[-1] = stretch.gradient
            self._edges_m.append(stretch.end_m)
            self._slopes.append(0.0)
        self._heights_m, self._areas_m2 = [0.0], [0.0]
        for first_m, last_m, slope in zip(
            self._edges_m, self._edges_m[1:], self._slopes, strict=False
        ):
            along_m, height_m = last_m - first_m, self._heights_m[-1]
            self._areas_m2.append(self._areas_m2[-1] + along_m * (height_m + 0.5 * slope * along_m))
            self._heights_m.append(height_m + slope * along_m)

    def _at(self, place_m: float) -> tuple[float, float]:
        edge = bisect_right(self._edges_m, place_m) - 1
        along_m, slope, height_m = (
            place_m - self._edges_m[edge],
            self._slopes[edge],
            self._heights_m[edge],
        )
        area_m2 = self._areas_m2[edge] + along_m * (height_m + 0.5 * slope * along_m)
        return height_m + slope * along_m, area_m2

    def slope(self, front_m: float) -> float:
        """Mean under the train."""
        return (self._at(front_m)[0] - self._at(front_m - self._length_m)[0]) / self._length_m

    def height_m(self, front_m: float) -> float:
        """Mean under the train."""
        return (self._at(front_m)[1] - self._at(front_m - self._length_m)[1]) / self._length_m


def run_time_alone_s(
    train: TrainType,
    ends_m: tuple[float, float],
    gradients: Sequence[Gradient] = (),
    limits: Sequence[SpeedLimit] = (),
) -> float:
    """Full traction below every limit and every brake curve, from stand to stand."""
    hills = Hills(gradients, train.length_m)
    mass_kg, gravity = inertial_kg(train), GRAVITY * train.mass_kg / inertial_kg(train)
    brake = train.service_brake_mps2

    def brake_energy(front_m: float) -> float:
        return brake * front_m + gravity * hills.height_m(front_m)

    # Limits to keep under any part of the train, and curves down to each of them.
    held = [(one.start_m, one.end_m + train.length_m, one.limit_mps) for one in limits]
    held = [one for one in held if one[2] < train.maximum_speed_mps]
    curves = [(start, 0.5 * limit**2 + brake_energy(start)) for start, _, limit in held]
    curves.append((ends_m[1], brake_energy(ends_m[1])))
    front_m, speed_mps, time_s = ends_m[0], 0.0, 0.0
    while ends_m[1] - front_m > ARRIVED_M and time_s < 5000.0:
        force_n = pull_n(train, speed_mps) - rolling_n(train, speed_mps)
        gain_mps2 = force_n / mass_kg - gravity * hills.slope(front_m)
        wish_mps = max(speed_mps + STEP_S * gain_mps2, 0.0)
        ahead_m = front_m + 0.5 * STEP_S * (speed_mps + wish_mps)
        top_mps = train.maximum_speed_mps
        for start_m, end_m, limit_mps in held:
            if start_m < ahead_m < end_m:
                top_mps = min(top_mps, limit_mps)
        lowest = min((energy for place_m, energy in curves if place_m >= ahead_m), default=0.0)
        braked_mps = sqrt(max(2.0 * (lowest - brake_energy(ahead_m)), 0.0))
        wish_mps = min(wish_mps, top_mps, braked_mps)
        front_m += 0.5 * STEP_S * (speed_mps + wish_mps)
        speed_mps = wish_mps
        time_s += STEP_S
        if speed_mps < 1e-3 and ends_m[1] - front_m < 0.01:
            break
    return time_s
