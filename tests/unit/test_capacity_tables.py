"""Capacity of the small scenario: tables, figures, and the two trains that check it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kankaku.analysis.figures.capacity_diagram import MARKERS, TARGETS, capacity_figure
from kankaku.analysis.figures.capacity_stairway import MOST_PANELS, stairway_figure
from kankaku.analysis.figures.style import colour, write_figure
from kankaku.analysis.results import stations_frame
from kankaku.analysis.tables.capacity_tables import (
    BLOCKING_TIMES,
    CAPACITY,
    HEADWAYS,
    LEVELS,
    CapacityAssessment,
    blocking_times_frame,
    capacity_frame,
    distinct,
    headways_frame,
    level_of,
)
from kankaku.analysis.texts.capacity_texts import headway_texts
from kankaku.railway.capacity.blocking_time import Headway
from kankaku.studies import study
from kankaku.studies.capacity_study import assess_by_theory
from kankaku.studies.two_trains import least_free, two_trains
from tests.cli.command import two_controllers

ATD = """
[controllers.atd]
protection = "atd"
operation = "close_up"
"""


@pytest.fixture(scope="module")
def chosen(tmp_path_factory: pytest.TempPathFactory) -> study.Study:
    folder = two_controllers(tmp_path_factory.mktemp("capacity") / "small")
    with (folder / "scenario.toml").open("a", encoding="utf-8") as file:
        file.write(ATD)
    return study.choose(folder)


@pytest.fixture(scope="module")
def found(chosen: study.Study) -> tuple[CapacityAssessment, ...]:
    return tuple(assess_by_theory(chosen, spec) for spec in chosen.specs)


@pytest.mark.parametrize(
    ("capacity", "level"),
    [(749.9, ""), (750.0, "A"), (1499.0, "A"), (1600.0, "B"), (2250.0, "C"), (5000.0, "D")],
)
def test_levels_are_those_of_the_paper(capacity: float, level: str) -> None:
    assert level_of(capacity) == level


def test_the_targets_of_the_paper_reach_their_levels() -> None:
    for name, speed_kmh, headways_s in TARGETS:
        assert speed_kmh * 3600.0 / min(headways_s) >= LEVELS[name]


def test_headways_have_a_row_per_station_and_the_margin_to_the_least_booked_interval(
    chosen: study.Study, found: tuple[CapacityAssessment, ...]
) -> None:
    frame = headways_frame(found, chosen.scenario.timetable)
    assert list(frame.columns) == [column.name for column in HEADWAYS]
    own = frame[frame["controller"] == "plain"].set_index("station")
    assert list(own.index) == ["middle", "last"]
    # At the last station A1 departs at 07:05:30, B2 at 07:07:30; at its own track of the middle
    # one A1 departs at 07:03:00 and C3 at 07:08:00.
    assert own["booked_interval_s"].tolist() == [300.0, 120.0]
    margin_s = own["booked_interval_s"] - own["headway_s"]
    assert own["headway_margin_s"].tolist() == pytest.approx(margin_s.tolist(), abs=0.002)
    assert own["simulated_headway_s"].isna().all()
    assert own["headway_s"].equals(own["blocking_time_headway_s"])
    assert set(own["dwell_s"]) == {30.0}
    atd = frame[frame["controller"] == "atd"].set_index("station")
    assert (atd["headway_s"] > own["headway_s"]).all()
    assert set(atd["critical_block"]) <= {"n1", "n2", "m1", "s1", "s2"}


def test_capacity_is_scheduled_speed_times_trains_per_hour(
    found: tuple[CapacityAssessment, ...],
) -> None:
    frame = capacity_frame(found)
    assert list(frame.columns) == [column.name for column in CAPACITY]
    row = frame.iloc[0]
    assert row["trains_per_hour"] == pytest.approx(3600.0 / row["headway_s"], abs=1e-3)
    journey = found[0].journey
    taken_s = journey.arrival_s[-1] - journey.departure_s[0]
    assert row["scheduled_speed_kmh"] == pytest.approx(3.6 * 3000.0 / taken_s, abs=1e-3)
    product = row["trains_per_hour"] * row["scheduled_speed_kmh"]
    assert row["transport_capacity"] == pytest.approx(product, abs=0.1)
    # Three trains; A1 arrives at the last station at 07:05:00, C3 at 07:10:00.
    assert row["booked_s"] == 300.0
    assert row["occupation_percent"] == pytest.approx(row["compressed_s"] / 3.0, abs=0.001)
    assert row["busiest_trains"] == 3


def test_blocking_times_name_every_block_that_the_train_needs(
    found: tuple[CapacityAssessment, ...],
) -> None:
    frame = blocking_times_frame(found)
    assert list(frame.columns) == [column.name for column in BLOCKING_TIMES]
    assert (frame["end_s"] > frame["begin_s"]).all()
    atd = frame[frame["controller"] == "atd"]
    assert atd["block"].tolist() == ["n1", "n2", "m1", "s1", "s2"]
    plain = frame[frame["controller"] == "plain"]
    assert plain["block"].tolist()[:2] == ["km -0.200", "km -0.150"]


def test_controllers_over_one_protection_share_a_column(
    chosen: study.Study, found: tuple[CapacityAssessment, ...]
) -> None:
    # The second controller has the default margin of 25 m, the first one 10 m.
    assert [len(group) for group in distinct(found)] == [1, 1, 1]
    twin = replace(found[0], controller="twin", simulated_s=np.array([80.0, np.nan]))
    assert [len(group) for group in distinct((*found, twin))] == [2, 1, 1]
    frame = headways_frame((found[0], twin), chosen.scenario.timetable)
    names = {"middle": "Middle", "last": "Last"}
    header, rows, notes = headway_texts(frame, names)
    assert header == ["station", "dwell [s]", "plain"]
    assert [row[0] for row in rows] == ["Middle", "Last"]
    assert notes == ["As plain: twin"]
    header, rows, _ = headway_texts(headways_frame([twin], chosen.scenario.timetable), names)
    assert rows[0][2].endswith("(80.0)")
    # The simulated one counts, where there is one.
    assert twin.headways_s[0] == twin.headway_s == 80.0
    row = capacity_frame([twin]).iloc[0]
    assert (row["headway_s"], row["trains_per_hour"]) == (80.0, 45.0)
    assert row["blocking_time_headway_s"] == pytest.approx(found[0].headway_s, abs=1e-3)


def test_the_diagram_has_the_levels_the_targets_and_a_point_per_protection(
    found: tuple[CapacityAssessment, ...], tmp_path: Path
) -> None:
    figure = capacity_figure(found, title="Small")
    axes = figure.axes[0]
    points = [line for line in axes.lines if line.get_marker() == MARKERS[0]]
    assert {line.get_color() for line in points} == {colour(number) for number in range(3)}
    places = sorted(float(np.asarray(line.get_ydata())[0]) for line in points)
    assert places == pytest.approx(sorted(3600.0 / one.headway_s for one in found))
    told = [text.get_text() for text in axes.texts]
    assert {"A  750", "B  1,500", "C  2,250", "D  3,000"} <= set(told)
    assert any(text.startswith("plain: ") for text in told)
    assert figure.axes[1].get_ylabel() == "headway [s]"
    for name in ("first", "second"):
        write_figure(capacity_figure(found, title="Small"), tmp_path / name)
    assert (tmp_path / "first.svg").read_bytes() == (tmp_path / "second.svg").read_bytes()


def test_the_stairway_has_a_panel_per_protection_and_the_trains_touch(
    chosen: study.Study, found: tuple[CapacityAssessment, ...], tmp_path: Path
) -> None:
    stations = stations_frame(chosen.scenario.line)
    figure = stairway_figure(found, stations, title="Small")
    titles = [axes.get_title("left") for axes in figure.axes]
    assert titles[:3] == ["plain", "second", "atd"]
    assert "s by blocking times, at " in figure.axes[0].get_title("right")
    write_figure(figure, tmp_path / "stairway")
    assert (tmp_path / "stairway.png").stat().st_size > 10_000
    many = [
        replace(found[0], controller=f"c{number}", headways=_longer(found[0].headways, number))
        for number in range(6)
    ]
    assert len(stairway_figure(many, stations, title="Many").axes) == MOST_PANELS


def _longer(headways: tuple[Headway, ...], by_s: float) -> tuple[Headway, ...]:
    return tuple(one._replace(headway_s=one.headway_s + by_s) for one in headways)


def test_two_trains_call_before_at_and_behind_the_station(
    chosen: study.Study, found: tuple[CapacityAssessment, ...]
) -> None:
    pair = two_trains(chosen.scenario, 0, found[0].journey, 1, 90.0)
    first, second = pair.timetable.services
    assert [call.station for call in first.calls] == ["first", "middle", "last"]
    assert first.route == second.route == chosen.scenario.timetable.services[0].route
    for before, after in zip(first.calls, second.calls, strict=True):
        assert after.departure_s - before.departure_s == 90.0
    run_s = found[0].journey.arrival_s[1] - found[0].journey.departure_s[0]
    assert first.calls[1].arrival_s - first.calls[0].departure_s == pytest.approx(run_s)
    last = two_trains(chosen.scenario, 0, found[0].journey, 2, 90.0)
    assert [call.station for call in last.timetable.services[0].calls] == ["middle", "last"]
    assert last.timetable.services[0].route == ("middle-1", "south-1")


@pytest.mark.parametrize("guess", [1, 7, 40, 41, 42, 90, 300])
def test_the_search_finds_the_least_interval_from_any_guess(guess: int) -> None:
    asked: list[int] = []

    def is_free(units: int) -> bool:
        asked.append(units)
        return units >= 41

    assert least_free(is_free, guess, 1000) == 41
    assert min(asked) >= 1


def test_the_search_gives_up_where_no_interval_is_free() -> None:
    assert least_free(lambda _: False, 41, 1000) is None
