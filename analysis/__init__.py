"""From the record of a run to tables, indicators, figures and a report."""

from analysis.capacity import (
    Assessment,
    Occupation,
    Stretches,
    capacity_texts,
    headway_texts,
)
from analysis.capacity_publishing import CapacityTables, is_capacity_folder, publish_capacity
from analysis.compare import comparison, comparison_texts
from analysis.delay import technical_run_times_s
from analysis.faults import FaultTables, fault_texts, publish_faults
from analysis.interval_diagram import interval_figure
from analysis.publishing import Findings, publish, put_in_place
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
    "Assessment",
    "CapacityTables",
    "Curve",
    "FaultTables",
    "Findings",
    "Occupation",
    "Panel",
    "Results",
    "RunTables",
    "Stretches",
    "SweepTables",
    "capacity_texts",
    "comparison",
    "comparison_texts",
    "fault_texts",
    "follower_panels",
    "headway_margin_s",
    "headway_texts",
    "interval_figure",
    "is_capacity_folder",
    "is_results_folder",
    "measured_frame",
    "publish",
    "publish_capacity",
    "publish_faults",
    "put_in_place",
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
