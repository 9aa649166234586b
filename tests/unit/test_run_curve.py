"""The fastest run against an independent event-based solution in time."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, quad, solve_ivp

from railway.line import Curve, Gradient, Line, Section, SpeedLimit, Track
from railway.rolling_stock import PowerSupply, Traction, TrainType, handbook_resistance
from railway.run_curve import fastest_run

GRAVITY = 9.80665
END_M = 4000.0
TRAIN = TrainType(
    id="test",
    cars=10,
    length_m=200.0,
    mass_kg=440e3,
    rotating_mass_ratio=0.08,
    traction=Traction(335e3, 40 / 3.6, 75 / 3.6),
    resistance=handbook_resistance(270e3, 170e3, 10),
    service_brake_mps2=5.0 / 3.6,
    emergency_brake_mps2=5.5 / 3.6,
    maximum_speed_mps=25.0,
    supply=PowerSupply(0.85, 0.8, 400e3, 5e6, 1.0, 2e5),
)
LIMITS = (SpeedLimit(600.0, 900.0, 15.0), SpeedLimit(1500.0, 1650.0, 18.0))
GRADIENTS = (Gradient(300.0, 800.0, 0.012), Gradient(1200.0, 1700.0, -0.01))
CURVES = (Curve(500.0, 900.0, 400.0),)


def make_line(
    limits: tuple[SpeedLimit, ...] = (),
    gradients: tuple[Gradient, ...] = (),
    curves: tuple[Curve, ...] = (),
) -> Line:
    section = Section(-500.0, END_M, (Track("main", -500.0, END_M),))
    return Line("test", (), (section,), (), (), limits, gradients, curves, (), ())


def share(start_m: float, end_m: float, front_m: float) -> float:
    """Part of the train that stands on a stretch."""
    return max(min(front_m, end_m) - max(front_m - TRAIN.length_m, start_m), 0.0) / TRAIN.length_m


def resist(line: Line, front_m: float) -> float:
    slope = sum(g.gradient * share(g.start_m, g.end_m, front_m) for g in line.gradients)
    curve = sum(0.6 / c.radius_m * share(c.start_m, c.end_m, front_m) for c in line.curves)
    return GRAVITY * (slope + curve) / (1.0 + TRAIN.rotating_mass_ratio)


class Reference:
    """Accelerate until an allowed-speed curve is met, follow it until it jumps up, repeat."""

    def __init__(self, line: Line, start_m: float, stop_m: float) -> None:
        self.line, self.start_m, self.stop_m = line, start_m, stop_m
        slopes = make_line(gradients=line.gradients)
        self.grid_m = np.linspace(start_m, stop_m, 8001)
        pull = [resist(slopes, x_m) for x_m in self.grid_m]
        self.rise = cumulative_trapezoid(pull, self.grid_m, initial=0)

    def allowed(self, x_m: float) -> float:
        """Square of the allowed speed, halved."""
        best = 0.5 * TRAIN.maximum_speed_mps**2
        here = np.interp(x_m, self.grid_m, self.rise)
        for limit in (*self.line.limits, SpeedLimit(self.stop_m, self.stop_m + 1.0, 0.0)):
            if x_m >= limit.end_m + TRAIN.length_m:
                continue
            there = np.interp(limit.start_m, self.grid_m, self.rise)
            brake = TRAIN.service_brake_mps2 * max(limit.start_m - x_m, 0.0)
            extra = brake + (there - here if limit.start_m > x_m else 0.0)
            best = min(best, 0.5 * limit.limit_mps**2 + extra)
        return float(best)

    def run_time_s(self) -> float:
        ends_m = [limit.end_m + TRAIN.length_m for limit in self.line.limits] + [self.stop_m]
        time_s, x_m, v_mps = 0.0, self.start_m, 0.0
        while x_m < self.stop_m - 0.01:
            time_s, x_m, v_mps = self.accelerate(time_s, x_m, v_mps)
            end_m = min(end for end in ends_m if end > x_m + 1e-6)
            end_m = end_m - 0.005 if end_m == self.stop_m else end_m
            time_s += quad(lambda x: (2.0 * self.allowed(x)) ** -0.5, x_m, end_m, limit=400)[0]
            x_m = end_m
            v_mps = float(np.sqrt(2.0 * self.allowed(end_m - 1e-6)))
        return time_s + 0.005 / (0.5 * v_mps)

    def accelerate(self, time_s: float, x_m: float, v_mps: float) -> tuple[float, float, float]:
        def motion(_: float, y: np.ndarray) -> list[float]:
            force = TRAIN.level_acceleration_mps2(np.array(y[1]))
            return [y[1], float(force) - resist(self.line, y[0])]

        def meets(_: float, y: np.ndarray) -> float:
            return 0.5 * float(y[1]) ** 2 - self.allowed(y[0])

        meets.terminal = True  # type: ignore[attr-defined]
        meets.direction = 1.0  # type: ignore[attr-defined]
        solution = solve_ivp(
            motion, (time_s, 1000.0), [x_m, v_mps], events=meets, max_step=0.5, rtol=1e-8
        )
        assert solution.status == 1
        return float(solution.t[-1]), float(solution.y[0, -1]), float(solution.y[1, -1])


@pytest.mark.parametrize(
    ("line", "start_m", "stop_m"),
    [
        (make_line(), 0.0, 1300.0),
        (make_line(), 0.25, 400.75),
        (make_line(gradients=GRADIENTS, curves=CURVES), 0.0, 2100.0),
        (make_line(limits=LIMITS), 0.0, 2100.0),
        (make_line(LIMITS, GRADIENTS, CURVES), 50.0, 2600.0),
    ],
    ids=["level", "short", "gradients", "limits", "everything"],
)
def test_agrees_with_an_independent_solution(line: Line, start_m: float, stop_m: float) -> None:
    run = fastest_run(line, TRAIN, start_m, stop_m)
    assert run.run_time_s == pytest.approx(Reference(line, start_m, stop_m).run_time_s(), rel=2e-3)


def test_curve_starts_and_ends_at_rest_and_time_rises() -> None:
    run = fastest_run(make_line(LIMITS, GRADIENTS, CURVES), TRAIN, 0.0, 2100.0)
    assert run.chainage_m[[0, -1]].tolist() == [0.0, 2100.0]
    assert run.speed_mps[[0, -1]].tolist() == [0.0, 0.0]
    assert np.all(np.diff(run.time_s) > 0.0)
    over_limit = (run.chainage_m > 600.0) & (run.chainage_m < 1100.0)
    assert np.all(run.speed_mps[over_limit] <= 15.0 + 1e-9)


def test_refuses_a_stop_behind_the_start_and_a_wall() -> None:
    with pytest.raises(ValueError, match="stop_m must be above"):
        fastest_run(make_line(), TRAIN, 100.0, 100.0)
    with pytest.raises(ValueError, match="cannot climb"):
        fastest_run(make_line(gradients=(Gradient(100.0, 900.0, 0.2),)), TRAIN, 0.0, 900.0)
