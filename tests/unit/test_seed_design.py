"""Seeds that share their draws: right alone, right together, and intervals that cover the mean."""

from collections.abc import Callable
from itertools import pairwise
from math import isnan

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import kstest, pearsonr

from kankaku.analysis.tables.compare import half_width
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.design_names import (
    ANTITHETIC,
    DESIGNS,
    INDEPENDENT,
    LATIN_HYPERCUBE,
    REPLICATE_SIZES,
)
from kankaku.railway.plan.dwell import DwellDelays
from kankaku.railway.plan.seed_design import EACH_FOR_ITSELF, SeedDesign, seed_design
from kankaku.railway.randomness import stream
from tests.unit.test_dwell import MEASURED, many, timetable

SHARED = (ANTITHETIC, LATIN_HYPERCUBE)


def ranks(design: SeedDesign, seeds: range, *keys: str) -> FloatArray:
    """Return u of each seed and key."""
    drawn = [[design.normal(seed, "test", key) for key in keys] for seed in seeds]
    found: FloatArray = np.asarray(ndtr(np.array(drawn)))
    return found


def test_independent_seeds_draw_from_their_streams() -> None:
    expected = [float(stream(seed, "test", "a").standard_normal()) for seed in range(5)]
    assert [EACH_FOR_ITSELF.normal(seed, "test", "a") for seed in range(5)] == expected


@pytest.mark.parametrize("first", [0, 1, 7])
def test_pairs_begin_with_the_first_seed_and_mirror_every_draw(first: int) -> None:
    design = seed_design(ANTITHETIC, first)
    u = ranks(design, range(first, first + 6), "a", "b")
    assert u[0::2] + u[1::2] == pytest.approx(np.ones((3, 2)), abs=1e-15)
    # The first of a pair draws what it draws alone; another pair draws something else.
    assert np.array_equal(u[0::2], ranks(EACH_FOR_ITSELF, range(first, first + 6, 2), "a", "b"))
    assert len(np.unique(u)) == u.size


def test_each_draw_falls_once_into_each_stratum() -> None:
    design = seed_design(LATIN_HYPERCUBE, 20260314)
    u = ranks(design, range(20260314, 20260334), "a", "b", "c")
    for replicate in (u[:10], u[10:]):
        assert np.sort(np.floor(10.0 * replicate), axis=0).tolist() == [
            [float(n)] * 3 for n in range(10)
        ]
    # Strata of different draws and replicates are dealt out separately.
    orders = {
        tuple(order) for order in np.floor(10.0 * u.reshape(2, 10, 3)).swapaxes(1, 2).reshape(6, 10)
    }
    assert len(orders) == 6


@pytest.mark.parametrize("name", SHARED)
def test_a_single_seed_draws_the_same_distribution_as_ever(name: str) -> None:
    size = REPLICATE_SIZES[name]
    for place in (0, size - 1):
        u = ranks(SeedDesign(name), range(place, 1000 * size, size), "a", "b")
        assert kstest(u[:, 0], "uniform").pvalue > 1e-3
        # Two draws of one seed hang together in no design; four standard errors.
        assert abs(pearsonr(u[:, 0], u[:, 1]).statistic) < 4.0 / np.sqrt(1000)


@pytest.mark.parametrize("name", DESIGNS)
def test_draws_depend_on_seed_and_key_alone_in_whatever_order(name: str) -> None:
    design = seed_design(name, 3)
    asked = [(seed, key) for seed in range(3, 23) for key in ("a", "b")]
    forth = {one: design.normal(one[0], one[1]) for one in asked}
    back = {one: seed_design(name, 23).normal(one[0], one[1]) for one in reversed(asked)}
    assert forth == back


@pytest.mark.parametrize("name", DESIGNS)
@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_dwells_of_a_train_are_the_same_whoever_else_runs(name: str, correlation: float) -> None:
    delays = DwellDelays(
        MEASURED.levels, MEASURED.delays_s, trip_correlation=correlation, design=SeedDesign(name)
    )
    alone = delays.draw(timetable(["X"]), 7)
    assert np.array_equal(alone[0], delays.draw(timetable(["A", "X", "B"]), 7)[1])


