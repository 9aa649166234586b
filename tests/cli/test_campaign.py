"""The command ``faults``: a short campaign, interrupted, continued, refused."""

import json
from pathlib import Path

import pandas as pd
import pytest

from kankaku.studies import campaign, study
from kankaku.studies.campaign_journal import JOURNAL, Campaign
from tests.cli.command import BAD_INPUT, Screen, contents, kankaku, two_controllers

SCENARIO = Path(__file__).parents[2] / "scenarios" / "control_map"
VIOLATION = 3
RUNS = 3
TABLES = {"columns.csv", "fault_runs.csv", "fault_table.csv", "journal.jsonl", "provenance.json"}


def run_it(place: Path, *options: str) -> Screen:
    """Three runs with a long step, which takes a fifth of the time."""
    always = ("--jobs", "1", "--step", "0.5", "--out", str(place))
    return kankaku("campaign", SCENARIO, "--runs", str(RUNS), *always, *options)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("faults")


@pytest.fixture(scope="module")
def screen(place: Path) -> Screen:
    return run_it(place)


@pytest.fixture(scope="module")
def results(place: Path, screen: Screen) -> Path:
    assert screen.status == 0, screen.complaints
    return place / "control_map_faults"


def test_the_screen_tells_what_became_of_each_fault(screen: Screen, results: Path) -> None:
    for told in ("fault", "detection", "reaction", "stopped", "caused", "unsafe"):
        assert told in screen.answers
    assert f"Results: {results}" in screen.answers
    assert f"campaign: {2 * RUNS} of {2 * RUNS}, " in screen.complaints


def test_the_folder_holds_every_run_and_what_columns_mean(results: Path) -> None:
    assert {file.name for file in results.iterdir()} == TABLES
    runs = pd.read_csv(results / "fault_runs.csv", keep_default_na=False)
    table = pd.read_csv(results / "fault_table.csv", keep_default_na=False)
    assert runs["run"].tolist() == list(range(RUNS))
    assert table["runs"].sum() == RUNS
    assert table["unsafe_events"].sum() == runs["unsafe_events"].astype(int).sum() == 0
    explained = pd.read_csv(results / "columns.csv", keep_default_na=False)
    for name, frame in (("fault_runs", runs), ("fault_table", table)):
        assert explained.loc[explained["table"] == name, "column"].tolist() == list(frame.columns)
    told = json.loads((results / "provenance.json").read_text("utf-8"))
    assert (told["scenario"], told["finished_runs"]) == ("control_map", RUNS)


def test_an_interrupted_campaign_is_continued_and_comes_to_the_same(
    results: Path, tmp_path: Path
) -> None:
    chosen = study.choose(SCENARIO, names=("control_map",), step_s=0.5)
    wanted = Campaign(chosen, RUNS)

    def gives_up(done: int, total: int) -> None:
        assert total == 2 * RUNS
        if done == RUNS + 2:
            raise KeyboardInterrupt

    broken = campaign.run_campaign(wanted, tmp_path, gives_up)
    assert broken.interrupted
    assert len(broken.tables.runs) == 2
    journal = tmp_path / "control_map_faults" / JOURNAL
    # Killed while writing the next line.
    journal.write_bytes(journal.read_bytes() + b'{"number": 2, "se')
    done: list[int] = []
    whole = campaign.run_campaign(wanted, tmp_path, lambda finished, _: done.append(finished))
    assert done == list(range(RUNS + 3, 2 * RUNS + 1))
    assert not whole.interrupted
    for name in ("fault_runs.csv", "fault_table.csv", JOURNAL):
        assert (journal.parent / name).read_bytes() == (results / name).read_bytes()


def test_what_is_finished_is_not_run_again_and_another_campaign_is_refused(
    place: Path, results: Path
) -> None:
    before = contents(results)
    assert run_it(place).status == 0
    after = contents(results)
    for name in TABLES - {"provenance.json"}:
        assert after[name] == before[name]
    refused = run_it(place, "--seed", "7")
    assert refused.status == BAD_INPUT
    assert "of another campaign (seed); allowed: --fresh" in refused.complaints
    assert contents(results) == after


def damage(results: Path, place: Path, line: bytes) -> None:
    """Copy a journal whose third line is another one."""
    folder = place / results.name
    folder.mkdir()
    lines = (results / JOURNAL).read_bytes().splitlines()
    lines[2] = line
    (folder / JOURNAL).write_bytes(b"\n".join(lines) + b"\n")


@pytest.mark.parametrize("line", [b"[]", b"{", b"", b'{"number": 1}', b"\xff"])
def test_a_damaged_journal_is_named_with_its_line(
    results: Path, tmp_path: Path, line: bytes
) -> None:
    damage(results, tmp_path, line)
    seen = run_it(tmp_path)
    assert seen.status == BAD_INPUT
    assert "journal.jsonl, line 3: damaged; allowed: --fresh" in seen.complaints


def test_a_damaged_journal_is_made_anew_when_told(results: Path, tmp_path: Path) -> None:
    damage(results, tmp_path, b"\xff")
    assert run_it(tmp_path, "--fresh").status == 0
    anew = tmp_path / results.name / JOURNAL
    assert anew.read_bytes() == (results / JOURNAL).read_bytes()


def test_an_unsafe_run_ends_with_a_status_of_its_own(results: Path, tmp_path: Path) -> None:
    folder = tmp_path / results.name
    folder.mkdir()
    lines = (results / JOURNAL).read_text("utf-8").splitlines()
    last = {**json.loads(lines[-1]), "unsafe_events": 1, "first_event": "t2 collided"}
    told = "\n".join([*lines[:-1], json.dumps(last)]) + "\n"
    (folder / JOURNAL).write_text(told, "utf-8")
    seen = run_it(tmp_path)
    assert seen.status == VIOLATION
    assert "1 runs with unsafe events" in seen.complaints
    assert "t2 collided" in seen.complaints


def test_other_controllers_and_other_folders_are_refused(tmp_path: Path) -> None:
    folder = two_controllers(tmp_path / "small")
    wrong = kankaku("campaign", folder, "--controller", "plain", "--out", tmp_path)
    assert wrong.status == BAD_INPUT
    assert "plain; allowed: one with the protection control_map" in wrong.complaints
    (tmp_path / "control_map_faults").mkdir()
    (tmp_path / "control_map_faults" / "precious.txt").write_text("mine", "utf-8")
    foreign = run_it(tmp_path)
    assert foreign.status == BAD_INPUT
    assert "holds no results of this program" in foreign.complaints
