"""What many runs show: quantiles, running means, wanted precision; and tables as plain bytes."""

from math import inf, isnan

import numpy as np
import pandas as pd
import pytest

from kankaku.analysis.figures.ensemble_figures import box_figure, ecdf_figure, running_mean_figure
from kankaku.analysis.tables.compare import half_width
from kankaku.analysis.tables.ensemble_tables import (
    PrecisionError,
    largest_difference,
    precision_of,
    running_means,
    study_frame,
)
from kankaku.analysis.tables.indicators import INDICATOR_OF
from kankaku.analysis.tables.parquet_bytes import note_of, parquet_bytes
from kankaku.commands.ensemble_shown import RunRate, drawing_of
from kankaku.railway.plan.seed_design import EACH_FOR_ITSELF
from kankaku.railway.step.records import Column
from kankaku.store.ensemble_plan import EnsembleError
from tests.unit.test_across import run, summary

STOPS = "interstation_stop_time_s"


def both(*stops_s: tuple[float, float]) -> pd.DataFrame:
    """Return the summary of two controllers with a pair of stop times for each seed."""
    pairs = [
        run(name, seed, stop_s)
        for seed, pair in enumerate(stops_s)
        for name, stop_s in zip(("plain", "other"), pair, strict=True)
    ]
    return summary(*pairs).assign(scenario="metro")


def test_the_table_has_means_paired_intervals_and_quantiles() -> None:
    runs = both((10.0, 5.0), (20.0, 11.0), (60.0, 20.0))
    table = study_frame(runs, {"metro": EACH_FOR_ITSELF}, ["plain", "other"])
    row = table[(table["controller"] == "other") & (table["indicator"] == STOPS)].iloc[0]
    assert (row["runs"], row["pairs"], row["mean"], row["difference"]) == (3, 3, 12.0, -18.0)
    # Student's 4.3027 of two degrees of freedom.
    assert row["mean_confidence_95"] == pytest.approx(4.3027 * np.sqrt(57.0 / 3.0), rel=1e-4)
    assert (row["minimum"], row["median"], row["maximum"]) == (5.0, 11.0, 20.0)
    assert (row["quantile_25"], row["quantile_75"]) == (8.0, 15.5)
    assert row["change_pct"] == -60.0


def test_running_means_are_those_of_the_first_values() -> None:
    values = 1e6 + np.random.default_rng(1).normal(size=30)
    means, halves = running_means(values)
    for count in (1, 2, 3, 17, 30):
        assert means[count - 1] == pytest.approx(values[:count].mean(), rel=1e-14)
        assert halves[count - 1] == pytest.approx(half_width(values[:count]), nan_ok=True)


@pytest.mark.parametrize("text", [f"{STOPS} ±2 %", f"{STOPS}+-2%", f" {STOPS} +/- 2.0 % "])
def test_a_precision_is_read(text: str) -> None:
    assert str(precision_of(text)) == f"{STOPS} ±2 %"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("stops", "is no indicator with a precision"),
        ("interstation_stops_time_s ±2 %", f"{STOPS!r} .did you mean that.* among {STOPS}, "),
        (f"{STOPS} ±2 kWh", "allowed: % or s"),
        (f"{STOPS} ±0 %", "more than 0"),
    ],
)
def test_a_precision_that_is_none_is_refused_with_what_is_allowed(text: str, told: str) -> None:
    with pytest.raises(PrecisionError, match=told):
        precision_of(text)


def test_a_precision_counts_in_its_unit() -> None:
    values = np.array([90.0, 110.0, 100.0])
    half = half_width(values)
    assert precision_of(f"{STOPS} ±2 s").half(values) == half
    assert precision_of(f"{STOPS} ±2 %").half(values) == pytest.approx(half)
    assert precision_of(f"{STOPS} ±2 %").half(2.0 * values) == pytest.approx(half)
    assert precision_of(f"{STOPS} ±2 %").half(np.zeros(3)) == 0.0
    assert precision_of(f"{STOPS} ±2 %").half(np.array([-1.0, 1.0])) == inf
    assert isnan(precision_of(f"{STOPS} ±2 %").half(values[:1]))


def test_the_largest_difference_is_relative_and_names_its_column() -> None:
    one = dict.fromkeys(INDICATOR_OF, 100.0)
    assert largest_difference(one, one) == (0.0, "")
    other = {**one, STOPS: 101.0, "energy_net_kwh": 100.1}
    assert largest_difference(one, other) == (1.0 / 101.0, STOPS)
    assert largest_difference(one, {**one, STOPS: np.nan}) == (inf, STOPS)
    assert largest_difference({**one, STOPS: np.nan}, {**one, STOPS: np.nan}) == (0.0, "")


def test_figures_have_a_row_for_each_indicator_and_a_column_for_each_scenario() -> None:
    runs = both((10.0, 5.0), (20.0, 11.0), (60.0, 20.0))
    two = pd.concat([runs, runs.assign(scenario="tram")])
    for draw in (box_figure, ecdf_figure, running_mean_figure):
        figure = draw(two, ["plain", "other"], [STOPS, "energy_net_kwh"])
        assert len(figure.axes) == 4
        assert [axes.get_title(loc="left") for axes in figure.axes[:2]] == ["metro", "tram"]
    lines = running_mean_figure(runs, ["plain", "other"], [STOPS]).axes[0].lines
    assert [np.asarray(line.get_ydata()).tolist() for line in lines] == [
        pytest.approx([10.0, 15.0, 30.0]),
        pytest.approx([5.0, 8.0, 12.0]),
    ]


def test_a_table_as_bytes_holds_what_is_declared_and_a_note() -> None:
    columns = (
        Column("name", "str", "", "a text"),
        Column("time_s", "float64", "s", "a number"),
        Column("late", "bool", "", "a switch"),
    )
    frame = pd.DataFrame({"late": [True, False], "name": ["a", "ü"], "time_s": [1.5, np.nan]})
    content = parquet_bytes(frame, columns, {"b": [1], "a": "ü"})
    moved = frame.set_index(pd.Index([7, 8], name="odd"))[["time_s", "name", "late"]]
    assert content == parquet_bytes(moved, columns, {"a": "ü", "b": [1]})
    assert b"pandas" not in content
    assert note_of(content) == {"a": "ü", "b": [1]}


def test_pace_tells_rate_and_remaining_time() -> None:
    now_s = iter([0.0, 10.0, 100.0])
    rate = RunRate(lambda: next(now_s))
    # Four runs were there before.
    assert rate.told(5, 1004) == "5 of 1,004 runs, 0.1 runs/s, 2 h 46 min left"
    assert rate.told(204, 1004) == "204 of 1,004 runs, 2 runs/s, 0 h 07 min left"


def test_what_cannot_be_drawn_is_refused() -> None:
    assert drawing_of([], ["svg", "svg"]).formats == ("svg",)
    with pytest.raises(
        EnsembleError, match=r"--figures: there is no 'gif'; allowed: png, svg, pdf"
    ):
        drawing_of([], ["gif"])
    with pytest.raises(EnsembleError, match=f"did you mean that.*{STOPS}"):
        drawing_of(["interstation_stop_time"], [])
