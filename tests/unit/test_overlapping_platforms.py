"""Platforms that overlap on a track: marks of long and short trains, stations close together."""

from pathlib import Path

import pandas as pd
import pytest

import kankaku
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.asking import Check
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import ScenarioError
from kankaku.studies.capacity_study import run_capacity
from kankaku.sumo_net.edge_cuts import cut_tracks, edge_of_stop
from tests.networks import CALL, LOOP, Files, dwells, mistakes_of, stations, write
from tests.unit.scenario_folder import replace, write_scenario

LAST_M, HALT_M = 3000.0, 3100.0
STEP_S = 0.5
OVERSTAY = 'station = "halt"\ndelay_s = 400.0'
EXCLUSIVE = "margin_m = 10.0\nexclusive_platform = true"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return the small scenario with a halt 100 m beyond the last station, for trains of 200 m."""
    folder = write_scenario(tmp_path / "small")
    for file, row in {
        "stations.csv": "halt,Halt,停,3.1,139.8,35.7\n",
        "platforms.csv": "halt,south-1,2.895,3.105,3.1\n",
        "dwell_stations.csv": "halt,20,30,1.0\n",
    }.items():
        with (folder / file).open("a", encoding="utf-8") as opened:
            opened.write(row)
    for train, minute in (("A1", 5), ("C3", 10)):
        last = f"{train},last,south-1,07:{minute:02d}:00,07:{minute:02d}:30\n"
        halt = f"{train},halt,south-1,07:{minute + 1:02d}:00,07:{minute + 1:02d}:30\n"
        replace(folder, "calls.csv", last, last + halt)
    return folder


def calls_of(run: RunTables, train: str) -> pd.DataFrame:
    return run.calls[run.calls["train"] == train].set_index("station")


def test_a_train_alone_stops_at_its_own_marks_and_never_crawls(folder: Path) -> None:
    run = kankaku.run_once(folder, "moving_block+close_up")
    assert run.violations.empty
    assert run.unfinished.empty
    calls = calls_of(run, "A1")
    scenario = load(folder)
    leg = kankaku.fastest_run(scenario.line, scenario.train_types["unit"], LAST_M, HALT_M)
    took_s = calls["arrival_s"]["halt"] - calls["departure_s"]["last"]
    assert took_s == pytest.approx(leg.run_time_s, abs=2.0 * STEP_S)
    seconds = run.trajectory[run.trajectory["train"] == "A1"]
    stands_m = seconds[seconds["reason"] == "dwelling"]["front_m"]
    for mark_m in (LAST_M, HALT_M):
        assert ((stands_m - mark_m).abs() < 0.5).any()
    crawl_s = run.energy.set_index("train")["interstation_crawl_time_s"]
    assert crawl_s["A1"] == 0.0
    assert not (run.interstation_stops["train"] == "A1").any()


@pytest.mark.parametrize("operation", ["close_up", "two_stage", "approach_point"])
def test_trains_in_overlapping_platform_sections_are_kept_apart(
    folder: Path, operation: str
) -> None:
    replace(folder, "scenario.toml", 'station = "middle"\ndelay_s = 90.0', OVERSTAY)
    replace(folder, "scenario.toml", "margin_m = 10.0", EXCLUSIVE)
    replace(folder, "scenario.toml", 'operation = "close_up"', f'operation = "{operation}"')
    run = kankaku.run_once(folder, "plain")
    assert run.violations.empty
    assert run.unfinished.empty
    # The tail of a train at the halt, at 2,900 m, is in the platform before it, too.
    behind = calls_of(run, "C3")["arrival_s"]["last"]
    assert behind > calls_of(run, "A1")["departure_s"]["halt"]


def test_who_stands_in_both_sections_follows_as_blocking_times_say(
    folder: Path, tmp_path: Path
) -> None:
    replace(folder, "scenario.toml", "margin_m = 10.0", EXCLUSIVE)
    run_capacity(kankaku.choose(folder, names=["plain"]), tmp_path / "out", Check.ALL)
    headways = pd.read_csv(tmp_path / "out" / "small_capacity" / "headways.csv")
    halt = headways[headways["station"] == "halt"]
    assert len(halt)
    off_s = halt["simulated_headway_s"] - halt["blocking_time_headway_s"]
    assert off_s.abs().max() < 2.0 * STEP_S


CLOSE: Files = {
    **LOOP,
    "stations.csv": stations(a=0.0, h=0.1, m=1.0, b=2.0),
    "dwell_stations.csv": dwells("a", "h", "m", "b"),
    "calls.csv": CALL
    + """\
