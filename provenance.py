"""How to repeat a study: what was run, with which options and versions."""

import os
import platform
from collections.abc import Mapping
from dataclasses import asdict
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import controllers

if TYPE_CHECKING:
    from study import Study, StudyResult

VERSIONED = ("eclipse-sumo", "libsumo", "numpy", "pandas", "scipy", "simpy")


def provenance_of(study: "Study", result: "StudyResult", wall_s: float) -> Mapping[str, Any]:
    """
    Return what ``provenance.json`` holds.

    Parameters
    ----------
    study
        What was to be run.
    result
        What is finished.
    wall_s
        How long it took. [s]

    Returns
    -------
    Mapping[str, Any]
        The scenario with its hash, the controllers with all their options, the versions of
        the programs, and every run.
    """
    scenario, sweep = study.scenario, study.scenario.sweep
    return {
        "scenario": scenario.name,
        "scenario_sha256": scenario.digest,
        "seeds": list(study.seeds),
        "sweep": asdict(sweep) if sweep else None,
        "step_s": study.step_s,
        "radio": asdict(scenario.radio),
        "interrupted": result.interrupted,
        "controllers": {
            spec.name: {"peer": spec.peer}
            if spec.peer
            else {
                "protection": spec.protection,
                "operation": spec.operation,
                "radio": spec.radio,
                "options": controllers.options_of(spec),
            }
            for spec in study.specs
        },
        "versions": {
            "kankaku": version("kankaku"),
            "python": platform.python_version(),
            **{name: version(name) for name in VERSIONED},
        },
        "processors": os.cpu_count(),
        "wall_s": round(wall_s, 3),
        "runs": [
            {
                **outcome.task._asdict(),
                "train_steps": outcome.train_steps,
                "wall_s": round(outcome.wall_s, 3),
            }
            for outcome in result.outcomes
        ],
    }
