"""Plans to pass an approach point at a given time, whatever the train is doing."""

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from kankaku.controllers.operation.approach_plan import ApproachPoint, Site, plan_passing
from kankaku.railway.arrays import FloatArray
from kankaku.railway.motion.run_curve import RunCurve, fastest_run
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.testing.example_lines import commuter_train
from tests.property.dense_run import dense_run
from tests.unit.approach_sites import (
    EXACT_S,
    GATE_M,
    HILLY,
    TOP_MPS,
    Level,
    line_of,
    plain_train,
    point_of,
    site_of,
)

DELAYS_S = (0.0, 0.5)


@cache
def plain(delay_s: float = 0.0) -> tuple[Site, ApproachPoint]:
    """Return the site of a plain train on the level."""
    site = site_of(plain_train(), delay_s=delay_s)
    return site, point_of(site)


@cache
def hilly() -> tuple[Site, ApproachPoint]:
    """Return that of a real train on hills and under limits."""
    site = site_of(commuter_train(), HILLY)
    return site, point_of(site)


class Before(NamedTuple):
    """A plain train at a speed, so far before an approach point, in closed form."""

    point: ApproachPoint
    level: Level
    way_m: float
    speed_mps: float

    @property
    def front_m(self) -> float:
        return self.point.front_m - self.way_m

    @property
    def reaches(self) -> bool:
        """It can still get the speed of the approach point."""
        square = self.speed_mps**2 + 2.0 * self.level.speeding_mps2 * self.way_m
        return square >= self.point.speed_mps**2

    def quickest_s(self) -> float:
        """Speed up to the pattern, or to the greatest speed and hold it, then brake along it."""
        a, b, delay_s, gate_m = self.level
        start_mps, end_mps = self.speed_mps, self.point.speed_mps
        if not self.reaches:
            return float(np.sqrt(start_mps**2 + 2.0 * a * self.way_m) - start_mps) / a
        # v^2 / 2 = b (gate - x - v tau) where v^2 = start^2 + 2 a (x - front).
        half, square = 1.0 + a / b, start_mps**2 + 2.0 * a * (gate_m - self.front_m)
        meets_mps = (np.sqrt((a * delay_s) ** 2 + half * square) - a * delay_s) / half
        held_s = 0.0
        if meets_mps > TOP_MPS:
            meets_mps = TOP_MPS
            sped_up_m = 0.5 * (TOP_MPS**2 - start_mps**2) / a
            held_m = float(self.level.on_pattern_m(TOP_MPS)) - self.front_m - sped_up_m
            held_s = held_m / TOP_MPS
        # dt = dx / v along the pattern.
        braking_s = (meets_mps - end_mps) / b + delay_s * np.log(meets_mps / end_mps)
        return float((meets_mps - start_mps) / a + held_s + braking_s)

    @property
    def room_m(self) -> float:
        """What is left of the way after braking to a stand and before speeding up."""
        a, b = self.level.speeding_mps2, self.level.braking_mps2
        speeding_up_m = 0.5 * self.point.speed_mps**2 / a if self.reaches else 0.0
        return self.way_m - 0.5 * self.speed_mps**2 / b - speeding_up_m

    def slowest_s(self) -> float:
        """Without a stop: brake, and speed up just in time; infinite if it can as well crawl."""
        a, b = self.level.speeding_mps2, self.level.braking_mps2
        if self.room_m >= 0.0:
            return np.inf
        if not self.reaches:
            return float(self.speed_mps - np.sqrt(-2.0 * b * self.room_m)) / b
        least_mps = np.sqrt(-2.0 * a * b * self.room_m / (a + b))
        return float((self.speed_mps - least_mps) / b + (self.point.speed_mps - least_mps) / a)

    def stopping_s(self) -> float:
        """Stop as soon as possible, and start again at once; infinite if beyond the point."""
        a, b = self.level.speeding_mps2, self.level.braking_mps2
        again_m = self.way_m - 0.5 * self.speed_mps**2 / b
        return self.speed_mps / b + float(np.sqrt(2.0 * again_m / a)) if again_m > 0.0 else np.inf

    def lost_s(self, too_soon_s: float) -> float:
        """Later arrival of a train that passes too soon and brakes until the gate opens."""
        then_mps = max(self.point.speed_mps - self.level.braking_mps2 * too_soon_s, 0.0)
        at_best_s = self.level.run_in_s(self.point.speed_mps)
        return float(self.level.run_in_s(then_mps) - at_best_s)


