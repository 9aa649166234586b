"""Studies go on where they were: what is finished is kept, and never passed off as another."""

import json
from collections.abc import Callable
from dataclasses import replace as changed
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from kankaku.analysis.results import read_results
from kankaku.controllers import registry
from kankaku.controllers.protection.moving_block import Ahead, MovingBlock, MovingBlockOptions
from kankaku.controllers.registry import Layer
from kankaku.railway.step.state import Authority, LineState
from kankaku.store import run_store
from kankaku.store.fingerprint import content_sha256
from kankaku.store.holding import held
from kankaku.studies import movers, study
from kankaku.sumo_net.engine import SumoEngine
from tests.cli.command import (
    BAD_INPUT,
    FAILED,
    Screen,
    contents,
    is_note_of_time,
    kankaku,
    two_controllers,
)
from tests.cli.layers import BLIND
from tests.unit.scenario_folder import replace, write_scenario

LONG_OVERSTAY = '[[overstays]]\ntrain = "A1"\nstation = "last"\ndelay_s = 400.0\n\n[[overstays]]'
BREAKS_AT_S = 25_500.0


class Breaking(MovingBlock):
    """Fails in the middle of a run."""

    def authorise(self, state: LineState, memory: Ahead) -> tuple[Authority, Ahead]:
        if state.time_s >= BREAKS_AT_S:
            msg = "no more track"
            raise ValueError(msg)
        return super().authorise(state, memory)


class Failing(SumoEngine):
    """Gives up as soon as trains have met."""

    def advance(self) -> None:
        if self._agreement.colliding:
            msg = "what now?"
            raise RuntimeError(msg)
        super().advance()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return two_controllers(tmp_path / "small")


@pytest.fixture
def compare(folder: Path, tmp_path: Path) -> Callable[..., Screen]:
    """Run the small scenario in this process into one results folder."""

    def run_it(*options: str) -> Screen:
        return kankaku(folder, "--out", tmp_path / "out", "--jobs", "1", *options)

    return run_it


def use_for_second(folder: Path, protection: str) -> None:
    """Give the second controller another protection."""
    old = '"moving_block"\noperation = "two_stage"'
    replace(folder, "scenario.toml", old, old.replace("moving_block", protection))


def tables_of(folder: Path) -> dict[str, bytes]:
    return {name: held for name, held in contents(folder).items() if not is_note_of_time(name)}


def finished_times(folder: Path) -> dict[str, str]:
    return {
        file.parent.relative_to(folder).as_posix(): file.read_text("utf-8")
        for file in folder.rglob("run.json")
    }


