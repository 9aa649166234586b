"""Studies from a script: what is chosen, what goes wrong, what is kept."""

from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from matplotlib.figure import Figure

from kankaku.analysis.results import read_results
from kankaku.commands.screen import EXIT_VIOLATION
from kankaku.controllers import registry
from kankaku.scenarios.loading.load import load
from kankaku.studies import study
from kankaku.studies.outcomes import StudyError, formats_of
from tests.cli.command import contents, kankaku, two_controllers
from tests.cli.layers import BLIND
from tests.unit.scenario_folder import replace, write_scenario
from tests.unit.sweep_folder import write_sweep

LONG_OVERSTAY = '[[overstays]]\ntrain = "A1"\nstation = "last"\ndelay_s = 400.0\n\n[[overstays]]'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return two_controllers(tmp_path / "small")


@pytest.fixture
def unsafe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a scenario whose second controller drives into a standing train."""
    monkeypatch.setitem(registry.PROTECTIONS, "blind", BLIND)
    folder = two_controllers(tmp_path / "small", protection="blind")
    replace(folder, "scenario.toml", "[[overstays]]", LONG_OVERSTAY)
    return folder


def test_a_study_takes_what_the_scenario_says(folder: Path) -> None:
    chosen = study.choose(folder)
    assert [spec.name for spec in chosen.specs] == ["plain", "second"]
    assert (chosen.seeds, chosen.step_s) == ((7,), 0.5)


def test_what_does_not_run_by_default_runs_where_it_is_named(folder: Path) -> None:
    replace(
        folder, "scenario.toml", "[controllers.second]", "[controllers.second]\nby_default = false"
    )
    assert [spec.name for spec in study.choose(folder).specs] == ["plain"]
    named = study.choose(folder, names=("plain", "second"))
    assert [spec.name for spec in named.specs] == ["plain", "second"]


def test_a_study_runs_every_controller_with_every_seed(folder: Path) -> None:
    chosen = study.choose(folder, names=("second", "plain"), seed=0, seeds=2, step_s=0.25)
    assert chosen.tasks == tuple(
        study.Task(name, seed, None) for name in ("second", "plain") for seed in (0, 1)
    )
    assert chosen.step_s == 0.25


def test_runs_in_a_window_come_one_after_the_other(folder: Path) -> None:
    assert study.choose(folder, jobs=4, gui=True).jobs == 1


def test_an_unknown_controller_is_refused_with_those_known(folder: Path) -> None:
    with pytest.raises(registry.ControllerError, match="allowed: plain, second"):
        study.choose(folder, names=("fast",))


def test_results_say_what_the_summary_says(folder: Path, tmp_path: Path) -> None:
    result = study.run_study(study.choose(folder), tmp_path / "out")
    read = read_results(result.folder)
    assert result.summary is not None
    pd.testing.assert_frame_equal(read.summary, result.summary)
    assert [outcome.task for outcome in result.outcomes] == [
        study.Task("plain", 7),
        study.Task("second", 7),
    ]
    assert (result.violations, result.interrupted) == ([], False)


def test_a_layer_can_be_watched(folder: Path) -> None:
    scenario = load(folder)
    seen = []

    def watch(name: str, layer: object) -> object:
        seen.append(name)
        return layer

    study.run_once(scenario, scenario.controllers[0], 7, 0.5, wrap=watch)
    assert sorted(seen) == ["drive", "engine", "operation", "protection"]


def test_an_unsafe_protection_ends_with_status_3_and_all_results(
    unsafe: Path, tmp_path: Path
) -> None:
    screen = kankaku(unsafe, "--out", tmp_path / "out", "--jobs", "1")
    assert screen.status == EXIT_VIOLATION
    assert "safety violations" in screen.complaints
    assert "second (seed 7): " in screen.complaints
    read = read_results(tmp_path / "out" / "small")
    assert read.controllers == ("plain", "second")
    summary = read.summary.set_index("controller")
    assert summary["violations"].to_dict()["plain"] == 0
    assert summary["violations"].to_dict()["second"] == len(read.run("second").violations) > 0
    assert summary["collisions"].to_dict()["second"] > 0
    assert set(read.run("second").violations["kind"]) >= {"collision", "spacing"}
    report = (tmp_path / "out" / "small" / "report.md").read_text("utf-8")
    assert "**second, seed 7: " in report


def test_trains_that_never_get_through_have_a_heading_of_their_own(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    replace(folder, "scenario.toml", "patience_min = 10.0", "patience_min = 0.0")
    replace(folder, "scenario.toml", "[[overstays]]", LONG_OVERSTAY)
    screen = kankaku(folder, "--out", tmp_path / "out")
    assert screen.status == 0
    heading = "3 trains had not finished when patience_min = 0 ended the run"
    assert heading in screen.complaints
    assert "safety violations" not in screen.complaints
    assert "plain (seed 7): A1 still stood at 'last': its stop was not over" in screen.complaints
    read = read_results(tmp_path / "out" / "small")
    assert read.summary["trains_completed"].item() == 0
    assert read.summary["violations"].item() == 0
    assert read.run("plain").unfinished["train"].tolist() == ["A1", "B2", "C3"]
    assert read.run("plain").unfinished["by"].tolist() == ["last", "A1", "B2"]
    report = (tmp_path / "out" / "small" / "report.md").read_text("utf-8")
    assert f"## {heading}" in report
    assert "- plain, seed 7: A1 still stood at 'last': its stop was not over" in report


class Interrupting:
    """A progress callback that presses Ctrl-C once a controller is under way."""

    def __init__(self, controller: str) -> None:
        self._controller = controller

    def __call__(self, task: study.Task, *_: float) -> None:
        if task.controller == self._controller:
            raise KeyboardInterrupt


def interrupt_call(monkeypatch: pytest.MonkeyPatch, owner: type, method: str, turn: int) -> None:
    """Press Ctrl-C in a certain call of a method."""
    usual = getattr(owner, method)
    begun = []

    def interrupted(*arguments: Any, **options: Any) -> object:  # noqa: ANN401
        begun.append(method)
        if len(begun) == turn:
            raise KeyboardInterrupt
        return usual(*arguments, **options)

    monkeypatch.setattr(owner, method, interrupted)


def test_an_interrupted_study_keeps_what_is_finished(folder: Path, tmp_path: Path) -> None:
    result = study.run_study(study.choose(folder), tmp_path / "out", Interrupting("second"))
    assert result.interrupted
    assert [outcome.task.controller for outcome in result.outcomes] == ["plain"]
    read = read_results(result.folder)
    assert read.controllers == ("plain",)
    assert read.provenance["interrupted"] is True
    assert {item.name for item in result.folder.iterdir() if item.is_dir()} == {"plain"}
    assert [item.name for item in (tmp_path / "out").iterdir()] == ["small"]


def test_an_interrupted_study_of_several_seeds_reads_back(folder: Path, tmp_path: Path) -> None:
    chosen = study.choose(folder, seeds=2)
    result = study.run_study(chosen, tmp_path / "out", Interrupting("second"))
    assert read_results(result.folder).summary["seed"].tolist() == [7, 8]


def test_earlier_results_survive_when_nothing_was_finished(folder: Path, tmp_path: Path) -> None:
    chosen = study.choose(folder)
    study.run_study(chosen, tmp_path / "out")
    before = contents(tmp_path / "out")
    again = study.choose(folder, fresh=True)
    result = study.run_study(again, tmp_path / "out", Interrupting("plain"))
    assert result.interrupted
    assert result.summary is None
    assert contents(tmp_path / "out") == before


def test_no_half_written_run_is_put_in_place(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_call(monkeypatch, pd.DataFrame, "to_parquet", 2)
    result = study.run_study(study.choose(folder), tmp_path / "out")
    assert result.interrupted
    assert {item.name for item in result.folder.iterdir() if item.is_dir()} == {"plain"}


@pytest.mark.figures
def test_an_interrupt_while_publishing_keeps_what_is_finished(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_call(monkeypatch, Figure, "savefig", 1)
    try:
        result = study.run_study(study.choose(folder), tmp_path / "out")
    except KeyboardInterrupt:
        pytest.fail("the finished runs are lost")
    assert result.interrupted
    assert read_results(result.folder).controllers == ("plain", "second")


def test_a_folder_of_something_else_is_refused_before_the_first_run(
    folder: Path, tmp_path: Path
) -> None:
    (tmp_path / "out" / "small").mkdir(parents=True)
    (tmp_path / "out" / "small" / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(FileExistsError, match="choose another folder"):
        study.run_study(study.choose(folder), tmp_path / "out", Interrupting("plain"))


def test_a_sweep_runs_every_controller_with_every_delay(tmp_path: Path) -> None:
    chosen = study.choose(write_sweep(tmp_path / "sweep"), seed=3)
    assert chosen.tasks == tuple(
        study.Task(name, 3, delay_s)
        for name in ("close_up", "two_stage")
        for delay_s in (0.0, 30.0, 60.0)
    )


def test_a_sweep_of_several_seeds_is_refused(tmp_path: Path) -> None:
    with pytest.raises(study.StudyError, match="allowed: 1"):
        study.choose(write_sweep(tmp_path / "sweep"), seeds=2)


def test_a_violation_in_a_sweep_is_named_with_its_delay(tmp_path: Path) -> None:
    result = study.StudyResult(tmp_path)
    result.outcomes = [
        study.Outcome(study.Task("plain", 7, 12.5), ("too close",), 1.0, 1),
        study.Outcome(study.Task("plain", 7), ("too fast",), 1.0, 1),
    ]
    assert result.violations == [
        "plain (seed 7, initial delay 12.5 s): too close",
        "plain (seed 7): too fast",
    ]


def test_an_interrupted_sweep_reads_back(tmp_path: Path) -> None:
    chosen = study.choose(write_sweep(tmp_path / "sweep"))
    result = study.run_study(chosen, tmp_path / "out", Interrupting("two_stage"))
    assert result.interrupted
    read = read_results(result.folder)
    assert read.summary["initial_delay_s"].tolist() == [0.0, 30.0, 60.0]
    assert read.run("close_up", initial_delay_s=30.0).calls["dwell_delay_s"].max() == 30.0
    assert read.intervals is not None
    assert read.intervals["initial_delay_s"].tolist() == [0.0, 30.0, 60.0]


def test_a_scenario_that_is_no_longer_a_sweep_leaves_no_old_intervals(tmp_path: Path) -> None:
    folder = write_sweep(tmp_path / "small")
    one = study.choose(folder, names=("close_up",))
    study.run_study(one, tmp_path / "out")
    assert read_results(tmp_path / "out" / "small").intervals is not None
    study.run_study(study.choose(write_scenario(folder), fresh=True), tmp_path / "out")
    assert read_results(tmp_path / "out" / "small").intervals is None


@pytest.mark.parametrize(
    ("asked", "formats"),
    [((), ("png", "svg")), (("svg", "svg"), ("svg",)), (("none",), ()), (("png",), ("png",))],
)
def test_formats_of_figures(asked: tuple[str, ...], formats: tuple[str, ...]) -> None:
    assert formats_of(asked) == formats


@pytest.mark.parametrize("asked", [("gif",), ("png", "none")])
def test_other_formats_are_refused(asked: tuple[str, ...]) -> None:
    with pytest.raises(StudyError, match=rf"--figures: '{asked[-1]}'; allowed: .*png, svg"):
        formats_of(asked)
