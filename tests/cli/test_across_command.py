"""Several scenarios at the command line: one table on the screen, and how the command ends."""

from pathlib import Path

import pandas as pd
import pytest

from kankaku.commands.screen import EXIT_VIOLATION
from kankaku.controllers import registry
from tests.cli.command import kankaku, refused, two_controllers
from tests.cli.layers import BLIND
from tests.unit.scenario_folder import replace

LONG_OVERSTAY = '[[overstays]]\ntrain = "A1"\nstation = "last"\ndelay_s = 400.0\n\n[[overstays]]'


@pytest.fixture
def folders(tmp_path: Path) -> list[Path]:
    return [two_controllers(tmp_path / name) for name in ("metro", "tram")]


def test_one_table_has_a_row_for_each_scenario_and_controller(
    folders: list[Path], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    both = ["--controller", "plain", "--controller", "second", "--seeds", "2", "--jobs", "1"]
    screen = kankaku("across", *folders, "--out", out, *both, width=80)
    assert screen.status == 0, screen.complaints
    lines = screen.answers.splitlines()
    assert max(map(len, lines[:-1])) <= 80
    assert [
        line.split()[0] for line in lines if line.startswith(("metro", "tram", "  p", "  s"))
    ] == [
        *("metro", "plain", "second"),
        *("tram", "plain", "second"),
    ]
    assert f"Results: {out / 'across'}" in lines[-1]
    assert {item.name for item in out.iterdir()} == {"across", "metro", "tram"}
    assert {item.name for item in (out / "across").iterdir()} == {
        *("across.csv", "across.png", "across.svg", "pareto.png", "pareto.svg"),
        *("columns.csv", "provenance.json", "report.html", "report.md"),
    }
    again = kankaku("across", *folders, "--out", out, *both, width=80)
    assert again.complaints.count("nothing had to be run") == 2
    assert again.answers == screen.answers
    # What ``run`` would do is done already.
    assert "nothing had to be run" in kankaku(folders[0], "--out", out, *both).complaints


@pytest.mark.figures
def test_a_violation_in_one_scenario_ends_the_command_with_status_3_and_keeps_the_others(
    folders: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(registry.PROTECTIONS, "blind", BLIND)
    unsafe = two_controllers(tmp_path / "unsafe", protection="blind")
    replace(unsafe, "scenario.toml", "[[overstays]]", LONG_OVERSTAY)
    out = tmp_path / "out"
    screen = kankaku("across", unsafe, folders[0], "--out", out, "--jobs", "1")
    assert screen.status == EXIT_VIOLATION
    assert "unsafe: " in screen.complaints
    assert "safety violations" in screen.complaints
    table = pd.read_csv(out / "across" / "across.csv").set_index(["scenario", "controller"])
    assert table["violations"].to_dict()["unsafe", "second"] > 0
    assert table["violations"].to_dict()["metro", "second"] == 0
    report = " ".join((out / "across" / "report.md").read_text("utf-8").split())
    assert "unsafe: second violated safety; do not use its other figures" in report


def test_what_a_scenario_lacks_is_refused_before_any_run(
    folders: list[Path], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    with (folders[0] / "scenario.toml").open("a", encoding="utf-8") as file:
        file.write('\n[controllers.third]\nprotection = "moving_block"\noperation = "eco"\n')
    told = refused("across", *folders, "--out", out, "--controller", "third")
    assert f"{folders[1]}: --controller: 'third' is not a controller of this scenario" in told
    assert "allowed: plain, second" in told
    told = refused("across", folders[0], tmp_path / "nowhere", "--out", out)
    assert "no such folder" in told
    assert not out.exists()
