"""The score: a gate first, then ratios to the reference, whatever the units."""

import math

import pytest

from kankaku.studies.benchmark_score import MEASURES, STOPS, WEIGHTS, gain, scores
from kankaku.studies.benchmark_suites import REFERENCE, USUAL, WORLDS
from tests.unit.benchmark_rows import OWN, changed, rows

SCORED = tuple(WORLDS)


def test_the_weights_add_up_to_one() -> None:
    assert math.fsum(WEIGHTS.values()) == pytest.approx(1.0)


def test_who_runs_like_the_reference_has_a_hundred_in_every_part() -> None:
    found = scores(rows(), {})
    for score in found.values():
        assert score.score == 100.0
        assert (score.low, score.high) == (100.0, 100.0)
        assert set(score.parts) == set(WEIGHTS)
        assert set(score.parts.values()) == {100.0}


def test_less_delay_in_every_world_counts_for_delay_and_robustness_alone() -> None:
    better = changed(rows(), OWN, mean_arrival_lateness_s=20.0)
    own = scores(better, {})[OWN]
    ratio = (40.0 + 10.0) / (20.0 + 10.0)
    assert own.parts["delay"] == pytest.approx(100.0 * ratio, abs=1e-3)
    assert own.parts["robustness"] == pytest.approx(100.0 * math.sqrt(ratio), abs=1e-3)
    assert own.parts["stops"] == own.parts["energy"] == own.parts["computing"] == 100.0
    weight = WEIGHTS["delay"] + 0.5 * WEIGHTS["robustness"]
    assert own.score == pytest.approx(100.0 * ratio**weight, abs=1e-3)


def test_robustness_is_the_worse_of_the_other_worlds() -> None:
    worse = changed(rows(), OWN, world=SCORED[-1], interstation_stop_time_s=2000.0)
    own = scores(worse, {})[OWN]
    assert own.parts["stops"] == 100.0
    assert own.parts["robustness"] < 100.0
    better = changed(rows(), OWN, world=SCORED[-1], interstation_stop_time_s=0.0)
    assert scores(better, {})[OWN].parts["robustness"] == 100.0


def test_nobody_gains_by_computing_and_one_slow_run_counts_for_nothing() -> None:
    assert scores(changed(rows(), OWN, processor_s=0.001), {})[OWN].parts["computing"] == 100.0
    assert scores(changed(rows(), OWN, processor_s=100.0), {})[OWN].parts["computing"] < 20.0
    first = changed(rows(), OWN, world=USUAL, seed=1, processor_s=100.0)
    assert scores(first, {})[OWN].parts["computing"] == 100.0


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"violations": 1}, "1 violations of safety"),
        ({"failure": "KeyError: 3"}, "KeyError: 3"),
        ({"trains_completed": 8}, "2 trains never arrive"),
    ],
)
def test_one_run_that_is_unsafe_or_has_no_end_closes_the_gate(
    change: dict[str, object], told: str
) -> None:
    found = scores(changed(rows(), OWN, world=USUAL, seed=2, **change), {})
    assert found[OWN].score is None
    assert not found[OWN].parts
    assert found[OWN].refused == (f"branch, usual, seed 2: {told}",)
    assert found[REFERENCE].score == 100.0


def test_who_breaks_the_contract_has_no_score() -> None:
    found = scores(rows(), {OWN: ["the future is not read: it is"]})
    assert found[OWN].refused == ("the future is not read: it is",)


def test_without_a_reference_that_is_safe_nobody_has_a_score() -> None:
    found = scores(changed(rows(), REFERENCE, violations=1), {})
    assert found[OWN].score is None
    assert REFERENCE in found[OWN].refused[0]


def test_a_part_of_the_benchmark_is_scored_by_the_parts_it_has() -> None:
    only = [run for run in rows() if run["world"] == USUAL and run["seed"] == 1]
    own = scores(changed(only, OWN, energy_net_kwh=500.0), {})[OWN]
    assert "robustness" not in own.parts
    assert own.low is own.high is None
    weight = WEIGHTS["energy"] / (1.0 - WEIGHTS["robustness"])
    ratio = (100.0 + 1.0) / (50.0 + 1.0)
    assert own.score == pytest.approx(100.0 * ratio**weight, abs=1e-3)


def test_next_to_nothing_is_not_divided_by() -> None:
    assert gain(MEASURES[STOPS], 0.0, 0.0) == 0.0
    assert gain(MEASURES[STOPS], 0.0, 5.0) == pytest.approx(math.log(2.0))
