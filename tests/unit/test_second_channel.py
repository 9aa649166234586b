"""The second channel refuses a map for each of its three reasons, and no other."""

from typing import Any

import numpy as np
import pytest

from kankaku.railway.compiled import plain
from kankaku.railway.safety.second_channel import checked, excludes
from kankaku.testing.example_lines import two_station_scenario, world_of

WORLD = world_of(two_station_scenario(2, 120.0))
MARGIN_M, ROUNDING_M, VALID_S = 10.0, 0.5, 3.0
FIELDS = plain(checked(WORLD, MARGIN_M, ROUNDING_M, VALID_S))
NOW_S = 25_400.0
FRONTS_M = np.array([1600.0, 600.0])
"""Two trains of 200 m on one track, the first one ahead: the second is free up to 1400 m."""
TAIL_M = 1400.0


def may_be_sent(
    end_m: float = 1300.0,
    bands_m: tuple[tuple[float, float], tuple[float, float]] = ((1400.0, 1700.0), (400.0, 1390.0)),
    **other: Any,  # noqa: ANN401 - each part of the call, with a kind of its own
) -> bool:
    given: dict[str, Any] = {
        "speed_mps": np.zeros(2),
        "longer_m": np.zeros(2),
        "known_s": np.full(2, NOW_S),
        "planned": np.ones(2, dtype=np.bool_),
        "granted_m": np.full(2, 5000.0),
    } | other
    told = (NOW_S, given["known_s"], FRONTS_M, given["speed_mps"], given["longer_m"])
    line = (FRONTS_M, np.ones(2, dtype=np.bool_), given["granted_m"])
    rears_m, fronts_m = np.array(bands_m).T[:, :, None]
    furthest_m = np.array([-np.inf, end_m])
    mapped = (np.arange(2), given["planned"], rears_m.copy(), fronts_m.copy(), furthest_m)
    return bool(excludes(told, line, mapped, FIELDS))


def test_bands_that_are_apart_may_be_sent() -> None:
    assert may_be_sent()


def test_no_end_lies_beyond_what_is_free_less_the_margin() -> None:
    least_m = TAIL_M - MARGIN_M
    assert may_be_sent(least_m)
    assert may_be_sent(least_m + ROUNDING_M)
    assert not may_be_sent(least_m + ROUNDING_M + 0.01)


def test_whoever_does_not_know_where_it_is_counts_as_longer() -> None:
    assert may_be_sent(1385.0)
    assert not may_be_sent(1385.0, longer_m=np.array([20.0, 0.0]))


def test_what_is_not_granted_by_wire_is_not_free() -> None:
    assert not may_be_sent(granted_m=np.array([5000.0, 1290.0]))


def test_no_band_lies_in_that_of_the_train_ahead() -> None:
    assert may_be_sent(bands_m=((1400.0, 1700.0), (400.0, 1400.0 + ROUNDING_M)))
    assert not may_be_sent(bands_m=((1400.0, 1700.0), (400.0, 1401.0)))


def test_whoever_was_not_planned_for_is_sent_nothing() -> None:
    overlapping = ((1400.0, 1700.0), (400.0, 1450.0))
    assert not may_be_sent(bands_m=overlapping)
    assert may_be_sent(bands_m=overlapping, planned=np.array([True, False]))


@pytest.mark.parametrize(("age_s", "sent"), [(0.0, False), (VALID_S, True), (99.0, True)])
def test_a_train_has_run_on_since_its_report(age_s: float, sent: bool) -> None:
    """Where it cannot stop any more before the band ahead, the plan is not what is wrong."""
    brake_mps2 = float(WORLD.braking.service_mps2[1])
    overlapping = ((1400.0, 1700.0), (400.0, 1450.0))
    # From its report it would stop 5 m before the end of its band, the margin counted.
    speed_mps = np.array([0.0, np.sqrt(2.0 * brake_mps2 * (1445.0 - MARGIN_M - FRONTS_M[1]))])
    told = may_be_sent(bands_m=overlapping, speed_mps=speed_mps, known_s=np.full(2, NOW_S - age_s))
    assert told is sent
