"""Figures: what they choose to show, and that they can be drawn."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest

from kankaku.analysis.figures.style import spread, write_figure
from kankaku.analysis.figures.time_distance import time_distance_figure
from kankaku.analysis.figures.zoom import zoom_figure
from kankaku.analysis.results import stations_frame
from kankaku.analysis.tables.run_tables import RunTables, run_tables
from kankaku.analysis.tables.worst import worst_moment
from kankaku.analysis.words import clock
from tests.records import READY_S, Stand, make_record, punctual, run_times_s, three_station_world


def run_with(*stands: Stand, controller: str = "close_up", late_s: float = 0.0) -> RunTables:
    world = three_station_world(trains=4)
    arrival_s, departure_s = punctual(world)
    arrival_s[2, 2] += late_s
    record = make_record(world, arrival_s, departure_s, stands=stands, controller=controller)
    return run_tables(record, run_times_s(world, 90.0, 110.0))


SHORT: Stand = (1, READY_S + 200.0, 10.0, 900.0, 1)
LONG: Stand = (2, READY_S + 330.0, 25.0, 950.0, 1)


def test_the_worst_moment_is_the_longest_stop_between_stations() -> None:
    worst = worst_moment(run_with(SHORT, LONG))
    assert worst is not None
    assert (worst.train, worst.station) == ("T3", "mid")
    assert (worst.start_s, worst.end_s) == (READY_S + 330.0, READY_S + 355.0)


def test_without_stops_the_worst_moment_is_where_a_train_loses_most_to_others() -> None:
    worst = worst_moment(run_with(late_s=45.0))
    assert worst is not None
    assert (worst.train, worst.station) == ("T3", "east")
    assert worst.what == "loses 45 s to trains ahead"


@pytest.mark.parametrize("count", [1, 2, 3])
def test_figures_are_written_as_png_and_svg(tmp_path: Path, count: int) -> None:
    stations = stations_frame(three_station_world().line)
    runs = [run_with(SHORT, LONG, controller=f"controller_{n}") for n in range(count)]
    before = dict(mpl.rcParams)
    figure = time_distance_figure(runs, stations, title="Example")
    files = [
        *write_figure(figure, tmp_path / "time_distance"),
        *write_figure(zoom_figure(runs, stations), tmp_path / "zoom"),
    ]
    assert [file.name for file in files] == [
        "time_distance.png",
        "time_distance.svg",
        "zoom.png",
        "zoom.svg",
    ]
    assert all(file.stat().st_size > 10_000 for file in files)
    assert dict(mpl.rcParams) == before


def test_every_controller_has_a_panel_with_its_name_and_its_stops() -> None:
    stations = stations_frame(three_station_world().line)
    runs = [run_with(SHORT, LONG), run_with(controller="two_stage")]
    panels = time_distance_figure(runs, stations, title="Example").axes
    assert [axes.get_title("left") for axes in panels] == ["close up", "two stage"]
    assert [axes.get_title("right") for axes in panels] == [
        "2 stops between stations, 35 s",
        "no stop between stations",
    ]


def test_a_clock_shows_hours_and_minutes() -> None:
    assert clock(7 * 3600.0 + 5 * 60.0) == "07:05"
    assert clock(24 * 3600.0 + 59.6, seconds=True) == "00:01:00"


def test_station_names_move_apart_only_where_they_would_overlap() -> None:
    assert spread(np.array([0.0, 10.0, 11.0, 30.0]), 3.0).tolist() == [0.0, 9.0, 12.0, 30.0]
