"""Run curves against independent solutions, in time and in space, and by brute force."""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, quad, solve_ivp
from scipy.optimize import brentq

from kankaku.railway.arrays import FloatArray
from kankaku.railway.motion.run_curve import RunCurve, RunTimeError, fastest_run
from kankaku.railway.motion.timed_run import timed_run
from kankaku.railway.plan.buffers import Buffers
from kankaku.railway.plan.line import Gradient, Line, Section, SpeedLimit, Track, TrackCurve
from kankaku.railway.plan.rolling_stock import PowerSupply, Traction, TrainType, handbook_resistance
from tests.property.dense_run import Radio, dense_run, inertial_kg, pull_n, rolling_n

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
CURVES = (TrackCurve(500.0, 900.0, 400.0),)
MANY_LIMITS = (
    SpeedLimit(250.0, 420.0, 12.0),
    SpeedLimit(900.0, 1000.0, 9.0),
    SpeedLimit(950.0, 1600.0, 20.0),
    SpeedLimit(1900.0, 2000.0, 14.0),
)
BALISES_M = (-500.0, 0.0, 700.0, 1500.0)
BUFFERS = Buffers(0.001, 0.5, 2.0, BALISES_M)
RADIO = Radio(0.001, 0.5, 2.0, BALISES_M)


