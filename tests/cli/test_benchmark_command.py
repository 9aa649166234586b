"""The command ``benchmark``: scores, a result file, and who has changed it."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kankaku.controllers.protection.moving_block import MovingBlockOptions
from kankaku.controllers.registry import PROTECTIONS, Layer
from kankaku.studies.benchmark_file import SEAL, result_told, seal_of
from kankaku.studies.benchmark_suites import BenchmarkPlan
from tests.cli.command import BAD_INPUT, FAILED, kankaku, refused
from tests.cli.layers import Blind

SMALL = ("--suite", "branch", "--world", "usual", "--seeds", "2", "--jobs", "1")
VIOLATION = 3
Told = dict[str, Any]


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the result file of a small benchmark."""
    out = tmp_path_factory.mktemp("benchmark") / "out"
    screen = kankaku("benchmark", "two_stage", *SMALL, "--out", out)
    assert screen.status == 0
    assert "moving_block+two_stage" in screen.answers
    assert "Only part of the benchmark" in screen.answers
    return out / "benchmark.json"


def verified(file: Path) -> tuple[int, str]:
    screen = kankaku("benchmark", "--verify", file, "--sample", "4", "--draw", "1", "--jobs", "1")
    return screen.status, screen.answers + screen.complaints


def test_a_result_is_verified_by_repeating_its_runs(result: Path) -> None:
    status, told = verified(result)
    assert status == 0
    assert "4 of 4 runs repeated (--draw 1): all figures are as the file tells them." in told
    assert "another one" not in told


def test_a_result_says_what_it_was_made_from(result: Path) -> None:
    told = json.loads(result.read_text("utf-8"))
    assert told["plan"] == {
        "suites": ["branch"],
        "worlds": ["usual"],
        "seeds": [9001, 9002],
        "step_s": 0.5,
        "whole": False,
    }
    assert {"versions", "sources_sha256", "scenarios", "controllers"} <= told["provenance"].keys()
    assert all(len(run["tables_sha256"]) == 64 for run in told["runs"])
    assert told["contract"] == {"moving_block+close_up": [], "moving_block+two_stage": []}


def test_the_same_command_repeats_no_run_and_another_controller_is_added(
    result: Path, tmp_path: Path
) -> None:
    shutil.copytree(result.parent, tmp_path / "out")
    journal = tmp_path / "out" / "benchmark_journal.jsonl"
    before = journal.read_bytes()
    assert kankaku("benchmark", "two_stage", *SMALL, "--out", tmp_path / "out").status == 0
    assert journal.read_bytes() == before
    assert kankaku("benchmark", "eco", *SMALL, "--out", tmp_path / "out").status == 0
    after = journal.read_bytes()
    assert after.startswith(before)
    assert len(after.splitlines()) == len(before.splitlines()) + 2


def better_figure(told: Told) -> None:
    told["runs"][-1]["energy_net_kwh"] -= 50.0


def better_score(told: Told) -> None:
    told["scores"]["moving_block+two_stage"]["score"] = 150.0


def sealed_score(told: Told) -> None:
    better_score(told)
    told[SEAL] = seal_of(told)


def left_out(told: Told) -> None:
    del told["runs"][-1]
    told[SEAL] = seal_of(told)


def made_whole(told: Told) -> None:
    told["plan"]["whole"] = True
    told[SEAL] = seal_of(told)


def other_seeds(told: Told) -> None:
    told["plan"]["seeds"] = [9001, 7]
    told["runs"] = [{**run, "seed": min(run["seed"], 9001)} for run in told["runs"]]
    told[SEAL] = seal_of(told)


def impossible(told: Told) -> None:
    told["runs"][-1]["mean_arrival_lateness_s"] = -1000.0
    told[SEAL] = seal_of(told)


def forged(told: Told) -> None:
    """Change runs and make everything else fit, as whoever knows this program can."""
    for run in told["runs"]:
        if run["controller"] != "moving_block+close_up":
            run["energy_net_kwh"] -= 50.0
    plan = BenchmarkPlan(("branch",), ("usual",), (9001, 9002))
    again = result_told(plan, told["provenance"], told["contract"], told["runs"])
    told.clear()
    told.update(again)


@pytest.mark.parametrize(
    ("tamper", "said"),
    [
        (better_figure, "its seal is of other contents"),
        (better_figure, "that of moving_block+two_stage is not what its runs give"),
        (better_score, "its seal is of other contents"),
        (sealed_score, "that of moving_block+two_stage is not what its runs give"),
        (left_out, "some of the plan are missing"),
        (made_whole, "says that it is the whole benchmark"),
        (other_seeds, "plan: 7 is not of version"),
        (impossible, "figures that no run can have"),
        (forged, "energy_net_kwh is "),
    ],
)
def test_a_tampered_file_is_found_out(
    tamper: Callable[[Told], None], said: str, result: Path, tmp_path: Path
) -> None:
    told = json.loads(result.read_text("utf-8"))
    tamper(told)
    file = tmp_path / "tampered.json"
    file.write_text(json.dumps(told), "utf-8")
    status, answer = verified(file)
    assert status == (FAILED if tamper is forged else BAD_INPUT)
    assert said in answer


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"benchmark": "kankaku benchmark"}', "{" * 5000, '{"benchmark": 1}']
)
def test_what_is_no_result_is_refused(text: str, tmp_path: Path) -> None:
    file = tmp_path / "no.json"
    file.write_text(text, "utf-8")
    assert "is not verified" in refused("benchmark", "--verify", file)


def test_fields_of_other_kinds_are_named_and_nothing_falls(result: Path, tmp_path: Path) -> None:
    whole = json.loads(result.read_text("utf-8"))
    file = tmp_path / "odd.json"
    for key, odd in (("runs", [3]), ("plan", {"suites": [[]]}), ("contract", {"a": 1})):
        file.write_text(json.dumps({**whole, key: odd}), "utf-8")
        refused("benchmark", "--verify", file)
    run = {**whole["runs"][0], "trains": "ten", "energy_net_kwh": float("nan")}
    file.write_text(json.dumps({**whole, "runs": [run]}), "utf-8")
    told = refused("benchmark", "--verify", file)
    assert "runs[0].trains is missing or is no int" in told
    assert "runs[0].energy_net_kwh is not finite" in told


def test_who_is_unsafe_has_no_score(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(PROTECTIONS.data, "blind", Layer(Blind, MovingBlockOptions, "sees none"))
    small = ("--suite", "branch", "--world", "wrong_distribution", "--seeds", "1", "--jobs", "1")
    screen = kankaku("benchmark", "blind", *small, "--out", tmp_path)
    assert screen.status in {FAILED, VIOLATION}
    told = json.loads((tmp_path / "benchmark.json").read_text("utf-8"))
    assert told["scores"]["blind+close_up"]["score"] is None
    assert "blind+close_up: trains are safe" in screen.answers


def test_what_there_is_not_is_refused_by_name(tmp_path: Path) -> None:
    out = ("--out", tmp_path / "out")
    assert "'two_stage' (did you mean that?)" in refused("benchmark", "two_stag", *out)
    assert "--suite: there is no 'brach'" in refused("benchmark", "eco", "--suite", "brach", *out)
    assert "--world: there is no 'usua'" in refused("benchmark", "eco", "--world", "usua", *out)
    assert "CONTROLLER: is missing" in refused("benchmark", *out)
    assert not (tmp_path / "out").exists()
