"""The figure of a control map: which part it shows, and what belongs to which layer."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.patches import Rectangle

from kankaku.analysis.figures.map_diagram import control_map_figure
from kankaku.analysis.figures.style import write_figure
from kankaku.analysis.publish.study_publishing import publish
from kankaku.analysis.results import run_folder, stations_frame
from kankaku.analysis.tables.map_window import Window, window_of
from kankaku.analysis.tables.run_tables import RunTables, run_tables, write_run
from kankaku.railway.plan.disruptions import Cause
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.obstructions import Obstruction
from kankaku.testing.example_lines import make_scenario
from tests.records import READY_S, Stand, make_record, punctual, run_times_s, three_station_world
from tests.unit.test_control_map_scenario import SCENARIO, TURNOUT, failed, run

STAND: Stand = (2, READY_S + 330.0, 25.0, 950.0, 1)
PLACE_M = 1000.0


@cache
def tables() -> RunTables:
    return run_tables(run("control_map"))


@cache
def window() -> Window:
    found = window_of(tables(), SCENARIO)
    assert found is not None
    return found


def panels() -> list[Axes]:
    figure = control_map_figure(tables(), SCENARIO, stations_frame(SCENARIO.line), window())
    return figure.axes


def small(*obstructions: Obstruction, arrived: bool = True) -> tuple[RunTables, Scenario]:
    world = three_station_world(trains=4)
    arrival_s, departure_s = punctual(world)
    if not arrived:
        arrival_s[:, 1:] = departure_s[:, 1:] = np.nan
    stands = [STAND] if arrived else []
    record = make_record(world, arrival_s, departure_s, stands=stands, obstructions=obstructions)
    scenario = make_scenario(world.line, world.timetable.services)
    return run_tables(record, run_times_s(world, 90.0, 110.0)), scenario


def lasting(start_s: float, end_s: float, established_s: float | None = None) -> Obstruction:
    begun_s = start_s if established_s is None else established_s
    return Obstruction(
        "zone", Cause.WORK, ("main",), PLACE_M, PLACE_M + 50.0, start_s, begun_s, end_s
    )


def test_the_end_of_authority_is_published_and_stays_short_of_what_is_obstructed() -> None:
    samples = tables().trajectory
    during = samples["time_s"].between(window().start_s + 110.0, window().end_s - 170.0)
    own = samples[(samples["train"] == "t5") & during]
    assert len(own) > 60
    assert (own["limit_m"] <= TURNOUT.fouling_start_m).all()
    assert (own["limit_m"] >= own["front_m"] - 1.0).all()


def test_the_map_shows_the_obstruction_that_was_longest_in_the_way() -> None:
    assert window().what.startswith(f"{TURNOUT.id} (points not proven) from 07:07:")
    assert window().what.endswith("in the way of train t5")
    failure = failed(run("control_map"))
    assert window().start_s < failure.requested_s < failure.lifted_s < window().end_s
    assert window().low_m < TURNOUT.fouling_start_m < TURNOUT.fouling_end_m < window().high_m


def test_obstructions_in_nobodys_way_leave_the_worst_moment() -> None:
    # Its train stands 50 m before, for longer than the obstruction lasts.
    run_short, scenario = small(lasting(READY_S + 335.0, READY_S + 350.0))
    found = window_of(run_short, scenario)
    assert found is not None
    assert found.what.startswith("train T3 stands 25 s between stations")
    assert found.low_m < 950.0 < found.high_m


def test_an_obstruction_that_is_never_lifted_is_shown_from_its_beginning() -> None:
    found = window_of(*small(lasting(READY_S + 300.0, np.nan)))
    assert found is not None
    assert "from 07:05:00 to the end" in found.what
    assert found.end_s - found.start_s < 900.0


def test_a_run_in_which_nobody_arrives_has_no_map() -> None:
    assert window_of(*small(arrived=False)) is None


def solid_samples(axes: Axes) -> set[tuple[float, float]]:
    """Return where and when fronts are drawn on the tracks of a panel."""
    points = set()
    for line in axes.get_lines():
        if line.get_linewidth() == 1.5:
            places = np.column_stack([line.get_xdata(), line.get_ydata()])
            points |= {(float(x), float(y)) for x, y in places if np.isfinite(y)}
    return points


@pytest.mark.parametrize(("panel", "track"), [(0, "naka-1"), (1, "naka-2")])
def test_a_train_is_drawn_in_the_layer_of_its_track(panel: int, track: str) -> None:
    section = next(section for section in SCENARIO.line.sections if len(section.tracks) == 2)
    samples = tables().trajectory
    here = samples["time_s"].between(window().start_s, window().end_s) & samples["front_m"].between(
        section.start_m + 1.0, section.end_m - 1.0
    )
    own = samples[here & (samples["track"] == track)]
    expected = set(zip(own["time_s"], own["front_m"], strict=True))
    drawn = {
        (time_s, place_m)
        for time_s, place_m in solid_samples(panels()[panel])
        if section.start_m + 1.0 <= place_m <= section.end_m - 1.0
        and window().start_s <= time_s <= window().end_s
    }
    assert drawn == expected
    assert len(drawn) > 60


def band_m(axes: Axes, shade: str, time_s: float) -> tuple[float, float]:
    """Return from where to where the bands of a colour reach before the points."""
    corners = [
        np.asarray(path.vertices)
        for area in axes.collections
        if to_hex(tuple(np.asarray(area.get_facecolor())[0, :3].tolist())) == shade.lower()
        for path in area.get_paths()
    ]
    places = np.concatenate(corners)
    before = places[:, 1] < TURNOUT.fouling_start_m
    at = places[before & (np.abs(places[:, 0] - time_s) < 0.25), 1]
    return float(at.min()), float(at.max())


def test_a_band_reaches_from_the_tail_three_seconds_ago_to_the_end_of_authority() -> None:
    own = tables().trajectory
    own = own[own["train"] == "t5"]
    times_s, fronts_m = own["time_s"].to_numpy(), own["front_m"].to_numpy()
    now = int(np.searchsorted(times_s, 25_780.0))
    # Everybody else of its colour has long passed the points.
    low_m, high_m = band_m(panels()[0], "#009E73", float(times_s[now]))
    assert low_m == pytest.approx(fronts_m[now - 3] - 200.0, abs=0.01)
    assert high_m == pytest.approx(own["limit_m"].to_numpy()[now], abs=0.01)


def test_obstructions_are_rectangles_in_all_their_layers() -> None:
    main, second = panels()
    assert main.get_title("left") == "main tracks"
    assert second.get_title("left") == "track naka-2"
    found = tables().obstructions
    seen = found[(found["lifted_s"] > window().start_s) & (found["requested_s"] < window().end_s)]
    boxes = {
        axes: sorted(
            (box.get_x(), box.get_y(), box.get_width())
            for box in axes.patches
            if isinstance(box, Rectangle)
        )
        for axes in (main, second)
    }
    points = seen[seen["cause"] == "points"]
    assert len(boxes[second]) == len(points)
    assert len(boxes[main]) == len(points) + int((seen["cause"] == "work").sum())
    failure = points[points["lifted_s"] - points["requested_s"] > 60.0].iloc[0]
    wide = [box for box in boxes[second] if box[2] > 60.0]
    assert wide == [
        pytest.approx(
            (
                failure["requested_s"],
                TURNOUT.fouling_start_m,
                failure["lifted_s"] - failure["requested_s"],
            )
        )
    ]


def test_what_is_requested_but_not_established_is_not_hatched() -> None:
    requested_s, established_s, lifted_s = READY_S + 300.0, READY_S + 320.0, READY_S + 380.0
    made, scenario = small(lasting(requested_s, lifted_s, established_s))
    shown = window_of(made, scenario)
    assert shown is not None
    (axes,) = control_map_figure(made, scenario, stations_frame(scenario.line), shown).axes
    boxes = [box for box in axes.patches if isinstance(box, Rectangle)]
    spans = {bool(box.get_hatch()): (box.get_x(), box.get_width()) for box in boxes}
    assert spans == {
        False: (requested_s, established_s - requested_s),
        True: (established_s, lifted_s - established_s),
    }


def test_the_legend_names_the_causes_that_are_seen(tmp_path: Path) -> None:
    figure = control_map_figure(tables(), SCENARIO, stations_frame(SCENARIO.line), window())
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names[:3] == [
        "front of a train",
        "on another track",
        "its band: tail 3 s ago to end of authority",
    ]
    assert set(names[3:]) == {"points not proven", "work zone"}
    files = write_figure(figure, tmp_path / "control_map")
    assert all(file.stat().st_size > 10_000 for file in files)


@pytest.mark.figures
@pytest.mark.parametrize("by_radio", [(), ("close_up",)])
def test_controllers_by_radio_have_a_map_in_their_folders(
    tmp_path: Path, by_radio: tuple[str, ...]
) -> None:
    made, scenario = small()
    write_run(made, run_folder(tmp_path, "close_up", made.seed, seeds=1))
    publish(tmp_path, scenario, [made], {}, by_radio=by_radio)
    assert (tmp_path / "close_up" / "control_map.png").is_file() == bool(by_radio)
    report = (tmp_path / "report.md").read_text("utf-8")
    assert ("(close_up/control_map.png)" in report) == bool(by_radio)