def make_line(
    limits: tuple[SpeedLimit, ...] = (),
    gradients: tuple[Gradient, ...] = (),
    curves: tuple[TrackCurve, ...] = (),
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


RUNS = {
    "level": (make_line(), 0.0, 1300.0),
    "short": (make_line(), 0.25, 400.75),
    "gradients": (make_line(gradients=GRADIENTS, curves=CURVES), 0.0, 2100.0),
    "limits": (make_line(limits=LIMITS), 0.0, 2100.0),
    "everything": (make_line(LIMITS, GRADIENTS, CURVES), 50.0, 2600.0),
}
every_run = pytest.mark.parametrize(("line", "start_m", "stop_m"), RUNS.values(), ids=RUNS)


@every_run
def test_agrees_with_an_independent_solution(line: Line, start_m: float, stop_m: float) -> None:
    run = fastest_run(line, TRAIN, start_m, stop_m)
    assert run.run_time_s == pytest.approx(Reference(line, start_m, stop_m).run_time_s(), rel=1e-4)


@every_run
def test_the_two_independent_solutions_agree(line: Line, start_m: float, stop_m: float) -> None:
    dense_s = dense_run(line, TRAIN, (start_m, stop_m)).run_time_s
    assert dense_s == pytest.approx(Reference(line, start_m, stop_m).run_time_s(), rel=2e-5)


@pytest.mark.parametrize(
    "line",
    [
        make_line(),
        make_line(LIMITS),
        make_line(LIMITS, GRADIENTS, CURVES),
        make_line(MANY_LIMITS, GRADIENTS, CURVES),
    ],
    ids=["level", "two limits", "everything", "many limits"],
)
@pytest.mark.parametrize("speeds_mps", [(0.0, 0.0), (8.0, 0.0), (11.3, 8.5), (0.0, 17.0)])
@pytest.mark.parametrize("buffered", [False, True], ids=["plain", "buffered"])
def test_fastest_run_is_the_dense_optimum(
    line: Line, speeds_mps: tuple[float, float], buffered: bool
) -> None:
    ends_m = (50.5, 2600.25)
    radio = RADIO if buffered else Radio()
    optimum_s = dense_run(line, TRAIN, ends_m, speeds_mps, radio).run_time_s
    run = fastest_run(
        line,
        TRAIN,
        *ends_m,
        start_mps=speeds_mps[0],
        stop_mps=speeds_mps[1],
        buffers=BUFFERS if buffered else Buffers(),
    )
    assert run.run_time_s == pytest.approx(optimum_s, rel=1e-3)
    # No faster than allowed; the cells of the optimum make limits up to 10 cm longer.
    assert run.run_time_s >= optimum_s * (1.0 - 1e-4)
    assert run.speed_mps[0] == speeds_mps[0]
    assert run.speed_mps[-1] <= speeds_mps[1] + 1e-9


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


def test_refuses_a_start_faster_than_the_brake_allows() -> None:
    # 100 m at 5 km/h/s: 16.67 m/s.
    assert fastest_run(make_line(), TRAIN, 0.0, 100.0, start_mps=16.6).run_time_s > 0.0
    with pytest.raises(ValueError, match=r"start_mps may be up to 16\.67 at 0 m: 16\.7"):
        fastest_run(make_line(), TRAIN, 0.0, 100.0, start_mps=16.7)
    with pytest.raises(ValueError, match=r"start_mps may be up to 16\.67"):
        timed_run(make_line(), TRAIN, 0.0, 100.0, 20.0, start_mps=16.7)


def test_refuses_a_run_faster_than_the_fastest_and_says_how_long_that_takes() -> None:
    fastest_s = dense_run(make_line(), TRAIN, (0.0, 1300.0)).run_time_s
    with pytest.raises(RunTimeError, match=f"the fastest takes {fastest_s:.2f}"):
        timed_run(make_line(), TRAIN, 0.0, 1300.0, fastest_s - 0.1)


def test_refuses_a_run_slower_than_by_coasting_from_the_start_and_says_how_long_that_takes() -> (
    None
):
    coasting = dense_run(make_line(), TRAIN, (0.0, 1300.0), (20.0, 0.0), traction=False)
    with pytest.raises(RunTimeError, match=r"coasting makes it \d+\.\d+ at most") as caught:
        timed_run(make_line(), TRAIN, 0.0, 1300.0, 500.0, start_mps=20.0)
    named_s = float(str(caught.value).split()[-3])
    assert named_s == pytest.approx(coasting.run_time_s, rel=1e-3)


@pytest.mark.parametrize("line", [make_line(), RUNS["everything"][0]], ids=["level", "everything"])
def test_the_bound_named_to_a_run_that_is_too_slow_can_be_met(line: Line) -> None:
    with pytest.raises(RunTimeError, match=r"at most$") as caught:
        timed_run(line, TRAIN, 0.0, 2100.0, 1e6)
    named_s = float(str(caught.value).split()[-3])
    assert named_s > 2.0 * fastest_run(line, TRAIN, 0.0, 2100.0).run_time_s
    for share in (0.5, 0.9, 1.0):
        run = timed_run(line, TRAIN, 0.0, 2100.0, share * named_s - 0.01)
        assert run.run_time_s == pytest.approx(share * named_s - 0.01, abs=0.01)
    with pytest.raises(RunTimeError):
        timed_run(line, TRAIN, 0.0, 2100.0, named_s + 0.1)


def test_the_time_of_the_fastest_run_gives_the_fastest_run() -> None:
    line, start_m, stop_m = RUNS["everything"]
    fastest = fastest_run(line, TRAIN, start_m, stop_m)
    run = timed_run(line, TRAIN, start_m, stop_m, fastest.run_time_s)
    assert run.speed_mps == pytest.approx(fastest.speed_mps, abs=0.05)
    assert run.traction_work_j[-1] == pytest.approx(fastest.traction_work_j[-1], rel=1e-3)


def phases(run: RunCurve) -> list[str]:
    """What the train does, without repetition; in cells where that changes it does neither."""
    lengths_m = np.diff(run.chainage_m)
    middle_mps = 0.5 * (run.speed_mps[1:] + run.speed_mps[:-1])
    rates_mps2 = 0.5 * np.diff(run.speed_mps**2) / lengths_m
    found: list[str] = []
    for speed_mps, rate_mps2 in zip(middle_mps, rates_mps2, strict=True):
        drag_mps2 = rolling_n(TRAIN, speed_mps) / inertial_kg(TRAIN)
        known = {
            "speed up": pull_n(TRAIN, speed_mps) / inertial_kg(TRAIN) - drag_mps2,
            "cruise": 0.0,
            "coast": -drag_mps2,
            "brake": -TRAIN.service_brake_mps2,
        }
        near = [name for name, rate in known.items() if abs(rate - rate_mps2) < 0.004]
        name = near[0] if len(near) == 1 else "change"
        if not found or found[-1] != name:
            found.append(name)
    return found


@pytest.mark.parametrize(
    ("stop_m", "share", "expected"),
    [
        (3500.0, 1.0, ["speed up", "cruise", "brake"]),
        (3500.0, 1.04, ["speed up", "cruise", "coast", "brake"]),
        (3500.0, 1.2, ["speed up", "coast", "brake"]),
        (900.0, 1.0, ["speed up", "brake"]),
        (900.0, 1.15, ["speed up", "coast", "brake"]),
    ],
)
def test_on_a_level_line_a_train_speeds_up_cruises_coasts_and_brakes_in_this_order(
    stop_m: float, share: float, expected: list[str]
) -> None:
    run = fastest_run(make_line(), TRAIN, 0.0, stop_m)
    if share > 1.0:
        run = timed_run(make_line(), TRAIN, 0.0, stop_m, share * run.run_time_s)
    assert [name for name in phases(run) if name != "change"] == expected


class Level:
    """Running on a level line by quadrature over speed: where, when and at what cost."""

    class Plan(NamedTuple):
        cruise_m: float
        time_s: float
        work_j: float

    def __init__(self, train: TrainType, stop_m: float) -> None:
        self.train, self.stop_m = train, stop_m
        self.speeds_mps = np.linspace(0.0, train.maximum_speed_mps, 20_001)
        middle = 0.5 * (self.speeds_mps[1:] + self.speeds_mps[:-1])
        step = np.diff(self.speeds_mps)
        pull = np.array([pull_n(train, float(speed)) for speed in middle])
        roll = np.array([rolling_n(train, float(speed)) for speed in middle])
        mass = inertial_kg(train)
        self.up = [self.summed(part * step) for part in self.parts(middle, (pull - roll) / mass)]
        self.down = [self.summed(part * step) for part in self.parts(middle, roll / mass)]
        self.work = self.summed(pull * middle * step * mass / (pull - roll))

    @staticmethod
    def parts(speed_mps: FloatArray, rate_mps2: FloatArray) -> tuple[FloatArray, FloatArray]:
        return speed_mps / rate_mps2, 1.0 / rate_mps2

    @staticmethod
    def summed(parts: FloatArray) -> FloatArray:
        return np.concatenate([[0.0], np.cumsum(parts)])

    def at(self, table: FloatArray, speed_mps: float) -> float:
        return float(np.interp(speed_mps, self.speeds_mps, table))

    def plan(self, top_mps: float, braked_mps: float) -> Plan:
        """Speed up, cruise at a top speed, coast, and brake from another speed."""
        up_m, up_s = (self.at(table, top_mps) for table in self.up)
        coast_m, coast_s = (
            self.at(table, top_mps) - self.at(table, braked_mps) for table in self.down
        )
        brake = self.train.service_brake_mps2
        cruise_m = self.stop_m - up_m - coast_m - 0.5 * braked_mps**2 / brake
        time_s = up_s + cruise_m / top_mps + coast_s + braked_mps / brake
        work_j = self.at(self.work, top_mps) + cruise_m * rolling_n(self.train, top_mps)
        return self.Plan(cruise_m, time_s, work_j)

    def least_work_j(self, time_s: float) -> float:
        """Try many top speeds; for each, coast so as to meet the time."""
        found = []
        for top_mps in np.linspace(2.0, self.train.maximum_speed_mps, 400):
            if self.plan(top_mps, top_mps).cruise_m < 0.0:
                continue
            least_mps = 0.0
            if self.plan(top_mps, 0.0).cruise_m < 0.0:
                least_mps = brentq(lambda v, top=top_mps: self.plan(top, v).cruise_m, 0.0, top_mps)
            ends_s = [self.plan(top_mps, v).time_s - time_s for v in (top_mps, least_mps)]
            if ends_s[0] <= 0.0 <= ends_s[1]:
                braked_mps = brentq(
                    lambda v, top=top_mps: self.plan(top, v).time_s - time_s, least_mps, top_mps
                )
                found.append(self.plan(top_mps, braked_mps).work_j)
        return min(found)


@pytest.mark.parametrize("stop_m", [600.0, 1300.0, 3500.0])
@pytest.mark.parametrize("top_mps", [20.0, 25.0])
def test_on_a_level_line_no_cruising_and_coasting_speeds_take_less_energy(
    stop_m: float, top_mps: float
) -> None:
    train = replace(TRAIN, maximum_speed_mps=top_mps)
    level = Level(train, stop_m)
    fastest_s = dense_run(make_line(), train, (0.0, stop_m)).run_time_s
    works_j = []
    for share in (1.01, 1.04, 1.1, 1.2, 1.3):
        run = timed_run(make_line(), train, 0.0, stop_m, share * fastest_s)
        works_j.append(float(run.traction_work_j[-1]))
        assert works_j[-1] == pytest.approx(level.least_work_j(share * fastest_s), rel=2e-3)
    assert all(after < before for before, after in pairwise(works_j))
