"""The tables of a line against integration in time and against the line itself."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from kankaku.railway.plan.line import Gradient, Line, SpeedLimit, TrackCurve
from kankaku.railway.plan.profile import Profile, build_profile
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.testing.example_lines import commuter_train, straight_line
from tests.examples import examples
from tests.property.runs import GRAVITY, mean_slope, random_gradients, random_limits

END_M = 4000.0
LENGTH_M = 187.3
TRAIN = commuter_train(length_m=LENGTH_M)
QUICK = examples(25)


def line_of(
    gradients: list[Gradient] | None = None, limits: list[SpeedLimit] | None = None
) -> Line:
    return straight_line({"west": 300.0}, END_M, gradients or (), limits or ())


def look_up(profile: Profile, table: np.ndarray, chainage_m: float) -> float:
    return float(np.interp(chainage_m, profile.grid_m, table[0]))


def stopping_place_m(line: Line, train: TrainType, front_m: float, speed_mps: float) -> float:
    """Integrate braking in time; the gradient pulls on every part of the train."""

    def motion(_: float, y: np.ndarray) -> list[float]:
        pull = GRAVITY * mean_slope(line, float(y[0]), train.length_m) * train.gravity_ratio
        return [y[1], -train.service_brake_mps2 - pull]

    def stands(_: float, y: np.ndarray) -> float:
        return float(y[1])

    stands.terminal = True  # type: ignore[attr-defined]
    solution = solve_ivp(
        motion, (0.0, 500.0), [front_m, speed_mps], events=stands, rtol=1e-8, max_step=2.0
    )
    return float(solution.y[0, -1])


@QUICK
@given(random_gradients(END_M), st.floats(300.0, 2500.0), st.floats(20.0, 900.0))
def test_brake_potential_gives_the_speed_from_which_a_train_just_stops(
    gradients: list[Gradient], front_m: float, ahead_m: float
) -> None:
    line = line_of(gradients)
    profile = build_profile(line, [TRAIN])
    potential = profile.potential_m2ps2
    drop = look_up(profile, potential, front_m + ahead_m) - look_up(profile, potential, front_m)
    stopped_m = stopping_place_m(line, TRAIN, front_m, float(np.sqrt(2.0 * drop)))
    assert stopped_m == pytest.approx(front_m + ahead_m, abs=0.02)


@QUICK
@given(random_gradients(END_M), random_limits(END_M))
def test_line_ceiling_is_the_highest_that_obeys_every_limit_ahead(
    gradients: list[Gradient], limits: list[SpeedLimit]
) -> None:
    line = line_of(gradients, limits)
    profile = build_profile(line, [TRAIN])
    fronts_m = np.arange(100.25, END_M, 7.0)
    height_m = np.interp(fronts_m, profile.grid_m, independent_mean_height(line, profile.grid_m))
    half_squares = profile.ceiling_at_m2ps2(0, fronts_m)
    gravity = GRAVITY * TRAIN.gravity_ratio
    brake_energy = TRAIN.service_brake_mps2 * fronts_m + gravity * height_m

    # Nothing on any part of the train is passed.
    allowed = np.full(fronts_m.shape, TRAIN.maximum_speed_mps)
    kept_longest = allowed.copy()
    kept_m = LENGTH_M + 0.01
    for limit in limits:
        on_it = (fronts_m > limit.start_m) & (fronts_m - LENGTH_M < limit.end_m)
        allowed[on_it] = np.minimum(allowed[on_it], limit.limit_mps)
        near = (fronts_m > limit.start_m - 0.01) & (fronts_m - kept_m < limit.end_m)
        kept_longest[near] = np.minimum(kept_longest[near], limit.limit_mps)
    assert np.all(half_squares <= 0.5 * allowed**2 + 1e-9)

    # It can be followed with the service brake.
    assert np.all(np.diff(half_squares + brake_energy) >= -1e-3)

    # And it is no lower than the limits demand, a metre or two of the grid aside.
    samples = 0.5 * kept_longest**2 + brake_energy
    needed = np.minimum.accumulate(samples[::-1])[::-1] - brake_energy
    slack = 9.0 * (TRAIN.service_brake_mps2 + gravity * 0.035)
    assert np.all(half_squares >= needed - slack)


def independent_mean_height(line: Line, fronts_m: np.ndarray) -> np.ndarray:
    """Integrate the mean slope from the first front on."""
    slopes = np.array([mean_slope(line, float(front_m), LENGTH_M) for front_m in fronts_m])
    steps = 0.5 * (slopes[1:] + slopes[:-1]) * np.diff(fronts_m)
    return np.concatenate([[0.0], np.cumsum(steps)])


@QUICK
@given(random_gradients(END_M))
def test_gradient_drag_is_the_mean_slope_under_the_train(gradients: list[Gradient]) -> None:
    line = line_of(gradients)
    profile = build_profile(line, [TRAIN])
    for front_m in (250.0, 1033.0, 2590.0, 3999.0):
        slope = mean_slope(line, front_m, LENGTH_M)
        drag = look_up(profile, profile.drag_mps2, front_m)
        # A metre of grid against 187 m of train.
        assert drag == pytest.approx(GRAVITY * slope / 1.08, abs=GRAVITY * 0.07 / LENGTH_M)


def test_a_curve_drags_in_proportion_to_the_part_of_the_train_on_it() -> None:
    curved = replace(line_of(), curves=(TrackCurve(1000.0, 1300.0, 400.0),))
    profile = build_profile(curved, [TRAIN])
    # 600 / 400 kgf per tonne.
    whole = 600.0 / 400.0 * 1e-3 * GRAVITY / 1.08
    for front_m, share in (
        (900.0, 0.0),
        (1000.0 + LENGTH_M / 2, 0.5),
        (1250.0, 1.0),
        (1500.0, 0.0),
    ):
        drag = look_up(profile, profile.curve_drag_mps2, front_m)
        assert drag == pytest.approx(share * whole, abs=whole / LENGTH_M)


def test_beyond_both_ends_the_line_is_level_and_the_ceiling_is_the_trains_own() -> None:
    profile = build_profile(line_of([Gradient(0.0, END_M, 0.02)]), [TRAIN])
    for front_m in (-500.0, END_M + LENGTH_M + 100.0):
        assert look_up(profile, profile.drag_mps2, front_m) == pytest.approx(0.0, abs=1e-9)
        ceiling = np.sqrt(2.0 * look_up(profile, profile.ceiling_m2ps2, front_m))
        assert ceiling == pytest.approx(TRAIN.maximum_speed_mps)
