"""Ensembles whose seeds share draws: their bytes, intervals and stops; designs are not mixed."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from kankaku.analysis.figures.ensemble_figures import running_mean_figure
from kankaku.analysis.tables.across_tables import across_frame
from kankaku.analysis.tables.compare import half_width
from kankaku.analysis.tables.ensemble_tables import study_frame
from kankaku.railway.plan.design_names import ANTITHETIC, LATIN_HYPERCUBE
from kankaku.railway.plan.seed_design import seed_design
from kankaku.store import ensemble_plan
from kankaku.store.ensemble_plan import EnsembleError, read_plan
from kankaku.studies import dataset
from kankaku.studies.ensemble import choose_ensemble
from kankaku.studies.ensemble_merging import merge
from tests.cli.command import contents, two_controllers
from tests.unit.ensemble_helpers import TABLES_ALONE, run_some
from tests.unit.test_ensemble_tables import both

STOPS = "interstation_stop_time_s"
MIRRORED = {"draws": ANTITHETIC}


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return two_controllers(tmp_path_factory.mktemp("scenarios") / "small")


@pytest.fixture(scope="module")
def pairs(scenario: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the results of two mirrored pairs of seeds."""
    out = tmp_path_factory.mktemp("pairs") / "out"
    assert run_some(scenario, out, wanted=MIRRORED, seeds=4).performed == 8
    return out


def test_jobs_and_parts_give_the_same_bytes(scenario: Path, pairs: Path, tmp_path: Path) -> None:
    run_some(scenario, tmp_path / "jobs", wanted=MIRRORED, seeds=4, jobs=2)
    assert contents(tmp_path / "jobs") == contents(pairs)
    parts = [tmp_path / number for number in ("1", "2", "3")]
    for part in parts:
        run_some(scenario, part, wanted={**MIRRORED, "shard": f"{part.name}/3"}, seeds=4)
    merge(tmp_path / "merged", parts, TABLES_ALONE)
    assert contents(tmp_path / "merged") == contents(pairs)


def test_more_pairs_go_on_from_those_that_are_there(
    scenario: Path, pairs: Path, tmp_path: Path
) -> None:
    assert run_some(scenario, tmp_path / "out", wanted=MIRRORED, seeds=2).performed == 4
    assert run_some(scenario, tmp_path / "out", wanted=MIRRORED, seeds=4).performed == 4
    assert contents(tmp_path / "out") == contents(pairs)


def test_the_first_of_a_pair_is_the_run_of_an_independent_seed(
    scenario: Path, pairs: Path, tmp_path: Path
) -> None:
    alone = dataset.read(run_some(scenario, tmp_path / "out", seeds=4).folder)
    paired = dataset.read(pairs)
    same = (alone == paired)["energy_net_kwh"]
    assert same[paired["seed"] % 2 == 1].all()
    assert not same[paired["seed"] % 2 == 0].any()
    # What a plan without a choice holds has not changed.
    assert "draws" not in json.loads((tmp_path / "out" / "plan.json").read_text("utf-8"))
    assert "draws" not in json.loads((tmp_path / "out" / "study.json").read_text("utf-8"))
    assert read_plan(pairs).draws == ANTITHETIC
    assert json.loads((pairs / "study.json").read_text("utf-8"))["draws"] == ANTITHETIC


def test_designs_are_not_mixed(scenario: Path, pairs: Path, tmp_path: Path) -> None:
    before = contents(pairs)
    for wanted in ({}, {"draws": LATIN_HYPERCUBE}):
        with pytest.raises(EnsembleError, match=r"runs of something else \(draws\b"):
            run_some(scenario, pairs, wanted=wanted, seeds=10)
    with pytest.raises(EnsembleError, match="first seed of a replicate"):
        run_some(scenario, pairs, wanted=MIRRORED, seed=8, seeds=4)
    other = two_controllers(tmp_path / "another")
    with pytest.raises(EnsembleError, match=r"runs of something else \(draws\)"):
        run_some(other, pairs, seeds=2)
    assert contents(pairs) == before
    out = tmp_path / "out"
    run_some(scenario, out, seeds=2)
    with pytest.raises(EnsembleError, match=r"\(draws, first seed of a replicate\)"):
        run_some(scenario, out, wanted=MIRRORED, seeds=2)
    assert run_some(scenario, out, wanted=MIRRORED, seeds=4, fresh=True).performed == 8
    assert contents(out) == before


