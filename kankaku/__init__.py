"""
Kankaku: which way of train control keeps a delay from spreading, on any line.

What is named here is the public face and stays; everything below may change. Nothing is read
before it is asked for, so that importing the package takes no time.
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kankaku.analysis.explaining import Explanation as Explanation
    from kankaku.analysis.explaining import explain as explain
    from kankaku.analysis.results import Results as Results
    from kankaku.analysis.results import read_results as read_results
    from kankaku.analysis.tables.run_tables import RunTables as RunTables
    from kankaku.controllers.layers import Layer as Layer
    from kankaku.controllers.layers import Medium as Medium
    from kankaku.face import across as across
    from kankaku.face import load as load
    from kankaku.face import register_operation as register_operation
    from kankaku.face import register_protection as register_protection
    from kankaku.face import register_supervision as register_supervision
    from kankaku.face import run_once as run_once
    from kankaku.live.environments import parallel_env as parallel_env
    from kankaku.live.environments import register_environments as register_environments
    from kankaku.live.line_advice import LineAdvice as LineAdvice
    from kankaku.live.line_view import LineView as LineView
    from kankaku.live.simulation import Simulation as Simulation
    from kankaku.railway.errors import KankakuError as KankakuError
    from kankaku.railway.motion.eco_run import eco_run as eco_run
    from kankaku.railway.motion.run_curve import RunCurve as RunCurve
    from kankaku.railway.motion.run_curve import fastest_run as fastest_run
    from kankaku.railway.motion.timed_run import timed_run as timed_run
    from kankaku.railway.plan.scenario import Scenario as Scenario
    from kankaku.scenarios.shipped import shipped_scenarios as shipped_scenarios
    from kankaku.studies.across_study import AcrossResult as AcrossResult
    from kankaku.studies.outcomes import Study as Study
    from kankaku.studies.outcomes import StudyResult as StudyResult
    from kankaku.studies.study import choose as choose
    from kankaku.studies.study import run_study as run_study

    __version__: str

__all__ = [
    "AcrossResult",
    "Explanation",
    "KankakuError",
    "Layer",
    "LineAdvice",
    "LineView",
    "Medium",
    "Results",
    "RunCurve",
    "RunTables",
    "Scenario",
    "Simulation",
    "Study",
    "StudyResult",
    "__version__",
    "across",
    "choose",
    "eco_run",
    "explain",
    "fastest_run",
    "load",
    "parallel_env",
    "read_results",
    "register_environments",
    "register_operation",
    "register_protection",
    "register_supervision",
    "run_once",
    "run_study",
    "shipped_scenarios",
    "timed_run",
]

_HOMES = {
    "AcrossResult": "kankaku.studies.across_study",
    "Explanation": "kankaku.analysis.explaining",
    "KankakuError": "kankaku.railway.errors",
    "Layer": "kankaku.controllers.layers",
    "LineAdvice": "kankaku.live.line_advice",
    "LineView": "kankaku.live.line_view",
    "Medium": "kankaku.controllers.layers",
    "Results": "kankaku.analysis.results",
    "RunCurve": "kankaku.railway.motion.run_curve",
    "RunTables": "kankaku.analysis.tables.run_tables",
    "Scenario": "kankaku.railway.plan.scenario",
    "Simulation": "kankaku.live.simulation",
    "Study": "kankaku.studies.outcomes",
    "StudyResult": "kankaku.studies.outcomes",
    "across": "kankaku.face",
    "choose": "kankaku.studies.study",
    "eco_run": "kankaku.railway.motion.eco_run",
    "explain": "kankaku.analysis.explaining",
    "fastest_run": "kankaku.railway.motion.run_curve",
    "load": "kankaku.face",
    "parallel_env": "kankaku.live.environments",
    "read_results": "kankaku.analysis.results",
    "register_environments": "kankaku.live.environments",
    "register_operation": "kankaku.face",
    "register_protection": "kankaku.face",
    "register_supervision": "kankaku.face",
    "run_once": "kankaku.face",
    "run_study": "kankaku.studies.study",
    "shipped_scenarios": "kankaku.scenarios.shipped",
    "timed_run": "kankaku.railway.motion.timed_run",
}
"""Where each name is at home."""

if "gymnasium" in sys.modules:
    # Whoever has it wants to make environments; else its import would take everybody's time.
    from kankaku.live.environments import register_environments

    register_environments()


def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever has that name
    """Return what is asked for, and read its module now."""
    if name == "__version__":
        from importlib.metadata import version  # noqa: PLC0415 - nobody else needs it

        return version("kankaku")
    if name not in _HOMES:
        msg = f"module 'kankaku' has no attribute {name!r}"
        raise AttributeError(msg)
    found = getattr(import_module(_HOMES[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """Name the public face."""
    return sorted(__all__)
