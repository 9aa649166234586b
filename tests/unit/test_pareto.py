"""Who beats whom in stops, delay and energy, and the figure that shows it."""

from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes

from kankaku.analysis.figures.pareto_figure import free_offset, pareto_figure
from kankaku.analysis.tables.across_tables import across_frame
from kankaku.analysis.tables.columns import rows_frame
from kankaku.analysis.tables.compare import comparison
from kankaku.analysis.tables.pareto import best_controllers, non_dominated
from kankaku.analysis.tables.summary import SUMMARY
from kankaku.analysis.texts.across_texts import across_lines, across_note, across_report
from kankaku.analysis.texts.comparison_texts import comparison_texts

CHANGES = {
    "plain": (0.0, 0.0, 0.0),
    "early": (-70.0, 2.0, -20.0),
    "mapped": (-60.0, 8.0, -60.0),
    "planner": (-85.0, 0.3, -50.0),
    "oracle": (-99.0, 0.1, -20.0),
}
"""Stop time [s], mean delay [s] and energy [kWh] less than a plain run's."""


def summary(changes: dict[str, tuple[float, float, float]] = CHANGES) -> pd.DataFrame:
    """Return two seeds of each controller; the second one is a little worse."""
    plain: dict[str, object] = {
        column.name: "" if column.dtype == "str" else 0 for column in SUMMARY
    }
    rows = [
        {
            **plain,
            "controller": name,
            "seed": seed,
            "interstation_stop_time_s": 100.0 + stops + 0.1 * seed,
            "interstation_crawl_time_s": 120.0 + stops + 0.1 * seed,
            "mean_arrival_delay_s": 20.0 + seed + delay,
            "mean_delay_bound_s": 19.0 + seed,
            "energy_net_kwh": 1000.0 + energy + seed,
        }
        for name, (stops, delay, energy) in changes.items()
        for seed in (1, 2)
    ]
    return rows_frame(rows, SUMMARY)


def table(scenarios: int = 1) -> pd.DataFrame:
    names = [f"line_{number}" for number in range(scenarios)]
    return across_frame(dict.fromkeys(names, summary()), list(CHANGES), ["oracle"])


@pytest.fixture(scope="module")
def delay() -> Axes:
    """Return the uppermost panel."""
    return pareto_figure(table()).axes[0]


def test_a_point_is_dominated_by_one_that_is_nowhere_worse_and_somewhere_better() -> None:
    points = np.array([[1.0, 5.0], [2.0, 4.0], [2.0, 5.0], [1.0, 5.0], [np.nan, 0.0]])
    # Equal points do not beat each other, and what is not known beats nobody.
    assert non_dominated(points).tolist() == [True, True, False, True, False]


def test_who_knows_the_future_or_is_unsafe_does_not_compete() -> None:
    found = table()
    # The planner beats early in all three; the oracle would have beaten the planner in two.
    assert best_controllers(found) == ["plain", "mapped", "planner"]
    found.loc[found["controller"] == "mapped", "violations"] = 1
    assert best_controllers(found) == ["plain", "planner"]


def test_the_figure_shows_every_controller_in_every_panel() -> None:
    figure = pareto_figure(table(scenarios=2))
    assert len(figure.axes) == 6
    for axes in figure.axes:
        assert [text.get_text() for text in axes.texts] == ["1", "2", "3", "4", "5"]
    (legend,) = figure.legends
    told = [text.get_text() for text in legend.get_texts()]
    assert told[:5] == ["1  plain", "2  early", "3  mapped", "4  planner", told[4]]
    assert told[4] == "5  oracle (knows the future)"


def test_the_line_joins_those_that_none_beats_in_a_panel(delay: Axes) -> None:
    joined = next(line for line in delay.lines if line.get_linestyle() == "-")
    # Planner and plain run: both more stops and more delay have early and mapped.
    assert np.asarray(joined.get_xdata()).tolist() == pytest.approx([-85.0, 0.0], rel=0.01)
    assert np.asarray(joined.get_ydata()).tolist() == pytest.approx([0.3, 0.0])


def test_below_each_delay_stands_its_bound(delay: Axes) -> None:
    bars = [line for line in delay.lines if line.get_marker() == "_"]
    # 1 s below the plain run, whatever the controller.
    assert [float(np.asarray(bar.get_ydata())[0]) for bar in bars] == pytest.approx([-1.0] * 5)


@pytest.mark.parametrize("controllers", [3, 15])
def test_numbers_do_not_cover_each_other(controllers: int) -> None:
    changes = {
        f"c{number}": (-6.5 * number, 0.4 * (number % 5), -9.0 * (number * 7 % 15))
        for number in range(controllers)
    }
    found = across_frame({"line": summary(changes)}, list(changes))
    figure = pareto_figure(found)
    figure.draw_without_rendering()
    for axes in figure.axes:
        boxes = [text.get_window_extent() for text in axes.texts]
        assert len(boxes) == controllers
        assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))


def test_a_label_goes_where_nothing_is() -> None:
    centre, frame = np.array([50.0, 50.0]), np.array([0.0, 0.0, 100.0, 100.0])
    above = np.array([[0.0, 52.0, 100.0, 100.0]])
    x, y = free_offset(centre, (6.0, 6.0), above, frame)
    assert y <= -1.0 or abs(x) > 0.0
    assert 50.0 + y + 3.0 <= 52.0
    corner = free_offset(np.array([99.0, 99.0]), (6.0, 6.0), above[:0].reshape(0, 4), frame)
    assert corner[0] < 0.0
    assert corner[1] < 0.0


def test_texts_say_who_knows_the_future_and_what_the_least_delay_is() -> None:
    found = table()
    lines = across_lines(found)
    assert lines[3] == f"line_0{'least delay that any control could reach: 20.5 s':>74}"
    assert "  oracle (knows the future)" in lines
    assert "comparison only" in " ".join(across_note(found))
    assert max(map(len, lines)) <= 80
    header, _ = comparison_texts(comparison(summary()), ["oracle"])
    assert header[-1] == "oracle (knows the future)"
    assert "- line_0: plain, mapped, planner" in across_report((), found, (), ())
