"""Timetables of Mini Tokyo 3D: minutes are kept, stock is joined, other lines are told."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from kankaku.scenarios.drafts.draft import Draft, write_files
from kankaku.scenarios.importing.formats import SourceError, Wish, imported
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.row_formats import CallRow, ServiceRow, StationRow
from tests.shared_data import SAMPLES

PUBLIC = SAMPLES / "mini-tokyo-3d"
LINE = "railways.json: line 'X.Y'"
NAMES = ("Higashi", "Naka", "Nishi")
Entry = dict[str, Any]


def train(number: str, minutes: Sequence[int], day: str = "Weekday", **more: object) -> Entry:
    """Return a train that departs every few minutes, from the first station if it is odd."""
    names = NAMES if int(number) % 2 else NAMES[::-1]
    calls: list[Entry] = [
        {"s": f"X.Y.{name}", "d": f"{minute // 60:02d}:{minute % 60:02d}"}
        for name, minute in zip(names, minutes, strict=True)
    ]
    calls[-1]["a"] = calls[-1].pop("d")
    key = f"X.Y.{number}"
    return {"id": f"{key}.{day}", "t": key, "r": "X.Y", "n": number, "tt": calls, **more}


def files(folder: Path, trains: object, **more: object) -> Path:
    """Write a timetable with stations and railways beside it."""
    stations = [
        {
            "id": f"X.Y.{name}",
            "coord": [139.0 + 0.02 * number, 35.0],
            "title": {"en": name, "ja": f"{name}駅"},
        }
        for number, name in enumerate(NAMES)
    ]
    line: Entry = {
        "id": "X.Y",
        "title": {"en": "East Line"},
        "stations": [f"X.Y.{name}" for name in NAMES],
    }
    content: Mapping[str, object] = {
        "x-y": trains,
        "stations_few": stations,
        "railways": [line],
        **more,
    }
    folder.mkdir(exist_ok=True)
    for name, data in content.items():
        (folder / f"{name}.json").write_text(json.dumps(data), encoding="utf-8")
    return folder / "x-y.json"


DAY = [
    train("1", (420, 424, 428)),
    train("2", (432, 436, 440), nt=["Z.Q.2.Weekday"]),
    train("3", (440, 444, 448), pt=["Z.Q.3.Weekday"]),
    train("5", (1438, 2, 6)),
    train("9", (480, 484, 488), day="SaturdayHoliday"),
]


@pytest.fixture
def source(tmp_path: Path) -> Path:
    return files(tmp_path / "source", DAY)


def drafted(
    source: Path, *, route: str = "", day: str = "", from_time: str = "", until_time: str = ""
) -> Draft:
    wish = Wish(route=route, day=day, from_time=from_time, until_time=until_time)
    return imported("mini-tokyo-3d", source, wish)


def calls_of(draft: Draft, name: str) -> list[CallRow]:
    found = [row for row in draft.rows["calls.csv"] if isinstance(row, CallRow)]
    return [row for row in found if row.train == name]


def test_trains_of_a_working_day_are_read_and_can_be_run(source: Path, tmp_path: Path) -> None:
    draft = drafted(source)
    write_files(draft.files(), tmp_path / "made")
    scenario = load(tmp_path / "made")
    assert {service.train for service in scenario.timetable.services} == {"1", "2", "3", "5"}
    assert set(draft.settings["controllers"]) == {"close_up", "two_stage", "atc", "atd"}


def test_published_minutes_are_kept(source: Path) -> None:
    calls = calls_of(drafted(source), "1")
    assert [call.departure[:5] for call in calls[:-1]] == ["07:00", "07:04"]
    assert calls[-1].arrival[:5] == "07:08"


def test_after_midnight_hours_go_on(source: Path) -> None:
    calls = calls_of(drafted(source), "5")
    assert [call.departure[:5] for call in calls[:-1]] == ["23:58", "24:02"]


def test_stock_that_turns_back_is_joined_but_not_with_that_of_another_line(source: Path) -> None:
    draft = drafted(source)
    services = [row for row in draft.rows["services.csv"] if isinstance(row, ServiceRow)]
    # Train 2 goes on elsewhere, and train 3 comes from there.
    assert {row.train: row.next_train for row in services if row.next_train} == {"1": "2"}
    assert any("1 trains come and to which 1 go on" in row.what for row in draft.notes.missing)


def test_stock_goes_on_as_the_file_says(tmp_path: Path) -> None:
    trains = [
        train("1", (420, 424, 428), nt=["X.Y.4.Weekday"]),
        train("2", (432, 436, 440)),
        train("4", (440, 444, 448)),
    ]
    draft = drafted(files(tmp_path, trains))
    services = [row for row in draft.rows["services.csv"] if isinstance(row, ServiceRow)]
    assert {row.train: row.next_train for row in services} == {"1": "4", "2": "", "4": ""}


def test_chainage_follows_great_circles(source: Path) -> None:
    draft = drafted(source)
    stations = [row for row in draft.rows["stations.csv"] if isinstance(row, StationRow)]
    # 0.02 degrees of the parallel of 35 degrees: 6371.0088 km x cos(35 deg) x 0.02 x pi / 180.
    assert [row.chainage_km for row in stations] == pytest.approx([0.0, 1.8217, 3.6434], abs=1e-3)
    assert [row.name_local for row in stations] == ["Higashi駅", "Naka駅", "Nishi駅"]


@pytest.mark.parametrize("day", ["holiday", "SaturdayHoliday", "20260531", "20260530"])
def test_other_calendars_are_asked_for_by_name_or_date(source: Path, day: str) -> None:
    assert [row.train for row in drafted(source, day=day).rows["services.csv"]] == ["9"]  # type: ignore[attr-defined]


def test_trains_outside_the_asked_time_are_left_out_and_that_is_told(source: Path) -> None:
    draft = drafted(source, from_time="07:10:00", until_time="07:30:00")
    assert [row.train for row in draft.rows["services.csv"]] == ["2", "3"]  # type: ignore[attr-defined]
    assert any("07:10:00" in row.what for row in draft.notes.missing)


@pytest.mark.parametrize(
    ("wishes", "told"),
    [
        ({"day": "someday"}, "no calendar 'someday'; allowed: --day with"),
        ({"day": "20261399"}, "is no date"),
        ({"from_time": "7 o'clock"}, '--from: "7 o\'clock" is not a time'),
        ({"route": "A.B"}, "no line 'A.B'; allowed: --route with one of X.Y"),
    ],
)
def test_wishes_that_cannot_be_met_are_refused(
    source: Path, wishes: dict[str, str], told: str
) -> None:
    with pytest.raises(SourceError) as refusal:
        drafted(source, **wishes)
    assert told in str(refusal.value)


def wrong(key: str, value: object) -> Entry:
    entry = train("1", (420, 424, 428))
    entry["tt"][1][key] = value
    return entry


@pytest.mark.parametrize(
    ("trains", "told"),
    [
        ({}, "is not a list"),
        ([1], "entry 1: not an object"),
        ([{"r": "X.Y", "id": "a"}], "fewer than two calls"),
        ([wrong("s", "X.Y.Nowhere")], "calls at 'X.Y.Nowhere'"),
        ([wrong("d", "7:61")], "'7:61' is not a time; allowed: HH:MM"),
        ([wrong("d", None)], "no time at 'X.Y.Naka'"),
        ([wrong("d", "06:00")], "is earlier at 'X.Y.Naka'"),
    ],
)
def test_wrong_timetables_are_refused_with_the_place(
    tmp_path: Path, trains: object, told: str
) -> None:
    with pytest.raises(SourceError) as refusal:
        drafted(files(tmp_path, trains))
    assert told in str(refusal.value)


def test_all_mistakes_are_told_at_once(tmp_path: Path) -> None:
    trains = [wrong("d", "7:61"), train("3", (440, 444, 448)) | {"tt": []}]
    with pytest.raises(SourceError) as refusal:
        drafted(files(tmp_path, trains))
    assert len(refusal.value.sentences) >= 2


@pytest.mark.parametrize(
    ("beside", "told"),
    [
        ({"stations_few": [], "railways": []}, "no line 'X.Y'"),
        ({"stations_few": []}, "station 'X.Y.Higashi' is not there"),
        ({"stations_2": []}, "2 files stations*.json beside it"),
        ({"railways": [{"id": "X.Y", "stations": ["X.Y.Naka"]}]}, f"{LINE} has no order"),
        ({"railways": [{"id": "X.Y", "stations": ["X.Y.Naka", 1, "b"]}]}, f"{LINE} has no order"),
        ({"railways": [{"id": "X.Y", "stations": ["X.Y.Naka"] * 2}]}, f"{LINE} calls twice at"),
    ],
)
def test_wrong_files_beside_the_timetable_are_refused(
    tmp_path: Path, beside: dict[str, object], told: str
) -> None:
    with pytest.raises(SourceError) as refusal:
        drafted(files(tmp_path, DAY, **beside))
    assert told in str(refusal.value)


def test_file_that_is_not_json_is_refused(tmp_path: Path) -> None:
    source = files(tmp_path, DAY)
    source.write_text("[{", encoding="utf-8")
    with pytest.raises(SourceError, match=r"x-y\.json: is not JSON"):
        drafted(source)
    with pytest.raises(SourceError, match="cannot be read"):
        drafted(tmp_path / "absent.json")


@pytest.mark.skipif(not PUBLIC.is_dir(), reason="the samples are not part of the project")
def test_enoden_is_found_to_be_single_with_the_loops_that_it_has(tmp_path: Path) -> None:
    source = PUBLIC / "enoden-enoden.json"
    draft = drafted(source, from_time="07:30:00", until_time="08:59:00")
    told = {row.what: row.value for row in draft.notes.assumed}
    assert told["track"] == "single, with loops"
    # Minegahara signal station lies between two stations, 4.7 km along great circles.
    assert told["loops of the single track"] == (
        "kugenuma, enoshima, loop-8 at km 4.732, inamuragasaki, hase"
    )
    write_files(draft.files(), tmp_path / "made")
    assert len(load(tmp_path / "made").timetable.services) == 12


@pytest.mark.skipif(not PUBLIC.is_dir(), reason="the samples are not part of the project")
@pytest.mark.parametrize("name", ["twr-rinkai", "tokyometro-marunouchibranch"])
def test_double_lines_are_found_to_be_double(name: str) -> None:
    draft = drafted(PUBLIC / f"{name}.json", from_time="22:30:00")
    assert {row.what: row.value for row in draft.notes.assumed}["track"] == "double"
    clocks = [row.departure for row in draft.rows["calls.csv"] if isinstance(row, CallRow)]
    assert max(clocks) > "24:00:00"
