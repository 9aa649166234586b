"""From the record of a run to tables, indicators, figures and a report."""

from analysis.compare import comparison, comparison_texts
from analysis.delay import technical_run_times_s
from analysis.publishing import publish
from analysis.results import Results, is_results_folder, read_results, run_folder
from analysis.summary import summary_frame
from analysis.tables import RunTables, read_run, run_tables, write_run

__all__ = [
    "Results",
    "RunTables",
    "comparison",
    "comparison_texts",
    "is_results_folder",
    "publish",
    "read_results",
    "read_run",
    "run_folder",
    "run_tables",
    "summary_frame",
    "technical_run_times_s",
    "write_run",
]
