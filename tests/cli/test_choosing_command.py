"""What a user chooses at the command line beyond the controllers of a scenario."""

import json
import platform
from pathlib import Path

import pandas as pd

from tests.cli.command import kankaku, peer, refused, two_controllers


def test_layers_that_the_scenario_does_not_name_run_with_options_of_the_command_line(
    tmp_path: Path,
) -> None:
    folder, out = two_controllers(tmp_path / "small"), tmp_path / "out"
    pair = "moving_block+close_up"
    chosen = ["--controller", "plain", "--controller", pair]
    settings = ["--set", "plain.margin_m=60", "--set", f"{pair}.margin_m=60"]
    screen = kankaku(folder, "--out", out, "--jobs", "1", *chosen, *settings)
    assert screen.status == 0, screen.complaints
    results = out / "small"
    # Both are the same layers with the same options, and 60 m are not the 10 m of the file.
    both = [(results / name / "calls.csv").read_bytes() for name in ("plain", pair)]
    assert both[0] == both[1]
    told = json.loads((results / "provenance.json").read_text("utf-8"))["controllers"]
    assert [told[name]["options"]["protection"]["margin_m"] for name in told] == [60.0, 60.0]
    assert kankaku(folder, "--out", tmp_path / "file", "--controller", "plain").status == 0
    summary = [
        pd.read_csv(place / "small" / "summary.csv").iloc[0] for place in (out, tmp_path / "file")
    ]
    assert summary[0]["energy_net_kwh"] != summary[1]["energy_net_kwh"]


def test_capacity_takes_the_same_choices(tmp_path: Path) -> None:
    folder, out = two_controllers(tmp_path / "small"), tmp_path / "out"
    pair = "moving_block+eco"
    chosen = ["--controller", "plain", "--controller", pair, "--simulate", "none"]
    settings = ["--set", f"{pair}.margin_m=110"]
    screen = kankaku("capacity", folder, "--out", out, "--jobs", "1", *chosen, *settings)
    assert screen.status == 0, screen.complaints
    table = pd.read_csv(out / "small_capacity" / "capacity.csv")
    headways_s = dict(zip(table["controller"], table["headway_s"], strict=True))
    # The margin is 100 m longer, which a train that starts takes seconds to run.
    assert headways_s[pair] > headways_s["plain"] + 2.0


def test_what_cannot_be_chosen_is_refused_before_anything_runs(tmp_path: Path) -> None:
    folder, out = two_controllers(tmp_path / "small"), tmp_path / "out"
    peer(folder, "sumo_native_moving")
    for setting, told in (
        ("second.slowest_kmh=900", "--set: second.slowest_kmh: slowest_kmh is 900; allowed: 1 to"),
        ("sumo_native_moving.radio=true", "is a peer, which has no options"),
        ("third.margin_m=3", "--set: 'third' is not a controller that is to run"),
    ):
        complaints = refused(folder, "--out", out, "--set", setting)
        assert told in complaints
        assert "scenario.toml" not in complaints
    told = refused(folder, "--out", out, "--controller", "moving_block+fast")
    assert "--controller: 'moving_block+fast': 'fast' is not a known operation" in told
    radio = ["--controller", "atd+eco", "--set", "atd+eco.radio=true"]
    assert "--controller atd+eco.radio: the commands of atd" in refused(
        folder, "--out", out, *radio
    )
    assert "SCENARIO: missing" in refused("--seed", "3")
    assert not out.exists()


def test_the_controllers_of_a_scenario_are_listed_with_what_differs(tmp_path: Path) -> None:
    folder = two_controllers(tmp_path / "small")
    peer(folder, "sumo_native_moving")
    with (folder / "scenario.toml").open("a", encoding="utf-8") as file:
        file.write("by_default = false\n")
        file.write('[controllers.held]\nprotection = "atd"\noperation = "eco"\n')
        file.write('supervision = "headway_regulation"\nsupervision_options = { gain = 0.5 }\n')
    screen = kankaku(folder, "--list-controllers")
    assert screen.status == 0
    rows = {
        cells[1]: cells[2:-1]
        for line in screen.answers.splitlines()
        if len(cells := [cell.strip() for cell in line.split("│")]) > 2
    }
    assert rows == {
        "plain": ["moving_block", "close_up", "margin_m = 10.0", "yes"],
        "second": ["moving_block", "two_stage", "", "yes"],
        "sumo_native_moving": ["peer sumo_native_moving", "-", "", "no"],
        "held": ["atd", "eco", "gain = 0.5", "yes"],
        "": ["", "", "supervision = headway_regulation", ""],
    }
    assert "no such folder" in refused(tmp_path / "nowhere", "--list-controllers")


def test_versions_are_told() -> None:
    screen = kankaku("--version")
    assert screen.status == 0
    told = screen.answers.strip().split(", ")
    assert told[0].startswith("kankaku ")
    assert told[1].startswith("SUMO 1.")
    assert told[2] == f"Python {platform.python_version()}"
