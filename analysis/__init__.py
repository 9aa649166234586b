"""From the record of a run to tables, indicators, figures and a report."""

import os

from kankaku.railway.places import plotting_folder

# Matplotlib looks for it once, when it is imported, and complains where home cannot be written.
os.environ["MPLCONFIGDIR"] = plotting_folder()

from kankaku.analysis.capacity import (
    Assessment,
    Occupation,
    Stretches,
    capacity_texts,
    headway_texts,
    pattern_text,
    percent_of,
)
from kankaku.analysis.capacity_publishing import CAPACITY_FILES, CapacityTables, publish_capacity
from kankaku.analysis.compare import change_pct, comparison, comparison_note, comparison_texts
from kankaku.analysis.delay import delay_s, technical_run_times_s
from kankaku.analysis.dependability import Endurance, availability_texts, fault_tree_texts
from kankaku.analysis.dependability_publishing import (
    DEPENDABILITY_FILES,
    DependabilityTables,
    publish_dependability,
)
from kankaku.analysis.faults import FaultTables, fault_texts, publish_faults
from kankaku.analysis.interval_diagram import interval_figure
from kankaku.analysis.publishing import Findings, publish
from kankaku.analysis.radio_load import CellPoint, LoadCase, late_share
from kankaku.analysis.radio_publishing import RADIO_FILES, RadioTables, publish_radio
from kankaku.analysis.radio_texts import radio_load_texts, radio_sentences
from kankaku.analysis.report import unfinished_heading
from kankaku.analysis.results import RESULT_FILES, Results, read_results, refuse_foreign, run_folder
from kankaku.analysis.saved_run import SavedRun, SavedRunError, read_saved_run
from kankaku.analysis.speed_distance import Curve, Panel, follower_panels, speed_distance_figure
from kankaku.analysis.summary import summary_frame
from kankaku.analysis.sweep import (
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
from kankaku.analysis.tables import RunTables, read_run, run_tables, write_run

__all__ = [
    "CAPACITY_FILES",
    "DEPENDABILITY_FILES",
    "RADIO_FILES",
    "RESULT_FILES",
    "Assessment",
    "CapacityTables",
    "CellPoint",
    "Curve",
    "DependabilityTables",
    "Endurance",
    "FaultTables",
    "Findings",
    "LoadCase",
    "Occupation",
    "Panel",
    "RadioTables",
    "Results",
    "RunTables",
    "SavedRun",
    "SavedRunError",
    "Stretches",
    "SweepTables",
    "availability_texts",
    "capacity_texts",
    "change_pct",
    "comparison",
    "comparison_note",
    "comparison_texts",
    "delay_s",
    "fault_texts",
    "fault_tree_texts",
    "follower_panels",
    "headway_margin_s",
    "headway_texts",
    "interval_figure",
    "late_share",
    "measured_frame",
    "pattern_text",
    "percent_of",
    "publish",
    "publish_capacity",
    "publish_dependability",
    "publish_faults",
    "publish_radio",
    "radio_load_texts",
    "radio_sentences",
    "read_intervals",
    "read_results",
    "read_run",
    "read_saved_run",
    "read_sweep",
    "refuse_foreign",
    "run_folder",
    "run_tables",
    "shown_delays_s",
    "speed_distance_figure",
    "summary_frame",
    "sweep_frame",
    "sweep_tables",
    "sweep_texts",
    "technical_run_times_s",
    "unfinished_heading",
    "write_run",
]
