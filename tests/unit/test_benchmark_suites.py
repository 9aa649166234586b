"""What the benchmark runs is fixed, and each world of delays is what it says."""

import numpy as np
import pytest

from kankaku.controllers.choosing import by_layers
from kankaku.controllers.registry import build
from kankaku.railway.plan.dwell import DwellDelays
from kankaku.studies.benchmark_suites import (
    SEEDS,
    SUITES,
    USUAL,
    WORLDS,
    BenchmarkPlan,
    BenchmarkTask,
    heavy_tailed,
    met_scenario,
    suite_scenario,
    tasks_of,
)
from kankaku.studies.study import world_of

DELAYS = DwellDelays((0.0, 0.5, 0.9, 0.95, 1.0), (0.0, 5.0, 20.0, 25.0, 60.0), 1.5, 120.0, 0.3)


def test_a_heavy_tail_is_nowhere_shorter_and_the_same_below_it() -> None:
    heavy = heavy_tailed(DELAYS)
    levels = np.linspace(0.0, 1.0, 201)
    usual_s = np.interp(levels, DELAYS.levels, DELAYS.delays_s)
    heavy_s = np.interp(levels, heavy.levels, heavy.delays_s)
    assert (heavy_s >= usual_s - 1e-9).all()
    below = levels <= 0.9
    np.testing.assert_allclose(heavy_s[below], usual_s[below])
    assert np.interp(0.99, heavy.levels, heavy.delays_s) == pytest.approx(20.0 * 10.0 ** (2 / 3))
    assert list(heavy.delays_s) == sorted(heavy.delays_s)
    assert heavy.cap_s == 300.0


def test_planners_are_told_what_is_so_but_in_one_world() -> None:
    told = {}
    for name in WORLDS:
        scenario = met_scenario(BenchmarkTask("", "branch", name, SEEDS[0]))
        told[name] = world_of(scenario, 0.5).expected_delays == scenario.dwell_delays
    assert told == {"usual": True, "heavy_tailed": True, "wrong_distribution": False}
    usual = met_scenario(BenchmarkTask("", "branch", USUAL, SEEDS[0]))
    wrong = met_scenario(BenchmarkTask("", "branch", "wrong_distribution", SEEDS[0]))
    assert world_of(wrong, 0.5).expected_delays == usual.dwell_delays
    drawn_s = [it.dwell_delays.draw(it.timetable, 9001).sum() for it in (usual, wrong)]
    assert drawn_s[1] > 1.5 * drawn_s[0] > 0.0


@pytest.mark.parametrize("suite", SUITES)
def test_trains_of_every_suite_overstay(suite: str) -> None:
    scenario = suite_scenario(suite)
    assert scenario.dwell_delays.draw(scenario.timetable, SEEDS[0]).sum() > 0.0


@pytest.mark.parametrize("suite", SUITES)
def test_fixed_blocks_have_what_they_need_in_every_suite(suite: str) -> None:
    scenario = suite_scenario(suite)
    for name in ("multi_step_atc", "atd", "digital_atc"):
        build(by_layers(name), world_of(scenario, 0.5), scenario.radio)


def test_the_whole_line_is_cut_to_a_window_and_no_stock_leads_out_of_it() -> None:
    services = suite_scenario("whole_line").timetable.services
    names = {service.train for service in services}
    assert 10 < len(names) < 60
    assert all(service.next_train in {"", *names} for service in services)
    assert any(service.next_train for service in services) or len(names) == len(services)


def test_the_plan_is_the_whole_only_with_all_of_it() -> None:
    assert BenchmarkPlan().is_whole
    assert not BenchmarkPlan(seeds=SEEDS[:2]).is_whole
    assert len(set(tasks_of(("a", "b"), BenchmarkPlan()))) == 2 * 5 * 3 * 5