def test_parts_of_different_designs_are_not_put_together(scenario: Path, tmp_path: Path) -> None:
    for number, draws in (("1", "independent"), ("2", ANTITHETIC)):
        wanted = {"shard": f"{number}/2", "draws": draws}
        run_some(scenario, tmp_path / number, wanted=wanted, seeds=2)
    with pytest.raises(EnsembleError, match=r"is no part of the study in .*\(draws"):
        merge(tmp_path / "merged", [tmp_path / "1", tmp_path / "2"])


def test_half_a_replicate_and_unknown_designs_are_refused(scenario: Path) -> None:
    with pytest.raises(EnsembleError, match=r"3 seeds .* \(antithetic\); allowed: a multiple of 2"):
        choose_ensemble([scenario], {"seeds": 3}, draws=ANTITHETIC)
    with pytest.raises(EnsembleError, match=r"allowed: .*latin_hypercube"):
        choose_ensemble([scenario], {"seeds": 20}, draws="sobol")


def test_intervals_are_over_pairs() -> None:
    runs = both((10.0, 5.0), (30.0, 11.0), (60.0, 20.0), (20.0, 30.0), (0.0, 0.0), (40.0, 8.0))
    design = seed_design(ANTITHETIC, 0)
    table = study_frame(runs, {"metro": design}, ["plain", "other"])
    row = table[(table["controller"] == "other") & (table["indicator"] == STOPS)].iloc[0]
    assert row["mean"] == pytest.approx(74.0 / 6.0)
    # Pairs 8, 25, 4; their differences to 20, 40, 20.
    assert row["mean_confidence_95"] == pytest.approx(half_width(np.array([8.0, 25.0, 4.0])))
    expected = half_width(np.array([-12.0, -15.0, -16.0]))
    assert row["confidence_95"] == pytest.approx(expected)
    # The spread of runs is that of runs.
    assert row["deviation"] == pytest.approx(np.std([5, 11, 20, 30, 0, 8], ddof=1))
    shown = across_frame({"metro": runs}, ["plain", "other"], designs={"metro": design}).iloc[1]
    assert shown["interstation_stop_time_confidence_95_s"] == pytest.approx(expected, abs=1e-3)
    lines = running_mean_figure(runs, ["plain", "other"], [STOPS], {"metro": design}).axes[0].lines
    assert np.asarray(lines[0].get_xdata()).tolist() == [2, 4, 6]
    assert np.asarray(lines[0].get_ydata()).tolist() == pytest.approx([20.0, 30.0, 80.0 / 3.0])


@pytest.mark.parametrize(
    ("draws", "first", "every"), [(ANTITHETIC, 20, 10), (LATIN_HYPERCUBE, 100, 50)]
)
def test_nobody_looks_at_half_a_replicate_nor_at_few(
    scenario: Path, draws: str, first: int, every: int
) -> None:
    plan = choose_ensemble([scenario], {"seeds": 200}, draws=draws, until=f"{STOPS} ±1 %").plan
    assert [batch.stop for batch in plan.batches] == list(range(every, 201, every))
    calm = pd.DataFrame(
        {"scenario": "small", "controller": name, "seed": 7 + seed, STOPS: 100.0 + seed % 2}
        for seed in range(200)
        for name in ("plain", "second")
    )
    # Pairs and replicates all have one mean, though runs have not.
    assert set(plan.halves(calm, 200).values()) == {0.0}
    assert plan.seeds_used(calm) == first


def test_a_study_in_pairs_stops_at_a_whole_pair(
    scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ensemble_plan, "LOOK_EVERY", 3)
    monkeypatch.setattr(ensemble_plan, "LEAST_REPLICATES", 1)
    wanted = {**MIRRORED, "until": f"{STOPS} +-60 s"}
    result = run_some(scenario, tmp_path / "out", wanted=wanted, seeds=24)
    assert result.findings is not None
    told = result.findings.told
    assert told["until"]["reached"]
    assert told["seeds"] in range(8, 24, 4)
    assert result.performed == 2 * told["seeds"]
    summary = result.findings.summary
    for row in told["until"]["half_widths"]:
        own = summary[summary["controller"] == row["controller"]][STOPS].to_numpy()
        assert row["half_width"] == pytest.approx(half_width((own[0::2] + own[1::2]) / 2.0))
