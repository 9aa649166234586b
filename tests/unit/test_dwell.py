"""Dwell delays: keyed by train and station, true to their quantiles, correlated along a trip."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import spearmanr

from kankaku.railway.plan.dwell import DwellDelays, Overstay
from kankaku.railway.plan.timetable import Call, Service, Timetable

STATIONS = ("a", "b", "c", "d")
MEASURED = DwellDelays((0.0, 0.5, 0.9, 1.0), (0.0, 4.0, 20.0, 60.0))


def timetable(trains: list[str], stations: tuple[str, ...] = STATIONS) -> Timetable:
    calls = tuple(
        Call(name, "main", 500.0 * index, 60.0 * index, 60.0 * index + 30.0, 20.0)
        for index, name in enumerate(stations)
    )
    return Timetable(tuple(Service(train, "a", "commuter", ("main",), calls) for train in trains))


def many(number: int = 3000) -> list[str]:
    return [f"T{index}" for index in range(number)]


@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_a_train_draws_the_same_whoever_else_runs(correlation: float) -> None:
    delays = replace(MEASURED, trip_correlation=correlation)
    alone = delays.draw(timetable(["X"]), 7)
    among_others = delays.draw(timetable(["A", "X", "B"]), 7)
    assert np.array_equal(alone[0], among_others[1])
    assert np.array_equal(delays.draw(timetable(["X"]), 7), alone)


def test_another_seed_or_another_train_draws_differently() -> None:
    drawn = MEASURED.draw(timetable(["X", "Y"]), 7)
    assert not np.array_equal(drawn[0], drawn[1])
    assert not np.array_equal(drawn[0], MEASURED.draw(timetable(["X"]), 8)[0])


def test_without_correlation_a_station_draws_the_same_wherever_it_stands_in_the_trip() -> None:
    whole = MEASURED.draw(timetable(["X"]), 7)
    shorter = MEASURED.draw(timetable(["X"], ("c", "d")), 7)
    assert np.array_equal(whole[0, 2:], shorter[0])


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_the_measured_quantiles_come_back(correlation: float) -> None:
    delays = replace(MEASURED, trip_correlation=correlation)
    drawn = delays.draw(timetable(many()), 3)
    for column in range(len(STATIONS)):
        # Between two whole seconds, to which draws are rounded.
        for level, expected_s in ((0.3125, 2.5), (0.5125, 4.5), (0.7125, 12.5), (0.90125, 20.5)):
            # Three standard errors of a share of 3000 draws.
            share = np.mean(drawn[:, column] <= expected_s)
            assert share == pytest.approx(level, abs=3.0 * np.sqrt(level * (1 - level) / 3000))


@pytest.mark.parametrize("correlation", [-0.4, 0.0, 0.5, 0.9])
def test_correlation_along_a_trip_has_the_right_sign_and_size(correlation: float) -> None:
    drawn = replace(MEASURED, trip_correlation=correlation).draw(timetable(many()), 11)
    for lag in (1, 2):
        # Rank correlation of a Gaussian copula: 6/pi asin(r/2), Kruskal 1958.
        expected = 6.0 / np.pi * np.arcsin(correlation**lag / 2.0)
        measured = spearmanr(drawn[:, 0], drawn[:, lag]).statistic
        assert measured == pytest.approx(expected, abs=0.06)


def test_scales_multiply_and_the_cap_comes_last() -> None:
    # Long delays, so that rounding to seconds does not matter.
    long = replace(MEASURED, delays_s=(0.0, 400.0, 2000.0, 6000.0))
    plain = long.draw(timetable(many(50)), 5)
    scaled = replace(long, scale=2.0, cap_s=3000.0)
    services = tuple(
        replace(
            service,
            calls=tuple(
                replace(call, delay_scale=0.5) if call.station == "b" else call
                for call in service.calls
            ),
        )
        for service in timetable(many(50)).services
    )
    drawn = scaled.draw(Timetable(services), 5)
    factors = np.array([2.0, 1.0, 2.0, 2.0])
    assert drawn == pytest.approx(np.minimum(plain * factors, 3000.0), abs=1.5)


def test_resampled_delays_are_whole_seconds_as_measured() -> None:
    drawn = replace(MEASURED, scale=1.37).draw(timetable(many(50)), 5)
    assert np.array_equal(drawn, np.round(drawn))


def test_one_more_overstay_changes_no_other_call() -> None:
    named = replace(MEASURED, overstays=(Overstay("T1", "c", 45.0),))
    more = named.overstaying(Overstay("T1", "c", 5.0)).overstaying(Overstay("T2", "a", 7.0))
    added = more.draw(timetable(many(3)), 5) - named.draw(timetable(many(3)), 5)
    expected = np.zeros((3, 4))
    expected[1, 2], expected[2, 0] = 5.0, 7.0
    assert added == pytest.approx(expected)


def test_an_overstay_is_added_to_what_the_train_draws_there() -> None:
    named = replace(MEASURED, cap_s=10.0, overstays=(Overstay("T1", "c", 45.0),))
    drawn = named.draw(timetable(many(3)), 5)
    drawn -= replace(MEASURED, cap_s=10.0).draw(timetable(many(3)), 5)
    expected = np.zeros((3, 4))
    expected[1, 2] = 45.0
    assert drawn == pytest.approx(expected)
