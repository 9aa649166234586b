"""The command ``describe``: on a terminal of 80 columns, and for editors."""

import json
from pathlib import Path

import pytest

from kankaku.scenarios.describing.described_files import described_files
from tests.cli.command import kankaku, refused
from tests.unit.scenario_folder import replace, write_scenario


@pytest.mark.parametrize(
    "asked", [(), ("calls.csv",), ("scenario.toml", "controllers"), ("stations.xlsx",)]
)
def test_it_fits_80_columns(asked: tuple[str, ...]) -> None:
    shown = kankaku("describe", *asked, width=80)
    assert shown.status == 0
    assert max(map(len, shown.answers.splitlines())) < 80


def test_it_lists_all_files() -> None:
    shown = kankaku("describe").answers
    assert all(name in shown for name in described_files())


def test_a_key_is_told_with_unit_range_default_and_example() -> None:
    shown = kankaku("describe", "scenario.toml", "radio.cycle_s").answers
    assert shown.splitlines()[-6:] == [
        "radio.cycle_s",
        "  Each train reports so often, and is told half a cycle later.",
        "  unit      s",
        "  allowed   a number from 0.1 up to 2",
        "  left out  1",
        "  example   cycle_s = 1.0",
    ]


def test_a_file_of_two_forms_is_named_with_spaces() -> None:
    assert "from_node" in kankaku("describe", "tracks.csv", "of", "a", "network").answers


def test_what_is_unknown_is_refused_with_the_likeliest() -> None:
    assert "'limits.csv' (did you mean that?)" in refused("describe", "limit.csv")
    assert "allowed: limit_kmh" in refused("describe", "limits.csv.limit")


def test_schemas_are_written_for_every_file(tmp_path: Path) -> None:
    shown = kankaku("describe", "--json-schema", tmp_path / "schemas")
    assert shown.status == 0
    files = list((tmp_path / "schemas").iterdir())
    assert len(files) == len(described_files())
    assert all(json.loads(file.read_text("utf-8"))["title"] for file in files)
    assert kankaku("describe", "--json-schema", tmp_path / "schemas").status == 0


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", "utf-8")
    assert "cannot be written" in refused("describe", "--json-schema", tmp_path / "file")


def test_mistakes_of_a_scenario_end_with_where_its_columns_are_told(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    replace(folder, "limits.csv", "1.0,2.0,75", "1.0,2.0,fast")
    told = refused("run", folder, "--out", tmp_path / "out").splitlines()
    assert told[-1] == "kankaku describe limits.csv tells every column"
