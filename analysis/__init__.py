"""From the record of a run to tables, indicators, figures and a report."""

from analysis.compare import comparison, comparison_texts
from analysis.delay import technical_run_times_s
from analysis.interval_diagram import interval_figure
from analysis.publishing import PUBLISHED_FILES, Findings, publish
from analysis.results import Results, is_results_folder, read_results, run_folder
from analysis.speed_distance import Curve, Panel, follower_panels, speed_distance_figure
from analysis.summary import summary_frame
from analysis.sweep import (
    SweepTables,
    headway_margin_s,
    measured_frame,
    read_intervals,
    read_sweep,
    shown_delays_s,
    sweep_frame,
    sweep_tables,
    sweep_texts,
)
from analysis.tables import RunTables, read_run, run_tables, write_run

__all__ = [
    "PUBLISHED_FILES",
    "Curve",
    "Findings",
    "Panel",
    "Results",
    "RunTables",
    "SweepTables",
    "comparison",
    "comparison_texts",
    "follower_panels",
    "headway_margin_s",
    "interval_figure",
    "is_results_folder",
    "measured_frame",
    "publish",
    "read_intervals",
    "read_results",
    "read_run",
    "read_sweep",
    "run_folder",
    "run_tables",
    "shown_delays_s",
    "speed_distance_figure",
    "summary_frame",
    "sweep_frame",
    "sweep_tables",
    "sweep_texts",
    "technical_run_times_s",
    "write_run",
]
