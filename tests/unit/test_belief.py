"""What is believed of a dwell delay that goes on, against closed forms."""

import numpy as np
import pytest
from scipy.special import ndtr

from kankaku.controllers.stochastic.belief import LEAST_HAZARD_PS, SCORES, Belief
from kankaku.railway.plan.dwell import NO_DELAYS, DwellDelays

EVENLY = DwellDelays((0.0, 1.0), (0.0, 60.0))
HALF_OF_THEM = DwellDelays((0.0, 0.5, 1.0), (0.0, 0.0, 60.0), trip_correlation=0.5)


def test_the_distribution_is_the_inverse_of_its_quantiles() -> None:
    delays_s = np.array([-1.0, 0.0, 15.0, 30.0, 60.0, 90.0])
    assert Belief(EVENLY).cumulative(delays_s).tolist() == [0.0, 0.0, 0.25, 0.5, 1.0, 1.0]
    assert Belief(EVENLY).cumulative(np.array([30.0]), 2.0)[0] == pytest.approx(0.25)


def test_nothing_is_longer_than_the_cap() -> None:
    capped = Belief(DwellDelays((0.0, 1.0), (0.0, 60.0), cap_s=40.0))
    assert capped.cumulative(np.array([39.0, 40.0])).tolist() == [0.65, 1.0]


def test_the_hazard_of_an_even_distribution_rises_as_what_is_left_shrinks() -> None:
    left_s = 59.5 - 2.0 * np.arange(29)
    assert Belief(EVENLY).hazards(1.0, 2.0, 29) == pytest.approx(2.0 / left_s)


def test_beyond_the_longest_delay_a_least_hazard_is_left() -> None:
    assert Belief(EVENLY).hazards(1.0, 2.0, 40)[31:] == pytest.approx(2.0 * LEAST_HAZARD_PS)
    assert Belief(NO_DELAYS).hazards(1.0, 2.0, 5) == pytest.approx(2.0 * LEAST_HAZARD_PS)


def test_delays_that_are_rounded_to_nothing_are_none() -> None:
    assert Belief(HALF_OF_THEM).none(1.0) == pytest.approx(0.5 + 0.5 * 0.5 / 60.0)
    assert Belief(NO_DELAYS).none(1.0) == 1.0


def test_the_mean_excess_of_an_even_distribution_is_a_parabola() -> None:
    slack_s = np.arange(60)
    excess_s = Belief(EVENLY).excess_s(1.0)[slack_s]
    assert excess_s == pytest.approx((60.0 - slack_s) ** 2 / 120.0, abs=0.6)
    assert Belief(EVENLY).mean_s == pytest.approx(30.0, abs=0.6)


def test_the_score_of_a_delay_is_the_one_that_draws_it() -> None:
    belief = Belief(EVENLY)
    for delay_s in (3.0, 30.0, 57.0):
        assert ndtr(belief.score(delay_s, 1.0)) == pytest.approx(delay_s / 60.0, abs=1e-9)
    assert belief.score(60.0, 2.0) == pytest.approx(0.0, abs=1e-9)


def test_after_a_long_delay_the_next_one_of_the_trip_is_longer() -> None:
    belief = Belief(HALF_OF_THEM)
    factors = np.array([belief.after_score(score) for score in SCORES])
    assert (np.diff(factors) > 0.0).all()
    # In the mean over all that may come before, nothing is gained or lost.
    weights = np.exp(-0.5 * SCORES**2)
    assert np.average(factors, weights=weights) == pytest.approx(1.0, abs=0.01)


def test_without_correlation_the_delay_before_says_nothing() -> None:
    assert Belief(EVENLY).after_score(3.0) == pytest.approx(1.0, abs=1e-3)
    assert Belief(NO_DELAYS).after_score(3.0) == 1.0