@st.composite
def trains_before(draw: st.DrawFn) -> tuple[float, Before]:
    """Anywhere on the way, and often near the end, at any speed within pattern and ceiling."""
    delay_s = draw(st.sampled_from(DELAYS_S))
    point, level = plain(delay_s)[1], Level(0.9, 1.0, delay_s)
    way_m = draw(st.floats(0.5, 1400.0) | st.floats(0.5, 60.0))
    to_gate_m = GATE_M - point.front_m + way_m
    b = level.braking_mps2
    most_mps = min(b * (np.sqrt(delay_s**2 + 2.0 * to_gate_m / b) - delay_s), TOP_MPS)
    share = draw(st.floats(0.01, 0.999) | st.sampled_from([0.0, 0.999]))
    return delay_s, Before(point, level, way_m, share * most_mps)


@settings(max_examples=400, deadline=None)
@given(trains_before(), st.floats(-5.0, 60.0) | st.floats(0.0, 5.0))
def test_whatever_the_train_does_it_is_there_at_the_time_if_it_can(
    drawn: tuple[float, Before], spare_s: float
) -> None:
    delay_s, train = drawn
    # Nobody plans to crawl over less than a few cells of a metre.
    assume(not 0.0 <= train.room_m < 3.0)
    assume(train.reaches)
    quickest_s = train.quickest_s()
    left_s = quickest_s + spare_s
    passing = plan_passing(plain(delay_s)[0], train.point, train.front_m, train.speed_mps, left_s)
    if spare_s <= -EXACT_S:
        assert passing is None
    if passing is None:
        too_soon = left_s > train.slowest_s() - EXACT_S
        too_soon &= train.stopping_s() - left_s > train.lost_s(spare_s) - EXACT_S
        assert spare_s <= EXACT_S or too_soon
        return
    off_s = passing.wait_s + passing.curve.run_time_s - left_s
    if train.slowest_s() + EXACT_S < left_s < train.stopping_s() - EXACT_S:
        # It can neither be so slow nor stop and start again in the time.
        assert 0.0 <= off_s < train.lost_s(spare_s) + EXACT_S
    else:
        assert abs(off_s) <= EXACT_S
    assert_a_sound_curve(passing.curve, train)


@pytest.mark.parametrize("delay_s", DELAYS_S)
@pytest.mark.parametrize("way_m", [5.0, 20.0, -15.0])
def test_a_train_that_stands_too_near_to_reach_the_speed_meets_the_pattern_further_on(
    delay_s: float, way_m: float
) -> None:
    """Full acceleration v^2 = 2 a s meets v^2 / 2 = b (gate - x - v tau)."""
    site, point = plain(delay_s)
    a, b = 0.9, 1.0
    front_m = point.front_m - way_m
    passing = plan_passing(site, point, front_m, 0.0, 25.0)
    assert passing is not None
    assert passing.wait_s + passing.curve.run_time_s == pytest.approx(25.0, abs=EXACT_S)
    half, square = 1.0 + a / b, 2.0 * a * (GATE_M - front_m)
    meets_mps = (np.sqrt((a * delay_s) ** 2 + half * square) - a * delay_s) / half
    # But for a cell of a metre.
    met_m, met_mps = float(passing.curve.chainage_m[-1]), float(passing.curve.speed_mps[-1])
    assert met_mps == pytest.approx(meets_mps, abs=0.3)
    assert met_m > max(point.front_m, front_m)
    assert GATE_M - 2.0 <= met_m + met_mps * delay_s + 0.5 * met_mps**2 / b <= GATE_M + 0.02


