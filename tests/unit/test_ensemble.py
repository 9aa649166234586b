"""Ensembles: the same bytes however they are made, nothing twice, and what is refused."""

from functools import partial
from pathlib import Path

import pandas as pd
import pytest

from kankaku.railway.step.engine_ways import EVERY_STEP, WITNESS
from kankaku.store import ensemble_plan
from kankaku.store.dataset_store import MAIN, files_of
from kankaku.store.ensemble_plan import EnsembleError, read_plan
from kankaku.store.holding import HeldError, held, held_part
from kankaku.studies import dataset
from kankaku.studies.ensemble import choose_ensemble, shard_of
from kankaku.studies.ensemble_findings import Drawing
from kankaku.studies.ensemble_merging import merge
from kankaku.studies.ensemble_running import Crew, crew_of
from tests.cli.command import contents, two_controllers
from tests.unit.ensemble_helpers import MORE, TABLES_ALONE, Dying, run_some

RUNS = 6
"""Of three seeds and two controllers."""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return two_controllers(tmp_path_factory.mktemp("scenarios") / "small")


@pytest.fixture(scope="module")
def whole(scenario: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the results of an ensemble that nobody disturbed."""
    out = tmp_path_factory.mktemp("whole") / "out"
    assert run_some(scenario, out).performed == RUNS
    return out


def test_a_folder_holds_the_dataset_and_what_it_shows(whole: Path) -> None:
    names = {item.name for item in whole.iterdir()}
    tables = {"study.csv", "study.json", "columns.csv"}
    assert names == {"plan.json", "lines.json", "runs", *tables}
    tables = {item.name for item in (whole / "runs").iterdir()}
    assert tables == {"table=summary", "table=calls", "table=stops"}


@pytest.mark.parametrize("crew", ["processes", "dask"])
def test_whoever_does_the_runs_and_dies_the_bytes_are_the_same(
    scenario: Path, whole: Path, tmp_path: Path, crew: str
) -> None:
    who: Crew = crew_of(None)
    if crew == "dask":
        pytest.importorskip("distributed")
        who = crew_of("local")
    run = Dying(tmp_path / "died", seed=8)
    result = run_some(scenario, tmp_path / "out", run=run, crew=who, jobs=2)
    assert run.mark.exists()
    assert (result.performed, result.failed) == (RUNS, [])
    assert contents(tmp_path / "out") == contents(whole)


def test_parts_give_the_same_bytes_wherever_they_are_run(
    scenario: Path, whole: Path, tmp_path: Path
) -> None:
    apart, together = [], tmp_path / "together"
    for number in (1, 2):
        wanted = {"shard": f"{number}/2"}
        part = run_some(scenario, tmp_path / str(number), wanted=wanted)
        assert part.findings is None
        apart.append(part.folder)
        run_some(scenario, together, wanted=wanted)
    assert not merge(tmp_path / "merged", apart, TABLES_ALONE).missing
    assert not merge(together, [], TABLES_ALONE).missing
    assert contents(tmp_path / "merged") == contents(together) == contents(whole)


def test_what_is_whole_is_not_run_again_and_what_is_not_whole_is(
    scenario: Path, whole: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    run_some(scenario, out)
    assert run_some(scenario, out).performed == 0
    files = files_of(out / "runs", MAIN)
    # Killed before the last file of a run, while it was written by another program, and at the end.
    files[0].unlink()
    files[1].write_bytes(files[1].read_bytes()[:-5])
    calls = files_of(out / "runs", "calls")
    calls[2].write_bytes(calls[2].read_bytes()[:-5])
    (out / "study.csv").unlink()
    assert run_some(scenario, out).performed == 3
    assert contents(out) == contents(whole)


def test_runs_of_something_else_are_refused_or_replaced(
    scenario: Path, whole: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    run_some(scenario, out, step_s=0.25, seeds=1)
    with pytest.raises(EnsembleError, match=r"something else \(step\); allowed: --fresh"):
        run_some(scenario, out)
    assert run_some(scenario, out, fresh=True).performed == RUNS
    assert contents(out) == contents(whole)
    with pytest.raises(EnsembleError, match=r"something else \(options of the controller\)"):
        run_some(scenario, out, settings=["second.slowest_kmh=20"])


def test_a_folder_of_something_else_is_left_alone(scenario: Path, tmp_path: Path) -> None:
    (tmp_path / "letters").touch()
    with pytest.raises(FileExistsError, match="no study of many seeds"):
        run_some(scenario, tmp_path)
    with pytest.raises(EnsembleError, match=r"plan\.json"):
        read_plan(tmp_path)


def test_a_study_stops_by_itself_at_the_end_of_a_batch(
    scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ensemble_plan, "LOOK_EVERY", 2)
    wanted, out = {"until": "interstation_stop_time_s +-35 s"}, tmp_path / "out"
    result = run_some(scenario, out, wanted=wanted, seeds=20)
    assert result.findings is not None
    seeds = result.findings.told["seeds"]
    assert result.findings.told["until"]["reached"]
    assert seeds in range(4, 20, 2)
    assert result.performed == 2 * seeds
    assert set(result.findings.table["runs"]) == {seeds}
    assert run_some(scenario, out, wanted=wanted, seeds=20).performed == 0
    # Runs that are there already are no reason to look at them.
    before = contents(out)
    run_some(scenario, out, seeds=seeds + 1)
    run_some(scenario, out, wanted=wanted, seeds=20)
    told = {name: content for name, content in contents(out).items() if name in before}
    assert told == before


def test_one_engine_is_compared_with_the_other_by_the_first_seed(
    scenario: Path, tmp_path: Path
) -> None:
    result = run_some(scenario, tmp_path / "out", wanted={"engine": WITNESS}, seeds=2)
    assert result.performed == 2 * 2 + 2
    assert result.findings is not None
    told = result.findings.told["engines_compared"]
    assert told["largest_relative_difference"] == pytest.approx(MORE, rel=0.5)
    assert [row["controller"] for row in told["runs"]] == ["plain", "second"]
    # Those that were run for comparison are in no mean.
    assert set(result.findings.table["runs"]) == {2}
    assert len(dataset.read(result.folder)) == 4
    with pytest.raises(EnsembleError, match="engine"):
        run_some(scenario, result.folder)


def test_every_run_is_in_one_part(scenario: Path) -> None:
    choose = partial(choose_ensemble, [scenario], {"seeds": 50}, engine=EVERY_STEP)
    parts = [choose(shard=f"{number}/7").tasks for number in range(1, 8)]
    assert sorted(task for part in parts for task in part) == sorted(choose().tasks)
    assert {len(part) for part in parts} == {14, 15}
    # Not one controller alone, which would take longer than another one.
    assert all(len({task.controller for task in part}) == 2 for part in parts)


@pytest.mark.parametrize("text", ["0/3", "4/3", "3", "a/b", "1/0"])
def test_a_part_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(EnsembleError, match="is no part of several; allowed: 3/20"):
        shard_of(text)


def test_a_part_cannot_stop_by_itself(scenario: Path) -> None:
    with pytest.raises(EnsembleError, match="without --shard"):
        choose_ensemble([scenario], {"seeds": 50}, until="mean_arrival_delay_s ±2 %", shard="1/2")


def test_missing_runs_are_named_and_strange_parts_refused(scenario: Path, tmp_path: Path) -> None:
    part, out = tmp_path / "part", tmp_path / "merged"
    run_some(scenario, part, wanted={"shard": "1/2"})
    found = merge(out, [part], TABLES_ALONE)
    assert len(found.missing) == RUNS - 3
    assert found.told["missing"] == [str(task) for task in found.missing]
    run_some(scenario, tmp_path / "more", wanted={"shard": "2/2"}, seeds=4)
    with pytest.raises(EnsembleError, match=r"is no part of the study in .*\(seeds\)"):
        merge(out, [tmp_path / "more"])
    run_some(scenario, tmp_path / "other", wanted={"shard": "2/2"}, step_s=0.25)
    with pytest.raises(EnsembleError, match=r"\(step\)"):
        merge(out, [part, tmp_path / "other"])
    with pytest.raises(EnsembleError, match="holds no plan"):
        merge(tmp_path / "empty", [tmp_path])


def test_parts_are_held_beside_each_other_and_the_whole_alone(tmp_path: Path) -> None:
    with held_part(tmp_path / "out", "1_of_2"):
        with held_part(tmp_path / "out", "2_of_2") as work:
            assert work.is_dir()
        with pytest.raises(HeldError), held_part(tmp_path / "out", "1_of_2"):
            pass
        with pytest.raises(HeldError), held(tmp_path / "out"):
            pass
    assert not list(tmp_path.iterdir())


def test_the_dataset_is_read_and_asked_in_one_call(scenario: Path, tmp_path: Path) -> None:
    duckdb = pytest.importorskip("duckdb")
    wanted = {"trajectories": True}
    out = run_some(scenario, tmp_path / "it's", wanted=wanted, seeds=2).folder
    summary, calls = dataset.read(out), dataset.read(out, "calls")
    assert summary[["controller", "seed"]].to_numpy().tolist() == [
        ["plain", 7],
        ["plain", 8],
        ["second", 7],
        ["second", 8],
    ]
    asked = dataset.query(
        out,
        "SELECT controller, seed, avg(arrival_delay_s) AS mean FROM calls WHERE sequence > 0 "
        "GROUP BY ALL ORDER BY ALL",
    )
    late = calls[calls["sequence"] > 0].groupby(["controller", "seed"])["arrival_delay_s"].mean()
    assert asked["mean"].tolist() == pytest.approx(late.tolist())
    assert summary["mean_arrival_delay_s"].tolist() == pytest.approx(late.tolist(), abs=1e-3)
    assert dataset.query(out, "SELECT count(*) AS n FROM trajectory")["n"].item() == len(
        dataset.read(out, "trajectory", ["time_s"])
    )
    plain = pd.read_parquet(out / "runs" / "table=stops")
    assert len(plain) == len(dataset.read(out, "stops"))
    with pytest.raises(EnsembleError, match="allowed: summary, calls, stops, trajectory"):
        dataset.read(out, "speeds")
    with pytest.raises(duckdb.Error):
        dataset.query(out, "SELECT * FROM speeds")


@pytest.mark.figures
def test_figures_come_in_the_formats_that_are_asked_for(scenario: Path, tmp_path: Path) -> None:
    drawing = Drawing(("energy_net_kwh",), ("svg",))
    out = run_some(scenario, tmp_path / "out", drawing=drawing, seeds=2).folder
    images = {item.name for item in out.iterdir() if item.suffix in {".png", ".svg"}}
    assert images == {"box.svg", "ecdf.svg", "running_mean.svg"}