def test_where_one_of_a_pair_stays_long_the_other_does_not() -> None:
    delays = DwellDelays(
        (0.0, 1.0), (0.0, 1000.0), trip_correlation=0.4, design=SeedDesign(ANTITHETIC)
    )
    one, other = (delays.draw(timetable(many(20)), seed) for seed in (4, 5))
    # Ranks are mirrored all along a trip; each delay is rounded to a second.
    assert one + other == pytest.approx(np.full_like(one, 1000.0), abs=1.0)


def replicate_spread(
    design: SeedDesign, of: Callable[[FloatArray], FloatArray], replicates: int
) -> float:
    """Return the variance of the means of replicates."""
    seeds = range(replicates * design.size)
    means = design.replicate_means(of(ranks(design, seeds, "a")[:, 0]), np.array(seeds))
    assert means.size == replicates
    return float(means.var(ddof=1))


@pytest.mark.parametrize(
    ("name", "of", "expected"),
    [
        # Var(u^2) = 4/45, of pairs that are mirrored Var((u^2 + (1-u)^2) / 2) = 1/180.
        (INDEPENDENT, np.square, 4.0 / 45.0),
        (ANTITHETIC, np.square, 1.0 / 180.0),
        # One uniform draw in each of m strata: m / (12 m^2) / m^2.
        (LATIN_HYPERCUBE, np.asarray, 1.0 / (12.0 * 10.0**3)),
    ],
)
def test_the_spread_of_replicates_is_that_of_the_closed_form(
    name: str, of: Callable[[FloatArray], FloatArray], expected: float
) -> None:
    # Four standard errors of a variance; kurtosis of all three is below 3 + 1.2.
    replicates = 1500
    error = 4.0 * np.sqrt(3.2 / replicates)
    assert replicate_spread(SeedDesign(name), of, replicates) == pytest.approx(expected, rel=error)


def test_what_is_even_gains_nothing_from_mirroring() -> None:
    def even(u: FloatArray) -> FloatArray:
        return np.abs(u - 0.5)

    # Both of a pair give the same, so a pair is worth one run: Var |u - 1/2| = 1/48.
    assert replicate_spread(SeedDesign(ANTITHETIC), even, 1500) == pytest.approx(1 / 48, rel=0.15)


@pytest.mark.parametrize("name", DESIGNS)
def test_intervals_over_replicates_cover_the_true_mean(name: str) -> None:
    # Additive and interacting, far from even, with a mean in closed form.
    seeds, studies, true = 60, 400, 1.0 / 3.0 + 1.0 / 4.0
    design = SeedDesign(name)
    all_seeds = range(seeds * studies)
    u = ranks(design, all_seeds, "a", "b")
    values = u[:, 0] ** 2 + u[:, 0] * u[:, 1]
    inside = naive = 0
    for own in np.split(np.array(all_seeds), studies):
        means = design.replicate_means(values[own], own)
        assert means.size == seeds // design.size
        assert means.mean() == pytest.approx(values[own].mean())
        error = abs(values[own].mean() - true)
        inside += error <= half_width(means)
        naive += error <= half_width(values[own])
    # Three standard errors of a share of 400.
    assert inside / studies == pytest.approx(0.95, abs=0.033)
    # As if seeds were independent, intervals of replicates would be far too wide.
    assert naive == inside if name == INDEPENDENT else naive == studies


def test_replicates_that_are_not_whole_do_not_count() -> None:
    pairs = seed_design(ANTITHETIC, 1)
    seeds = np.array([6, 1, 5, 3, 2, 8, 7])
    values = np.array([60.0, 10.0, 50.0, 30.0, 20.0, np.nan, 70.0])
    means = pairs.replicate_means(values, seeds)
    assert means[:2].tolist() == [15.0, 55.0]
    assert isnan(means[2])
    assert means.size == 3
    assert EACH_FOR_ITSELF.replicate_means(values, seeds) is values


@pytest.mark.parametrize("name", DESIGNS)
def test_designs_that_cut_seeds_alike_are_equal(name: str) -> None:
    size = REPLICATE_SIZES[name]
    assert seed_design(name, 7) == seed_design(name, 7 + size)
    numbers = seed_design(name, 7).replicates(np.arange(7, 7 + 3 * size))
    assert numbers.tolist() == np.repeat(numbers[::size], size).tolist()
    assert all(two == one + 1 for one, two in pairwise(numbers[::size]))
