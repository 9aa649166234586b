"""Takaoka et al. 1991, fig. 2: ATD shortens the headway by 21 s; the layout is not published."""

from pathlib import Path

import numpy as np
import pytest

from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.records import RunRecord
from kankaku.scenarios.loading.load import load
from kankaku.studies import study

FOLDER = Path(__file__).parents[2] / "scenarios" / "atd_headway"
PUBLISHED_S = 21.0
HELD_S = 120.0
"""After so long an overstay the follower has come to a stand under both systems. [s]"""


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load(FOLDER)


@pytest.fixture(scope="module")
def held(scenario: Scenario) -> dict[str, RunRecord]:
    late = scenario.with_initial_delay(HELD_S)
    return {
        spec.name: study.run_once(late, spec, scenario.seed, scenario.step_s)
        for spec in scenario.controllers
    }


def interval_s(record: RunRecord) -> float:
    """From the leader's departure to the follower's arrival at station 2."""
    return float(record.arrival_s[1, 1] - record.departure_s[0, 1])


def test_a_held_follower_arrives_about_as_much_sooner_as_published(
    held: dict[str, RunRecord],
) -> None:
    shortened_s = interval_s(held["atc"]) - interval_s(held["atd"])
    assert shortened_s >= 15.0
    assert shortened_s == pytest.approx(PUBLISHED_S, abs=3.0)
    assert all(record.violations == () for record in held.values())


def test_both_systems_have_the_same_blocks_and_idle_time(scenario: Scenario) -> None:
    atc, atd = (spec.protection_options for spec in scenario.controllers)
    assert atc["idle_time_s"] == atd["idle_time_s"]
    assert atc["overlap_m"] == atd["overlap_m"]


def test_atc_brakes_in_steps_and_atd_once(held: dict[str, RunRecord]) -> None:
    released = {}
    for name, record in held.items():
        seen = record.trajectory
        own = (seen.row == 1) & (seen.front_m > 500.0)
        speed_mps, front_m = seen.speed_mps[own], seen.front_m[own]
        first_stand = int(np.flatnonzero((speed_mps <= 0.0) & (front_m < 1_999.0))[0])
        slower = np.diff(speed_mps[: first_stand + 1]) < -0.1
        released[name] = int(np.count_nonzero(np.diff(slower.astype(int)) == -1))
    assert released["atd"] == 0
    assert released["atc"] >= 2