def assert_a_sound_curve(curve: RunCurve, train: Before) -> None:
    """Within pattern and ceiling, to the approach point, at its speed if that can be had."""
    a, b, delay_s, gate_m = train.level
    assert curve.chainage_m[-1] == train.point.front_m
    assert np.all(np.diff(curve.time_s) > 0.0)
    assert np.all(curve.speed_mps <= TOP_MPS + 1e-9)
    ends_m = curve.chainage_m + curve.speed_mps * delay_s + 0.5 * np.square(curve.speed_mps) / b
    assert np.all(ends_m <= gate_m + 0.02)
    squares = np.diff(np.square(curve.speed_mps)) / (2.0 * np.diff(curve.chainage_m))
    assert np.all(squares <= a + 1e-6)
    assert np.all(squares[1:] >= -b - 0.01)
    start_mps, end_mps = curve.speed_mps[[0, -1]].tolist()
    room_m = curve.chainage_m[-1] - curve.chainage_m[0]
    could_mps = np.sqrt(start_mps**2 + 2.0 * a * room_m)
    if could_mps >= train.point.speed_mps:
        assert end_mps == pytest.approx(train.point.speed_mps, abs=0.02)
    else:
        assert end_mps <= could_mps + 0.02


@settings(max_examples=25, deadline=None)
@given(st.floats(450.0, 1400.0), st.floats(0.0, 0.99), st.floats(-5.0, -0.1) | st.floats(0.1, 80.0))
def test_on_hills_and_under_limits_a_train_with_time_and_room_is_there_in_time(
    way_m: float, share: float, spare_s: float
) -> None:
    train = commuter_train()
    site, point = hilly()
    front_m = point.front_m - way_m
    potential, ceiling = site.profile.potential_m2ps2[0], site.profile.ceiling_m2ps2[0]
    grid_m = site.profile.grid_m
    to_gate = np.interp([GATE_M, front_m], grid_m, potential)
    most = min(float(to_gate[0] - to_gate[1]), float(np.interp(front_m, grid_m, ceiling)))
    speed_mps = share * float(np.sqrt(2.0 * most))
    dense = dense_run(HILLY, train, (front_m, point.front_m), (speed_mps, point.speed_mps))
    left_s = dense.run_time_s + spare_s
    passing = plan_passing(site, point, front_m, speed_mps, left_s)
    assert (passing is None) == (spare_s < 0.0)
    if passing is None:
        return
    curve = passing.curve
    assert passing.wait_s + curve.run_time_s == pytest.approx(left_s, abs=EXACT_S)
    assert curve.speed_mps[-1] == pytest.approx(point.speed_mps, abs=0.02)
    pattern = np.interp(GATE_M, grid_m, potential) - np.interp(curve.chainage_m, grid_m, potential)
    assert np.all(0.5 * np.square(curve.speed_mps) <= pattern + 0.1)
    assert np.all(curve.speed_mps <= train.maximum_speed_mps + 1e-9)
    for limit in HILLY.limits:
        on_it = curve.chainage_m >= limit.start_m
        on_it &= curve.chainage_m <= limit.end_m + train.length_m
        assert np.all(curve.speed_mps[on_it] <= limit.limit_mps + 1e-9)


@pytest.mark.parametrize("left_s", [60.0, 90.0, 400.0])
def test_a_standing_train_waits_and_then_runs_its_fastest(left_s: float) -> None:
    train = commuter_train()
    site, point = hilly()
    front_m = point.front_m - 600.0
    passing = plan_passing(site, point, front_m, 0.0, left_s)
    assert passing is not None
    assert passing.stop_m == front_m
    ends_m, speeds_mps = (front_m, point.front_m), (0.0, point.speed_mps)
    fastest_s = dense_run(HILLY, train, ends_m, speeds_mps).run_time_s
    assert passing.curve.run_time_s == pytest.approx(fastest_s, abs=EXACT_S)
    assert passing.wait_s == pytest.approx(left_s - fastest_s, abs=EXACT_S)


