"""Availability: closed forms, and simulated years beside them."""

import numpy as np
import pytest

from kankaku.railway.failures.availability import (
    YEAR_S,
    Configuration,
    DeviceGroup,
    availability,
    estimate,
    simulate_outages,
)

HOUR_S = 3600.0


def system(*groups: DeviceGroup) -> Configuration:
    return Configuration("some", "Some", groups, {})


def test_failures_and_stopped_time_add_up_over_the_devices() -> None:
    found = availability(
        system(
            DeviceGroup("controller", 1.0, 1.0, 1e-4 / HOUR_S, 2.0 * HOUR_S),
            DeviceGroup("base", 3.0, 1.0 / 3.0, 2e-4 / HOUR_S, 4.0 * HOUR_S),
        )
    )
    assert found.failures_per_year == pytest.approx(8760 * (1e-4 + 6e-4))
    assert found.stopped_s_per_year / HOUR_S == pytest.approx(8760 * (2e-4 + 8e-4))
    assert found.mean_repair_s / HOUR_S == pytest.approx(10.0 / 7.0)
    assert found.availability == pytest.approx(1.0 - 1e-3)


def test_devices_that_never_fail() -> None:
    perfect = system(DeviceGroup("controller", 2.0, 1.0, 0.0, HOUR_S))
    assert availability(perfect).availability == 1.0
    assert np.isnan(availability(perfect).mean_repair_s)
    years = simulate_outages(perfect, 10, 1)
    assert not np.concatenate(years).any()


def test_a_pair_stops_the_line_as_often_as_both_are_down_at_once() -> None:
    # Two devices that are down a share U of the time: both at once 2 A U / r times a second, each
    # time for r / 2 on the average.
    rate_per_s, repair_s = 1.0 / (100.0 * HOUR_S), 10.0 * HOUR_S
    pair = system(DeviceGroup("controller", 2.0, 0.5, rate_per_s, repair_s))
    years = simulate_outages(pair, 400, 3)
    down = repair_s / (repair_s + 1.0 / rate_per_s)
    stops = estimate(years.whole_stops)
    expected = 2.0 * rate_per_s * (1.0 - down) * down * YEAR_S
    assert abs(stops.mean - expected) < 1.5 * stops.half_width
    stopped = estimate(years.whole_stopped_s)
    assert abs(stopped.mean - down**2 * YEAR_S) < 1.5 * stopped.half_width


def test_three_areas_stop_the_line_only_together() -> None:
    areas = system(DeviceGroup("controller", 3.0, 1.0 / 3.0, 1e-5 / HOUR_S, 2.0 * HOUR_S))
    assert simulate_outages(areas, 10_000, 1).whole_stops.sum() == 0.0
    # With devices that are nearly always down, thirds add up to a whole line in spite of rounding.
    broken = system(DeviceGroup("controller", 3.0, 1.0 / 3.0, 100.0 / HOUR_S, 100.0 * HOUR_S))
    assert simulate_outages(broken, 2, 1).whole_stopped_s.sum() > 0.9 * YEAR_S


def test_two_thirds_of_a_device_fail_two_thirds_as_often() -> None:
    part = system(DeviceGroup("controller", 2.0 / 3.0, 1.0, 1e-3 / HOUR_S, HOUR_S))
    failures = estimate(simulate_outages(part, 3_000, 1).failures)
    assert abs(failures.mean - 8.76 * 2.0 / 3.0) < 1.5 * failures.half_width


def test_the_intervals_hold_what_they_promise() -> None:
    one = system(DeviceGroup("controller", 1.0, 1.0, 2e-4 / HOUR_S, 2.0 * HOUR_S))
    exact = availability(one)
    inside = 0
    for seed in range(300):
        years = simulate_outages(one, 400, seed)
        found = estimate(years.failures)
        # A device under repair does not fail: 0.04 % fewer failures than by multiplication.
        inside += abs(found.mean - exact.failures_per_year) <= found.half_width
    # 99 % of 300 is 297; fewer than 288 would be five standard deviations off.
    assert inside >= 288


def test_the_same_seed_gives_the_same_years() -> None:
    one = system(DeviceGroup("controller", 1.0, 1.0, 1e-4 / HOUR_S, HOUR_S))
    first, again, other = (simulate_outages(one, 100, seed) for seed in (1, 1, 2))
    assert np.array_equal(first.failures, again.failures)
    assert not np.array_equal(first.stopped_s, other.stopped_s)
