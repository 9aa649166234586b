"""Two trains at one platform: what the stochastic approach does, and what it cannot know."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from kankaku.controllers import registry
from kankaku.controllers.options import OptionError
from kankaku.controllers.stochastic import waiting
from kankaku.controllers.stochastic.approach_options import StochasticApproachOptions
from kankaku.controllers.stochastic.approach_site import MeetingCalls, PlatformSite, approach_site
from kankaku.controllers.stochastic.belief import Belief
from kankaku.controllers.stochastic.run_in import Costs, run_in
from kankaku.controllers.stochastic.waiting import make_tables
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.dwell import DwellDelays, Overstay
from kankaku.railway.plan.scenario import ControllerSpec, Option, Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.records import RunRecord
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from kankaku.testing.trials import overstays
from tools.plain_runs import run_plain

EXPECTED = DwellDelays((0.0, 0.5, 1.0), (0.0, 20.0, 120.0))
COSTS = Costs(0.3, 0.02)
CAPS_MPS = np.array([1000.0, 22.0, 18.0, 14.0, 10.0, 6.0])
EAST = 1


def close_trains(trains: int = 2) -> Scenario:
    """Return trains so close that each has to wait when the one before overstays."""
    return two_station_scenario(
        trains, headway_s=95.0, spacing_m=1800.0, run_s=130.0, delays=EXPECTED
    )


def run_of(
    scenario: Scenario,
    operation: str,
    delay_s: FloatArray,
    options: Mapping[str, Option] | None = None,
    protection: str = "moving_block",
) -> RunRecord:
    """Run an operation over a protection."""
    spec = ControllerSpec(operation, protection, operation, {}, options or {})
    return run_plain(scenario, world_of(scenario), spec, delay_s)


def delays_of(scenario: Scenario, *east_s: float) -> FloatArray:
    """Return overstays at the second station, first train first."""
    delay_s = np.zeros_like(overstays(scenario, 0.0))
    delay_s[: len(east_s), EAST] = east_s
    return delay_s


def stands_s(record: RunRecord) -> float:
    """Return how long trains stand between stations."""
    return float(record.standstills.duration_s.sum())


def path_of(record: RunRecord, row: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return time, place and speed of a train, second by second."""
    way = record.trajectory
    of_it = way.row == row
    return way.time_s[of_it], way.front_m[of_it], way.speed_mps[of_it]


def site_of(scenario: Scenario) -> tuple[World, PlatformSite]:
    """Return the site of the second train behind the first one."""
    world = world_of(scenario)
    spec = ControllerSpec("close_up", "moving_block", "close_up", {}, {})
    protection: Any = registry.build(spec, world).protection
    site = approach_site(world, protection, 1, MeetingCalls(EAST, 0, EAST))
    assert site is not None
    return world, site


def test_running_in_takes_as_long_as_a_run_says() -> None:
    scenario = close_trains()
    record = run_of(scenario, "close_up", delays_of(scenario, 40.0))
    _, site = site_of(scenario)
    released_s = float(record.departure_s[0, EAST])
    time_s, front_m, speed_mps = path_of(record, 1)
    motion = (
        float(np.interp(released_s, time_s, front_m)),
        float(np.interp(released_s, time_s, speed_mps)),
    )
    interval_s, cost_s, peak_mps = run_in(site, motion, 1000.0, Costs(0.0, 0.0), np.inf)
    assert cost_s == interval_s
    assert peak_mps < 25.0
    assert interval_s == pytest.approx(record.arrival_s[1, EAST] - released_s, abs=1.0)


def test_costs_to_come_keep_the_principle_of_optimality() -> None:
    """By an interpolation and a minimum of its own, at random nodes."""
    _, site = site_of(close_trains())
    belief = Belief(EXPECTED)
    tables = make_tables(site, belief, 1.0, COSTS, (CAPS_MPS, waiting.times_of(belief, 1.0)))
    places, shares = np.arange(waiting.DISTANCES), np.arange(waiting.SHARES)
    after = tables.before[waiting.CERTAIN, 0]
    rng = np.random.default_rng(7)
    for _ in range(60):
        level, time = int(rng.integers(3)), int(rng.integers(tables.during.shape[1] - 1))
        row, column = int(rng.integers(waiting.DISTANCES)), int(rng.integers(waiting.SHARES))
        hazard = tables.hazards[level, time]
        mixed = hazard * after + (1.0 - hazard) * tables.during[level, time + 1]
        to_come = RegularGridInterpolator((places, shares), mixed)
        distance_m = waiting.distance_m_at(site.approach, row)
        motion = distance_m, tables.top_mps[row] * column / (waiting.SHARES - 1)
        costs = []
        for action in range(waiting.ACTIONS):
            to = waiting.look_ahead(site.approach, tables.top_mps, motion, action, COSTS)
            costs.append(to[2] + to_come(to[:2]).item())
        assert tables.during[level, time, row, column] == pytest.approx(min(costs), abs=1e-3)


def test_whoever_knows_the_departure_loses_nothing_and_does_not_stop() -> None:
    scenario = close_trains(4)
    delay_s = delays_of(scenario, 110.0, 60.0, 80.0)
    hindered = run_of(scenario, "close_up", delay_s)
    told = run_of(scenario, "clairvoyant", delay_s)
    assert stands_s(hindered) > 60.0
    assert stands_s(told) == 0.0
    assert told.arrival_s[:, EAST] == pytest.approx(hindered.arrival_s[:, EAST], abs=0.6)
    assert told.energy.traction_j.sum() < hindered.energy.traction_j.sum()