def test_a_run_that_fails_costs_no_other_run_and_is_made_up_for_later(
    folder: Path,
    tmp_path: Path,
    compare: Callable[..., Screen],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    results = tmp_path / "out" / "small"
    use_for_second(folder, "own")
    layer = Layer(Breaking, MovingBlockOptions, "breaks")
    monkeypatch.setitem(registry.PROTECTIONS, "own", layer)
    screen = compare()
    assert screen.status == FAILED
    assert "1 failure\n" in screen.complaints
    assert "second (seed 7) at 07:05:00: ValueError: no more track" in screen.complaints
    assert "Traceback" not in screen.complaints
    assert read_results(results).controllers == ("plain",)
    (note,) = (results / "failures").iterdir()
    assert "in authorise" in note.read_text("utf-8")
    assert str(note) in screen.complaints
    report = (results / "report.md").read_text("utf-8")
    assert "second (seed 7) at 07:05:00: ValueError: no more track" in report
    # The same layer, mended; a file of somebody else's code would count as another origin.
    monkeypatch.setattr(Breaking, "authorise", MovingBlock.authorise)
    before = finished_times(results)["plain"]
    again = compare()
    assert again.status == 0, again.complaints
    assert "1 of 2 runs were finished on " in again.complaints
    assert "second (seed 7): finished, 2 of 2" in again.complaints
    assert "plain (seed 7): finished" not in again.complaints
    assert finished_times(results)["plain"] == before
    whole = kankaku(folder, "--out", tmp_path / "whole", "--jobs", "1")
    assert whole.status == 0
    assert tables_of(results) == tables_of(tmp_path / "whole" / "small")


def test_what_is_finished_is_published_again_and_not_run_again(
    compare: Callable[..., Screen], tmp_path: Path
) -> None:
    results = tmp_path / "out" / "small"
    assert compare().status == 0
    before, tables = finished_times(results), tables_of(results)
    (results / "summary.csv").unlink()
    screen = compare()
    assert screen.status == 0
    assert "All 2 runs were finished on " in screen.complaints
    assert "nothing had to be run; --fresh runs them anew" in screen.complaints
    assert (finished_times(results), tables_of(results)) == (before, tables)


def test_runs_of_something_else_are_refused_by_name_and_replaced_if_that_is_wanted(
    folder: Path,
    tmp_path: Path,
    compare: Callable[..., Screen],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    results = tmp_path / "out" / "small"
    assert compare().status == 0
    (results / "plain" / "notes.txt").write_text("mine", encoding="utf-8")
    before = contents(results)

    def refused(*options: str) -> str:
        screen = compare(*options)
        assert screen.status == BAD_INPUT
        assert "--fresh" in screen.complaints
        assert contents(results) == before
        return screen.complaints

    assert "holds runs of something else (step)" in refused("--step", "0.25")
    with monkeypatch.context() as patch:
        patch.setattr(run_store, "sources_sha256", lambda: "edited")
        assert "(sources of the program)" in refused()
    replace(folder, "scenario.toml", "patience_min = 10.0", "patience_min = 11.0")
    assert "(scenario)" in refused()
    fresh = compare("--fresh", "--controller", "plain")
    assert fresh.status == 0, fresh.complaints
    assert read_results(results).controllers == ("plain",)
    assert not (results / "second").exists()
    assert (results / "plain" / "notes.txt").read_text("utf-8") == "mine"


def test_results_that_do_not_say_what_they_are_of_are_not_mixed_with_others(
    compare: Callable[..., Screen], tmp_path: Path
) -> None:
    assert compare("--controller", "plain").status == 0
    (tmp_path / "out" / "small" / "plain" / "run.json").unlink()
    screen = compare("--controller", "second")
    assert screen.status == BAD_INPUT
    assert "they do not say of which" in screen.complaints


def test_a_run_whose_tables_are_damaged_is_run_again(
    compare: Callable[..., Screen], tmp_path: Path
) -> None:
    results = tmp_path / "out" / "small"
    assert compare().status == 0
    tables = tables_of(results)
    calls = results / "plain" / "calls.csv"
    calls.write_bytes(calls.read_bytes()[:100])
    screen = compare()
    assert screen.status == 0
    assert "1 of 2 runs were finished" in screen.complaints
    assert tables_of(results) == tables


def test_more_seeds_go_on_from_the_first_one(
    folder: Path, compare: Callable[..., Screen], tmp_path: Path
) -> None:
    results = tmp_path / "out" / "small"
    one = ("--controller", "plain")
    assert compare(*one).status == 0
    assert (results / "plain" / "calls.csv").is_file()
    first = finished_times(results)["plain"]
    screen = compare(*one, "--seeds", "2")
    assert screen.status == 0
    assert "1 of 2 runs were finished" in screen.complaints
    assert finished_times(results)["plain/seed_7"] == first
    assert {item.name for item in (results / "plain").iterdir()} == {"seed_7", "seed_8"}
    whole = kankaku(folder, "--out", tmp_path / "whole", "--jobs", "1", *one, "--seeds", "2")
    assert whole.status == 0
    assert tables_of(results) == tables_of(tmp_path / "whole" / "small")
    assert "The run was finished on " in compare(*one).complaints
    assert read_results(results).summary["seed"].tolist() == [7, 8]


def test_two_commands_do_not_write_to_one_folder(
    compare: Callable[..., Screen], tmp_path: Path
) -> None:
    with held(tmp_path / "out" / "small"):
        screen = compare()
    assert screen.status == BAD_INPUT
    assert "another command is writing its results there" in screen.complaints
    assert not (tmp_path / "out" / "small").exists()
    assert compare("--controller", "plain").status == 0


def test_what_a_killed_command_left_is_removed_by_the_next(
    compare: Callable[..., Screen], tmp_path: Path
) -> None:
    left = tmp_path / "out" / "small" / ".unfinished" / "kankaku-x"
    left.mkdir(parents=True)
    (left / "trains.rou.xml").touch()
    assert compare("--controller", "plain").status == 0
    assert not list((tmp_path / "out").rglob(".*"))


def test_trains_that_meet_are_told_of_even_if_the_engine_then_fails(
    folder: Path,
    compare: Callable[..., Screen],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(registry.PROTECTIONS, "blind", BLIND)
    monkeypatch.setattr(movers, "SumoEngine", Failing)
    replace(
        folder, "scenario.toml", '"moving_block"\noperation = "two', '"blind"\noperation = "two'
    )
    replace(folder, "scenario.toml", "[[overstays]]", LONG_OVERSTAY)
    screen = compare()
    assert screen.status == 3
    assert "RuntimeError: what now?" in screen.complaints
    read = read_results(tmp_path / "out" / "small")
    assert "collision" in set(read.run("second").violations["kind"])
    assert read.summary["trains_completed"].tolist()[0] == 3


@pytest.mark.figures
def test_figures_that_cannot_be_drawn_cost_no_table(
    compare: Callable[..., Screen], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object, **__: object) -> None:
        msg = "no ink"
        raise ValueError(msg)

    monkeypatch.setattr(Figure, "savefig", fails)
    screen = compare("--controller", "plain")
    assert screen.status == FAILED
    assert "the figures could not be drawn: ValueError: no ink" in screen.complaints
    assert "Traceback" not in screen.complaints
    assert read_results(tmp_path / "out" / "small").controllers == ("plain",)


def test_trains_that_have_not_finished_have_a_heading_of_their_own(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    replace(folder, "scenario.toml", "patience_min = 10.0", "patience_min = 0.0")
    replace(folder, "scenario.toml", "[[overstays]]", LONG_OVERSTAY)
    told = kankaku(folder, "--out", tmp_path / "out").complaints
    assert "3 trains had not finished when patience_min = 0 ended the run" in told
    assert "plain (seed 7): " in told


def test_a_scenario_that_a_script_changes_is_another_one(folder: Path) -> None:
    scenario = study.choose(folder).scenario
    assert content_sha256(scenario) == content_sha256(study.choose(folder).scenario)
    patient = changed(scenario, patience_s=scenario.patience_s + 1.0)
    assert content_sha256(patient) != content_sha256(scenario)
    origin = run_store.origin_of(scenario, scenario.controllers[0], 0.5)
    other = run_store.origin_of(patient, scenario.controllers[0], 0.5)
    assert [key for key in origin if origin[key] != other[key]] == ["content_sha256"]


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (0.0, 0.1),
        (1, 1.0),
        (1, True),
        ("a", b"a"),
        (("a", "b"), ("ab",)),
        ((), None),
        ({"a": 1}, {"a": 2}),
        (np.zeros(2), np.zeros(3)),
        (np.zeros(2), np.zeros(2, dtype=np.int64)),
    ],
)
def test_unlike_contents_have_unlike_digests(one: object, other: object) -> None:
    assert content_sha256(one) != content_sha256(other)
    assert content_sha256(one) == content_sha256(one)


def test_what_has_no_content_has_no_digest() -> None:
    with pytest.raises(TypeError, match="no digest of a object"):
        content_sha256((1, object()))


def test_the_record_of_a_run_says_what_it_was_made_from(
    compare: Callable[..., Screen], tmp_path: Path
) -> None:
    assert compare("--controller", "plain").status == 0
    told = json.loads((tmp_path / "out" / "small" / "plain" / "run.json").read_text("utf-8"))
    assert (told["name"], told["seed"], told["step_s"]) == ("plain", 7, 0.5)
    assert told["controller"]["options"]["protection"]["margin_m"] == 10.0
    assert told["versions"].keys() == {"kankaku", "eclipse-sumo", "libsumo", "numpy"}
    assert (told["violations"], told["failure"]) == (0, "")
    assert told["train_steps"] > 0
