"""Figures of observed dwells: what is drawn where, and the same bytes every time."""

from pathlib import Path

import numpy as np
import pytest

from kankaku.analysis.figures.dwell_figures import (
    StationSample,
    dwell_headway_figure,
    station_dwell_figure,
)
from kankaku.analysis.figures.style import write_figure

STATIONS = (
    StationSample("$First", np.arange(0.0, 101.0)),
    StationSample("Last", np.array([30.0])),
)


def test_each_station_has_its_quantiles_from_the_top_down() -> None:
    (axes,) = station_dwell_figure(STATIONS, title="Dwells").axes
    assert [text.get_text() for text in axes.get_yticklabels()] == ["$First (101)", "Last (1)"]
    assert axes.get_yticks().tolist() == [1.0, 0.0]
    (medians,) = axes.lines
    assert np.asarray(medians.get_xdata()).tolist() == [50.0, 30.0]
    bars = [(bar.get_x(), bar.get_width()) for bar in axes.patches]  # type: ignore[attr-defined]
    assert bars == [(25.0, 50.0), (30.0, 0.0)]


def test_the_line_of_least_squares_goes_through_the_means() -> None:
    headways_s = np.arange(60.0, 660.0, 6.0)
    beyond_s = 0.05 * (headways_s - 300.0)
    figure = dwell_headway_figure(headways_s, beyond_s, slope=0.05, title="Headways")
    line = figure.axes[0].lines[1]
    ends_min, ends_s = (np.asarray(one) for one in (line.get_xdata(), line.get_ydata()))
    assert ends_min.tolist() == pytest.approx([1.0, 10.9])
    assert ends_s.tolist() == pytest.approx([-12.0, 17.7])


def test_few_dwells_have_no_medians() -> None:
    figure = dwell_headway_figure(np.array([60.0, 90.0]), np.zeros(2), slope=0.0, title="Few")
    assert len(figure.axes[0].lines) == 2


def test_the_files_are_the_same_bytes_every_time(tmp_path: Path) -> None:
    made = [
        [
            file.read_bytes()
            for file in write_figure(station_dwell_figure(STATIONS, title="x"), tmp_path / name)
        ]
        for name in ("one", "two")
    ]
    assert made[0] == made[1]