def test_who_does_not_know_it_stops_less_and_loses_little() -> None:
    scenario = close_trains(4)
    delay_s = delays_of(scenario, 80.0, 50.0, 60.0)
    hindered = run_of(scenario, "close_up", delay_s)
    planned = run_of(scenario, "stochastic_approach", delay_s)
    stopped_s = stands_s(hindered)
    assert stands_s(planned) < 0.2 * stopped_s
    late_s = planned.arrival_s[:, EAST] - hindered.arrival_s[:, EAST]
    assert late_s.max() < 3.0


def test_the_more_standing_costs_the_slower_is_the_approach() -> None:
    scenario = close_trains()
    delay_s = delays_of(scenario, 35.0)
    arrivals_s = [
        run_of(scenario, "stochastic_approach", delay_s, {"standing_cost": cost}).arrival_s[1, EAST]
        for cost in (0.0, 0.3, 10.0)
    ]
    assert arrivals_s[0] <= arrivals_s[1] + 0.5 <= arrivals_s[2] + 0.5
    assert arrivals_s[2] > arrivals_s[0] + 0.5


@pytest.mark.parametrize("learns", [False, True])
def test_nobody_acts_on_a_delay_before_it_has_begun(learns: bool) -> None:
    scenario = close_trains(3)
    runs = [
        run_of(scenario, "stochastic_approach", delays_of(scenario, *east_s), {"learns": learns})
        for east_s in ((20.0, 0.0), (20.0, 90.0), (70.0, 90.0))
    ]
    for one, other, row in ((runs[0], runs[1], 1), (runs[1], runs[2], 0)):
        until_s = min(one.departure_s[row, EAST], other.departure_s[row, EAST])
        same = one.trajectory.time_s < until_s
        assert same.sum() > 200
        count = int(same.sum())
        assert (one.trajectory.speed_mps[:count] == other.trajectory.speed_mps[:count]).all()


def test_who_goes_second_through_points_stays_at_its_platform_and_loses_nothing() -> None:
    """The first train overstays by 100 s on the other track; its points are 40 m ahead."""
    scenario = merge_scenario(2, headway_s=60.0, dwell_s=30.0)
    delay_s = np.zeros_like(overstays(scenario, 0.0))
    delay_s[0, 0] = 100.0
    hindered = run_of(scenario, "close_up", delay_s)
    stays = run_of(scenario, "stochastic_approach", delay_s)
    assert not stays.violations
    assert stands_s(hindered) > 30.0
    assert stands_s(stays) == 0.0
    assert stays.departure_s[1, 0] > hindered.departure_s[1, 0] + 30.0
    assert stays.arrival_s[1, EAST] == pytest.approx(hindered.arrival_s[1, EAST], abs=4.0)


def test_named_overstays_are_not_expected() -> None:
    scenario = close_trains()
    named = replace(EXPECTED, overstays=(Overstay("T1", "east", 300.0),))
    world = world_of(replace(scenario, dwell_delays=named))
    assert world.expected_delays == EXPECTED
    assert world.foretold_delay_s is None


def test_delays_that_were_seen_change_what_is_expected() -> None:
    scenario = close_trains(12)
    delay_s = delays_of(scenario, *([110.0] * 11))
    learned, steadfast = (
        run_of(scenario, "stochastic_approach", delay_s, {"learns": learns})
        for learns in (True, False)
    )
    paths = [[path_of(record, row) for record in (learned, steadfast)] for row in range(12)]
    apart_m = [np.abs(np.interp(one[0], other[0], other[1]) - one[1]).max() for one, other in paths]
    # The first follower has seen no delay yet, the last one ten.
    assert apart_m[1] < 1e-6
    assert apart_m[11] > 5.0
    assert stands_s(learned) <= stands_s(steadfast)


def test_what_it_is_told_is_what_it_expects() -> None:
    told = StochasticApproachOptions(
        told_scale=2.0, told_cap_s=50.0, told_levels=(0.0, 1.0), told_delays_s=(0.0, 30.0)
    ).told(EXPECTED)
    assert (told.levels, told.delays_s) == ((0.0, 1.0), (0.0, 30.0))
    assert (told.scale, told.cap_s) == (2.0, 50.0)
    assert StochasticApproachOptions().told(EXPECTED) == EXPECTED


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"standing_cost": -1.0}, "standing_cost is -1"),
        ({"told_levels": (0.0, 1.0)}, "told_levels has 2 values, told_delays_s 0"),
        ({"told_levels": (0.1, 1.0), "told_delays_s": (0.0, 1.0)}, "no distribution"),
        ({"told_levels": (0.0, 1.0), "told_delays_s": (9.0, 1.0)}, "no distribution"),
    ],
)
def test_options_without_meaning_are_refused(options: dict[str, Any], problem: str) -> None:
    with pytest.raises(OptionError, match=problem):
        StochasticApproachOptions(**options)


@pytest.mark.parametrize(
    ("protection", "options"),
    [("moving_block", {"exclusive_platform": True}), ("relative_braking", {})],
)
def test_over_other_protections_trains_stop_less_too(
    protection: str, options: dict[str, Option]
) -> None:
    scenario = close_trains(3)
    delay_s = delays_of(scenario, 80.0, 60.0)
    stopped_s = {}
    for operation in ("close_up", "stochastic_approach"):
        spec = ControllerSpec(operation, protection, operation, options, {})
        record = run_plain(scenario, world_of(scenario), spec, delay_s)
        assert not record.violations
        stopped_s[operation] = stands_s(record)
    assert stopped_s["stochastic_approach"] < 0.5 * stopped_s["close_up"]
