"""A planner with a sheet of paper: from a list of stations to results, in a few commands."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from kankaku.commands.new_shown import asked_line
from kankaku.scenarios.drafts.line_answers import LineAnswers
from kankaku.scenarios.drafts.own_line import OwnLineError
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.shipped import folder_of
from tests.cli.command import contents, kankaku, refused

STATIONS = "Airport 0, Park 1.1, City 2.3"
CONTROLLERS = ("close_up", "two_stage", "atc", "atd")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "mine"
    done = kankaku(
        *("new", folder, "--stations", STATIONS, "--headway", "150", "--until", "07:10"),
        *("--train", "beijing_b6"),
    )
    assert done.status == 0, done.complaints
    assert "by 5 trains" in done.answers
    return folder


def test_a_new_line_runs_at_once_under_four_controllers(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = kankaku("run", folder, "--out", out, "--no-open", "--figures", "none", "--step", "0.5")
    assert done.status == 0, done.complaints
    assert "Every train finished" in done.answers
    assert all(name in done.answers for name in CONTROLLERS)
    assert (out / "mine" / "report.md").is_file()
    told = (folder / "SOURCES.md").read_text("utf-8")
    assert "TTOBench" in told
    assert "least turn-back" in told


def test_nothing_is_replaced_unless_that_is_said(folder: Path) -> None:
    before = contents(folder)
    for command in (("new", folder, "--stations", STATIONS), ("timetable", folder)):
        assert "--force" in refused(*command)
    assert "--force" in refused("blocks", folder)
    assert contents(folder) == before


def test_numbers_typed_wrong_are_answered_at_once(tmp_path: Path) -> None:
    told = refused(
        *("new", tmp_path / "x", "--stations", "A 0, B x", "--headway", "no", "--dwell", "1"),
        *("--train-figures", "mass_t=0", "--from", "25h", "--turn-back", "-1"),
    )
    for option in ("--stations", "--headway", "--dwell", "mass_t", "--from", "--turn-back"):
        assert option in told
    assert not (tmp_path / "x").exists()


def test_without_a_terminal_nobody_is_asked(tmp_path: Path) -> None:
    assert "--stations" in refused("new", tmp_path / "x")


def test_who_answers_wrong_is_asked_again() -> None:
    answers = iter(["A 0, B x", "often", *[""] * 6, "A 0, B 2", "200"])
    asked: list[str] = []

    def ask(question: str, usual: str) -> str:
        asked.append(question)
        return next(answers, usual) or usual

    line = asked_line(LineAnswers(), "mine", ask)
    assert [stop.name for stop in line.sketch.stops] == ["A", "B"]
    assert len(asked) == 16


def test_who_never_answers_right_reads_what_is_wrong() -> None:
    with pytest.raises(OwnLineError, match="'x' is no number"):
        asked_line(LineAnswers(), "mine", lambda *_: "B x")


def test_a_timetable_is_made_anew_for_tracks_that_are_there(folder: Path) -> None:
    done = kankaku("timetable", folder, "--headway", "200", "--until", "07:20", "--force")
    assert done.status == 0, done.complaints
    assert "200 s apart" in done.answers
    services = load(folder).timetable.services
    starts_s = [s.calls[0].departure_s for s in services if s.train.startswith("r")]
    first_s, second_s, *_ = sorted(starts_s)
    assert second_s - first_s == 200
    assert "kankaku timetable" in (folder / "SOURCES.md").read_text("utf-8")


def test_a_headway_that_the_tracks_do_not_allow_is_refused_with_the_least(folder: Path) -> None:
    before = contents(folder)
    told = refused("timetable", folder, "--headway", "60", "--force")
    assert "s or more" in told
    assert contents(folder) == before


def test_seconds_are_made_of_whole_minutes(folder: Path) -> None:
    assert "public_timetable.csv" in refused("timetable", folder, "--seconds", "--force")


@pytest.mark.parametrize(("name", "file"), [("atc", "blocks.csv"), ("atd", "circuits.csv")])
def test_blocks_reach_the_headway_that_was_asked(folder: Path, name: str, file: str) -> None:
    done = kankaku("blocks", folder, "--for", name, "--headway", "100", "--force")
    assert done.status == 0, done.complaints
    assert "critical" in done.answers
    assert "Park" in done.answers
    assert file in done.answers
    assert (folder / file).is_file()
    assert load(folder).line.blocks
    # By the same theory no train is booked closer than the blocks allow.
    assert f"under {name}" not in kankaku("check", folder).answers


def test_blocks_that_cannot_be_are_refused_with_the_least_headway(folder: Path) -> None:
    before = contents(folder)
    told = refused("blocks", folder, "--for", "atd", "--headway", "40", "--force")
    assert "40 s is too short for atd" in told
    assert "s or more" in told
    assert "uses no blocks" in refused("blocks", folder, "--for", "close_up", "--force")
    assert contents(folder) == before


def test_blocks_are_laid_where_there_were_none(folder: Path) -> None:
    (folder / "blocks.csv").unlink()
    assert kankaku("blocks", folder, "--for", "multi_step_atc", "--headway", "130").status == 0
    assert load(folder).line.blocks


def test_a_check_tells_doubts_and_draws_the_line(folder: Path, tmp_path: Path) -> None:
    done = kankaku("check", folder, "--figure", tmp_path / "line.svg")
    assert done.status == 0, done.complaints
    assert "no mistakes" in done.answers
    assert (tmp_path / "line.svg").stat().st_size > 1000
    stations = folder / "stations.csv"
    rows = stations.read_text("utf-8").splitlines()
    places = ["lon_deg,lat_deg", "139.0,35.0", "139.0,35.0", "140.0,35.0"]
    told = [f"{row},{place}" for row, place in zip(rows, places, strict=True)]
    stations.write_text("\n".join(told) + "\n", encoding="utf-8")
    (folder / "gradient.csv").write_text("a\n1\n", encoding="utf-8")
    done = kankaku("check", folder)
    assert done.status == 0
    assert "gradient.csv" in done.answers
    assert "'airport' and 'park' lie 0 m apart" in done.answers
    assert "'park' and 'city' lie 9" in done.answers


def test_a_check_of_what_is_wrong_ends_with_it(folder: Path) -> None:
    calls = folder / "calls.csv"
    calls.write_text(calls.read_text("utf-8").replace("07:0", "7-0", 1), encoding="utf-8")
    assert "calls.csv: row 2" in refused("check", folder)
    assert "no kind of figure" in refused("check", "terminal", "--figure", "line.gif")


def doubtful(text: str) -> Iterator[str]:
    return (line.strip() for line in text.splitlines() if line.startswith("  "))


def test_trains_booked_too_close_or_unlike_the_others_are_told(folder: Path) -> None:
    done = kankaku("timetable", folder, "--headway", "150", "--until", "07:30", "--force")
    assert done.status == 0
    calls = folder / "calls.csv"
    rows = calls.read_text("utf-8").splitlines()
    last = [row for row in rows if row.startswith("r0")][-1]
    train = last.partition(",")[0]
    late = [row for row in rows if row.startswith(f"{train},city")]
    assert late
    station, track, *_ = late[0].split(",")[1:]
    slow = f"{train},{station},{track},07:40:00,07:41:00"
    calls.write_text("\n".join(rows).replace(late[0], slow) + "\n", encoding="utf-8")
    told = [*doubtful(kankaku("check", folder).answers)]
    assert any("usual are" in sentence and train in sentence for sentence in told)


def test_the_library_says_where_its_trains_are_from() -> None:
    told = kankaku("trains").answers
    assert "beijing_b6" in told
    assert "TTOBench" in told
    told = kankaku("trains", "london_2009").answers
    assert "Wikipedia" in told
    assert "Assumed:" in told
    assert "did you mean" in refused("trains", "london")


def test_speed_codes_that_make_runs_longer_than_booked_are_told(folder: Path) -> None:
    blocks = folder / "blocks.csv"
    rows = blocks.read_text("utf-8").splitlines()
    made = [rows[0]]
    for row in rows[1:]:
        start_km, end_km, name, track = row.split(",")
        # In halves of halves a train cannot brake from one code to the next.
        edges = [float(start_km), float(end_km)]
        if edges[1] - edges[0] > 0.15:
            edges[1:1] = [
                round(edges[0] + (edges[1] - edges[0]) * part / 4, 3) for part in (1, 2, 3)
            ]
        for number, start in enumerate(edges[:-1]):
            made.append(f"{start},{edges[number + 1]},{name}-{number},{track}")
    assert rows[0] == "start_km,end_km,id,track"
    blocks.write_text("\n".join(made) + "\n", encoding="utf-8")
    told = [*doubtful(kankaku("check", folder).answers)]
    assert any("under atc it takes" in sentence for sentence in told)


def test_a_line_with_branches_gets_no_regular_timetable(tmp_path: Path) -> None:
    folder = tmp_path / "branch"
    shutil.copytree(folder_of("branch"), folder)
    before = contents(folder)
    assert "without branches" in refused("timetable", folder, "--headway", "900", "--force")
    assert contents(folder) == before


def test_files_of_another_line_are_not_mixed_with_a_new_one(folder: Path) -> None:
    assert kankaku("blocks", folder, "--for", "atd", "--headway", "100", "--force").status == 0
    before = contents(folder)
    told = refused("new", folder, "--stations", "A 0, B 2", "--force")
    assert "circuits.csv" in told
    assert contents(folder) == before
    (folder / "circuits.csv").unlink()
    assert kankaku("new", folder, "--stations", "A 0, B 2", "--force").status == 0
    assert len(load(folder).line.stations) == 2