def test_a_train_with_much_too_much_time_stops_at_the_optimal_stop_and_starts_once() -> None:
    site, point = plain()
    passing = plan_passing(site, point, point.front_m - 500.0, 15.0, 800.0)
    assert passing is not None
    assert passing.stop_m == point.optimal_stop_m
    assert passing.curve.run_time_s == pytest.approx(point.speed_mps / 0.9, abs=EXACT_S)
    assert passing.wait_s == pytest.approx(800.0 - point.speed_mps / 0.9, abs=EXACT_S)


def drops(curve: RunCurve, train: TrainType) -> FloatArray:
    """By how much more a train slows down than by coasting, cell by cell. [m2/s2]"""
    half_squares = 0.5 * np.square(curve.speed_mps)
    middle_mps = 0.5 * (curve.speed_mps[1:] + curve.speed_mps[:-1])
    coasting = train.resistance.force_n(middle_mps) / train.inertial_mass_kg
    slower: FloatArray = -np.diff(half_squares) - coasting * np.diff(curve.chainage_m)
    return slower


@pytest.mark.parametrize("share", [0.05, 0.3, 0.7, 1.0])
def test_a_train_coasts_and_brakes_only_into_the_point_where_that_is_slow_enough(
    share: float,
) -> None:
    """Between the fastest run and coasting all the way, nothing is braked away before its end."""
    train, line = commuter_train(), line_of()
    site = site_of(train)
    point = point_of(site)
    front_m = point.front_m - 700.0
    ends_m, speeds_mps = (front_m, point.front_m), (16.0, point.speed_mps)
    quickest_s = dense_run(line, train, ends_m, speeds_mps).run_time_s
    coasting_s = dense_run(line, train, ends_m, speeds_mps, traction=False).run_time_s
    left_s = quickest_s + share * (coasting_s - quickest_s)
    passing = plan_passing(site, point, front_m, 16.0, left_s)
    assert passing is not None
    curve = passing.curve
    assert passing.wait_s == 0.0
    assert curve.run_time_s == pytest.approx(left_s, abs=EXACT_S)
    braking = drops(curve, train) > 0.02
    into_end = 0.5 * point.speed_mps**2 + (point.front_m - curve.chainage_m[1:])
    assert np.all(0.5 * np.square(curve.speed_mps[1:][braking]) >= into_end[braking] - 0.2)
    work_j = curve.traction_work_j[-1]
    fastest_j = fastest_run(
        line, train, *ends_m, start_mps=16.0, stop_mps=point.speed_mps
    ).traction_work_j[-1]
    assert work_j <= (1.0 - 0.5 * share) * fastest_j
    if share == 1.0:
        assert work_j <= 0.01 * fastest_j


def test_a_train_that_would_be_too_soon_by_coasting_brakes_first_and_runs_on_slower() -> None:
    train = commuter_train()
    site = site_of(train)
    point = point_of(site)
    front_m = point.front_m - 700.0
    ends_m, speeds_mps = (front_m, point.front_m), (16.0, point.speed_mps)
    coasting = dense_run(line_of(), train, ends_m, speeds_mps, traction=False)
    passing = plan_passing(site, point, front_m, 16.0, coasting.run_time_s + 20.0)
    assert passing is not None
    braking = drops(passing.curve, train) > 0.02
    assert braking[1:20].all()
    assert passing.curve.speed_mps.min() > 3.0
    assert passing.wait_s == 0.0


def test_a_train_past_the_point_has_no_plan() -> None:
    site, point = plain()
    for front_m in (point.front_m, point.front_m + 10.0):
        assert plan_passing(site, point, front_m, 5.0, 20.0) is None
