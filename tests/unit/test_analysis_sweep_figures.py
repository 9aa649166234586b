"""Figures of a sweep: what they draw, mark and name."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Annotation

from kankaku.analysis.figures.interval_diagram import interval_figure
from kankaku.analysis.figures.speed_distance import (
    Panel,
    SpeedCurve,
    follower_panels,
    speed_distance_figure,
)
from kankaku.analysis.figures.style import colour, write_figure
from kankaku.analysis.tables.sweep import SweepTables, sweep_frame
from kankaku.railway.plan.scenario import Sweep
from tests.records import STOPS_M, three_station_world
from tests.unit.test_analysis_sweep import DELAYS_S, SWEEP, at_least, frame, swept_run

STATIONS = pd.DataFrame({"station": ["west", "mid"], "name": ["West", "Mid"]})
CHAINAGE_M = np.array([300.0, 800.0, 1300.0])


def drawn(intervals: pd.DataFrame, **published: float) -> Axes:
    tables = SweepTables(
        Sweep("T1", "mid", tuple(DELAYS_S)), None, intervals, sweep_frame(intervals, published)
    )
    return interval_figure(tables, STATIONS).axes[0]


def texts(axes: Axes) -> list[str]:
    return [text.get_text() for text in axes.texts if text.get_text()]


def arrows(axes: Axes) -> list[Annotation]:
    return [text for text in axes.texts if isinstance(text, Annotation) and text.arrow_patch]


def test_every_controller_has_a_line_in_its_colour_and_its_name_beside_it() -> None:
    axes = drawn(frame(close_up=at_least(55.0), atd=at_least(51.1)))
    assert [line.get_color() for line in axes.lines] == [colour(0), colour(1)]
    assert np.array_equal(np.asarray(axes.lines[1].get_ydata()), at_least(51.1))
    assert {"close up", "atd"} <= set(texts(axes))
    assert "train T1 at Mid [s]" in axes.get_xlabel()


def test_an_arrow_spans_the_greatest_shortening_from_line_to_line() -> None:
    # The baseline is 0.2 s longer from 20 s on.
    rising = at_least(55.0) + np.where(DELAYS_S >= 20.0, 0.2, 0.0)
    axes = drawn(frame(close_up=rising, two_stage=at_least(53.0), atd=at_least(51.1)))
    (arrow,) = arrows(axes)
    assert arrow.xy == pytest.approx((20.0, 51.1))
    assert arrow.xyann == pytest.approx((20.0, 55.2))
    assert "4.1 s" in texts(axes)


def test_without_a_shortening_there_is_no_arrow() -> None:
    assert not arrows(drawn(frame(close_up=at_least(55.0), atd=at_least(56.0))))
    assert not arrows(drawn(frame(close_up=at_least(55.0))))


def test_the_published_interval_is_a_line_across_with_its_value() -> None:
    intervals = frame(close_up=at_least(55.0), atd=at_least(51.5))
    axes = drawn(intervals, shortest_interval_s=51.1)
    assert np.asarray(axes.lines[2].get_ydata()).tolist() == [51.1, 51.1]
    assert "published shortest interval, 51.1 s" in texts(axes)
    assert len(drawn(intervals).lines) == 2


def curves(*speeds_mps: float) -> list[SpeedCurve]:
    return [
        SpeedCurve(f"{speed:g}", CHAINAGE_M, np.array([0.0, speed, 0.0])) for speed in speeds_mps
    ]


def legend_of(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_run_curves_are_drawn_in_kilometres_and_kilometres_per_hour() -> None:
    figure = speed_distance_figure([Panel("close_up", curves(20.0))], title="Computed")
    (line,) = figure.axes[0].lines
    assert np.asarray(line.get_xdata()).tolist() == [0.3, 0.8, 1.3]
    assert np.asarray(line.get_ydata()).tolist() == [0.0, 72.0, 0.0]
    assert legend_of(figure) == ["20"]


def test_curves_of_one_label_have_one_colour_in_all_panels() -> None:
    panels = [Panel("close_up", curves(10.0, 20.0), (1090.0, 1310.0)), Panel("atd", curves(20.0))]
    figure = speed_distance_figure(panels, title="Two", legend="delay")
    first, second = figure.axes
    assert first.lines[1].get_color() == second.lines[0].get_color()
    assert to_hex(first.lines[0].get_color()) != to_hex(first.lines[1].get_color())
    assert [axes.get_title("left") for axes in figure.axes] == ["close up", "atd"]
    assert legend_of(figure) == ["10", "20", "platform"]


def test_no_panels_are_refused() -> None:
    with pytest.raises(ValueError, match="no run curves"):
        speed_distance_figure([], title="None")


def test_the_next_train_is_drawn_from_its_call_before_to_the_swept_station() -> None:
    line = three_station_world().line
    runs = [swept_run(0.0), swept_run(20.0), swept_run(0.0, "atd")]
    panels = follower_panels(runs, SWEEP, line)
    assert [panel.title for panel in panels] == ["close_up", "atd"]
    assert [curve.label for curve in panels[0].curves] == ["0 s", "20 s"]
    curve = panels[0].curves[0]
    assert (curve.chainage_m[0], curve.chainage_m[-1]) == (STOPS_M["west"], STOPS_M["mid"])
    assert (np.diff(curve.chainage_m) >= 0.0).all()
    assert curve.speed_mps[0] == curve.speed_mps[-1] == 0.0
    # A smooth step over 1000 m in 100 s is fastest half-way, at 1.5 times the mean speed.
    assert curve.speed_mps.max() == pytest.approx(15.0, abs=0.01)
    platform = next(place for place in line.platforms if place.station == "mid")
    assert panels[0].platform_m == (platform.start_m, platform.end_m)


def test_a_next_train_that_never_arrives_has_no_curve() -> None:
    line = three_station_world().line
    (panel,) = follower_panels([swept_run(0.0)], Sweep("T3", "mid", (0.0,)), line)
    assert not panel.curves
    assert speed_distance_figure([panel], title="Nothing").axes[0].get_title("left") == "close up"


def test_a_sweeps_figures_are_the_same_bytes_every_time(tmp_path: Path) -> None:
    for name in ("first", "second"):
        axes = drawn(frame(close_up=at_least(55.0), atd=at_least(51.1)), shortest_interval_s=51.1)
        figure = axes.get_figure()
        assert isinstance(figure, Figure)
        write_figure(figure, tmp_path / name)
    for kind in ("png", "svg"):
        first, second = (tmp_path / f"{name}.{kind}" for name in ("first", "second"))
        assert first.read_bytes() == second.read_bytes()