r1,a,left,07:00:00,07:01:00
r1,h,left,07:01:30,07:01:50
r1,m,up,07:03:10,07:03:40
r1,b,right,07:05:20,07:05:40
f1,b,right,07:00:00,07:01:00
f1,m,down,07:02:40,07:03:40
f1,h,left,07:05:10,07:05:30
f1,a,left,07:06:00,07:06:20
f2,b,right,07:05:40,07:07:00
f2,m,down,07:08:40,07:09:00
f2,a,left,07:10:40,07:11:00
""",
}
"""A halt for trains of 100 m, 100 m behind the first station."""
A = "a,left,-0.11,0.01,0.0"


def test_in_a_network_the_ends_of_platforms_move_no_train(tmp_path: Path) -> None:
    """End to end or overlapping: the same times in both directions, and no crawl."""
    runs = [
        kankaku.run_once(write(tmp_path / name, CLOSE, platforms=platforms), "close_up")
        for name, platforms in (
            (
                "apart",
                LOOP["platforms.csv"].replace(A, "a,left,-0.1,0.0,0.0") + "h,left,0.0,0.1,0.1\n",
            ),
            (
                "over",
                LOOP["platforms.csv"].replace(A, "a,left,-0.12,0.02,0.0")
                + "h,left,-0.02,0.12,0.1\n",
            ),
        )
    ]
    assert all(run.violations.empty and run.unfinished.empty for run in runs)
    rising = [calls_of(run, "r1")["arrival_s"] for run in runs]
    assert rising[0].equals(rising[1])
    assert runs[1].energy["interstation_crawl_time_s"].max() == 0.0


def test_marks_in_another_order_than_their_stations_are_refused(tmp_path: Path) -> None:
    # Falling trains stop as far from the other end: at km 0.4 for a, at -0.01 for the halt.
    mixed = LOOP["platforms.csv"].replace(A, "a,left,-0.11,0.51,0.0") + "h,left,-0.02,0.11,0.1\n"
    found = mistakes_of(tmp_path, CLOSE, platforms=mixed)
    assert [mistake.where for mistake in found] == ["row 2, column station"]
    assert found[0].problem == "station 'a' comes before 'h' of row 6"
    assert "in the order of their stations" in found[0].allowed


@pytest.mark.parametrize("stop_km", ["3.0", "3.0009"])
def test_two_stops_at_one_place_of_a_track_are_refused(folder: Path, stop_km: str) -> None:
    replace(folder, "platforms.csv", "2.895,3.105,3.1", f"2.795,3.105,{stop_km}")
    with pytest.raises(ScenarioError, match=r"column stop_km: trains stop at 3.*0\.001 km apart"):
        load(folder)


def test_a_signal_between_two_marks_moves_past_both(folder: Path) -> None:
    replace(folder, "platforms.csv", "2.895,3.105,3.1", "2.795,3.005,3.001")
    replace(folder, "blocks.csv", "s1,south-1,1.6,2.5\ns2,south-1,2.5,3.5", SIGNAL_BETWEEN)
    edges = cut_tracks(load(folder).line)
    first, second = (edge_of_stop(edges, "south-1", mark_m) for mark_m in (3000.0, 3001.0))
    assert first == second
    assert first.end_m == 3002.0


SIGNAL_BETWEEN = "s1,south-1,1.6,3.0005\ns2,south-1,3.0005,3.5"
