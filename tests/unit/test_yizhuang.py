"""The Yizhuang line: what its files hold, and that the tool writes them so."""

import csv
import json
from itertools import pairwise
from pathlib import Path

import pytest

from kankaku.railway.plan.scenario import Scenario
from kankaku.scenarios.loading.load import load
from tests.shared_data import SHARED
from tools.driven_speeds import driven_s, read_style
from tools.yizhuang.__main__ import FOLDER, differing, line_texts, main, timetable_texts
from tools.yizhuang.line import SourceError, read_ttobench, source_tables
from tools.yizhuang.timetable import RUN_ALLOWANCE, UNIT_S, leg_times, read_line_and_train

SOURCE = SHARED / "CN_Songjiazhuang_Yizhuang.json"
PUBLISHED_LEGS_M = (2631, 1275, 2366, 1982, 993, 1538, 1280, 1354, 2338, 2265, 2086, 1281, 1334)
"""Distances between stations, as the operator tells them."""
PUBLISHED_MIN = (33.0, 37.0)
"""End to end: Wikipedia, and the forecast of 2010."""


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load(FOLDER)


def written(stops: int) -> dict[str, object]:
    """Return a track of TTOBench with stops every 1500 m."""
    return {
        "stops": {"unit": "m", "values": [1500.0 * number for number in range(stops)]},
        "speed limits": {
            "units": {"position": "m", "velocity": "km/h"},
            "values": [[0.0, 50], [150.0, 84]],
        },
        "gradients": {"units": {"position": "m", "slope": "permil"}, "values": [[0.0, -2.5]]},
    }


def test_forty_trains_follow_every_120_s_and_call_everywhere(scenario: Scenario) -> None:
    services = scenario.timetable.services
    assert len(services) == 40
    for leader, follower in pairwise(services):
        for first, second in zip(leader.calls, follower.calls, strict=True):
            assert first.station == second.station
            assert second.departure_s - first.departure_s == 120.0
    stations = [station.id for station in scenario.line.stations]
    assert [call.station for call in services[0].calls] == stations
    assert scenario.warnings == ()


def test_stations_lie_where_the_operator_says_but_for_one_that_differs_by_27_m(
    scenario: Scenario,
) -> None:
    places_m = [station.chainage_m for station in scenario.line.stations]
    ours_m = [round(end_m - start_m) for start_m, end_m in pairwise(places_m)]
    apart_m = [ours - theirs for ours, theirs in zip(ours_m, PUBLISHED_LEGS_M, strict=True)]
    assert apart_m == [0, 0, 0, 0, 27, -27, 0, 0, 0, 0, 0, 5, 0]


def test_a_run_end_to_end_takes_as_long_as_published(scenario: Scenario) -> None:
    calls = scenario.timetable.services[0].calls
    least_min, most_min = PUBLISHED_MIN
    assert least_min <= (calls[-1].arrival_s - calls[0].departure_s) / 60.0 <= most_min


def test_run_and_dwell_make_the_public_interval_and_the_train_can_keep_it(
    scenario: Scenario,
) -> None:
    calls = {call.station: call for call in scenario.timetable.services[0].calls}
    for (start, end), leg in leg_times(FOLDER).items():
        run_s = calls[end].arrival_s - calls[start].departure_s
        assert run_s >= RUN_ALLOWANCE * leg.fastest_s
        if leg.interval_s is not None:
            booked_s = calls[end].departure_s - calls[start].departure_s
            assert booked_s == pytest.approx(leg.interval_s, abs=UNIT_S / 2)


def test_driven_speeds_make_runs_as_long_as_booked_where_there_is_time() -> None:
    times = leg_times(FOLDER)
    line, train_type = read_line_and_train(FOLDER)
    style = read_style(FOLDER)
    kept_mps = {one.start_m: one.limit_mps for one in line.driven_speeds}
    assert len(kept_mps) == 11
    for (start, end), leg in zip(pairwise(line.stations), times.values(), strict=True):
        ends_m = start.chainage_m, end.chainage_m
        speed_mps = kept_mps.get(ends_m[0], 80.0 / 3.6)
        run_s = driven_s(line, train_type, style, ends_m, speed_mps)
        if ends_m[0] in kept_mps:
            assert leg.run_s - 3.0 <= run_s <= leg.run_s
        else:
            assert leg.run_s < run_s <= leg.run_s + 10.0


def test_the_shipped_tables_are_those_that_the_tool_writes() -> None:
    assert differing(FOLDER, line_texts(FOLDER, None)) == []
    assert differing(FOLDER, timetable_texts(FOLDER)) == []


@pytest.mark.skipif(not SOURCE.exists(), reason="the source file is not beside the project")
def test_stations_limits_and_gradients_are_those_of_ttobench() -> None:
    assert main(["--check", "--source", str(SOURCE)]) == 0


def test_a_table_that_was_changed_is_named(tmp_path: Path) -> None:
    texts = line_texts(FOLDER, None)
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "blocks.csv").write_text(texts["blocks.csv"].replace("22.", "21."), "utf-8")
    (tmp_path / "tracks.csv").unlink()
    assert differing(tmp_path, texts) == ["tracks.csv", "blocks.csv"]


def test_the_first_and_the_last_stretch_reach_to_the_ends_of_the_line(tmp_path: Path) -> None:
    file = tmp_path / "track.json"
    file.write_text(json.dumps(written(stops=14)), "utf-8")
    tables = source_tables(read_ttobench(file))
    assert tables["limits.csv"][1:] == [[-0.2, 0.15, "50"], [0.15, 19.8, "84"]]
    assert tables["gradients.csv"][1:] == [[-0.2, 19.8, "-2.5"]]
    assert tables["stations.csv"][2][:4] == ["xiaocun", "Xiaocun", "肖村", 1.5]


@pytest.mark.parametrize(
    ("harm", "told"),
    [
        (lambda data: data["stops"]["values"].pop(), "allowed: 14 places in m"),
        (lambda data: data["stops"].update(unit="km"), "allowed: 14 places in m"),
        (lambda data: data["speed limits"]["units"].update(velocity="m/s"), "'velocity': 'km/h'"),
        (lambda data: data.pop("gradients"), "'gradients'"),
    ],
)
def test_another_file_is_refused(tmp_path: Path, harm, told: str) -> None:  # type: ignore[no-untyped-def] # noqa: ANN001
    data = written(stops=14)
    harm(data)
    file = tmp_path / "track.json"
    file.write_text(json.dumps(data), "utf-8")
    with pytest.raises(SourceError, match=told):
        read_ttobench(file)
    assert main(["--source", str(file)]) == 2


def test_blocks_and_circuits_cover_the_track_without_gaps() -> None:
    with (FOLDER / "blocks.csv").open(encoding="utf-8", newline="") as file:
        blocks = list(csv.DictReader(file))
    with (FOLDER / "tracks.csv").open(encoding="utf-8", newline="") as file:
        (track,) = csv.DictReader(file)
    assert (blocks[0]["start_km"], blocks[-1]["end_km"]) == (track["start_km"], track["end_km"])
    for before, after in pairwise(blocks):
        assert before["end_km"] == after["start_km"]
    lengths_m = [1000.0 * (float(b["end_km"]) - float(b["start_km"])) for b in blocks]
    assert 150.0 <= min(lengths_m) <= max(lengths_m) <= 351.0
