"""The name of a shipped scenario works where commands take one, and nothing is written into it."""

import zipfile
from pathlib import Path

import pytest

from kankaku.scenarios.shipped import folder_of
from tests.cli.command import contents, kankaku, refused


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_a_shipped_scenario_is_exported_by_its_name_into_out(tmp_path: Path) -> None:
    before = contents(folder_of("branch"))
    for to, name in (("gtfs", "branch.gtfs.zip"), ("railjson", "branch.railjson.json")):
        told = kankaku("export", "branch", "--to", to)
        assert told.status == 0, told.complaints
        assert name in told.answers
    exported = tmp_path / "out" / "exported"
    with zipfile.ZipFile(exported / "gtfs" / "branch.gtfs.zip") as feed:
        assert "stop_times.txt" in feed.namelist()
    told = kankaku("export", folder_of("branch"), "--to", "railjson", "--out", tmp_path / "again")
    assert told.status == 0, told.complaints
    names = (exported / "railjson", tmp_path / "again")
    first, second = ((place / "branch.railjson.json").read_bytes() for place in names)
    assert first == second
    assert contents(folder_of("branch")) == before


def test_results_of_that_name_and_folders_come_first(tmp_path: Path) -> None:
    (tmp_path / "out" / "branch").mkdir(parents=True)
    assert "is no results folder" in refused("export", "branch", "--to", "gtfs")
    # Results are never written as such.
    assert kankaku("export", "branch", "--to", "railjson").status == 0
    (tmp_path / "terminal").mkdir()
    assert "is no results folder" in refused("export", "terminal", "--to", "gtfs")
    assert "there is no such folder" in refused("export", "yizhuang", "--to", "fcd")
    assert "there is no such folder" in refused("export", "yizhuan", "--to", "gtfs")


@pytest.mark.parametrize(
    "arguments",
    [
        ("blocks", "branch"),
        ("timetable", "branch"),
        ("timetable", "branch", "--seconds"),
        ("dwells", "events.csv", "--scenario", "branch"),
    ],
)
def test_what_comes_with_the_program_is_not_rewritten(arguments: tuple[str, ...]) -> None:
    told = " ".join(refused(*arguments).split())
    assert "branch: comes with the program, whose own files are not rewritten" in told
    assert f"allowed: a copy of {folder_of('branch')}" in told
