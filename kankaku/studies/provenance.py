"""How to repeat a study: what was run, with which options and versions."""

import os
import platform
from collections.abc import Mapping
from dataclasses import asdict
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from kankaku.store.fingerprint import sources_sha256
from kankaku.store.run_store import controller_told

if TYPE_CHECKING:
    from kankaku.studies.study import Study, StudyResult

VERSIONED = ("eclipse-sumo", "libsumo", "numpy", "pandas", "scipy", "simpy")


def provenance_of(study: "Study", result: "StudyResult", wall_s: float) -> Mapping[str, Any]:
    """
    Return what ``provenance.json`` holds.

    Parameters
    ----------
    study
        What was to be run.
    result
        What is finished, earlier runs included.
    wall_s
        How long it took this time. [s]

    Returns
    -------
    Mapping[str, Any]
        The scenario with its hash, the controllers with all their options, the versions of
        the programs, and every run with the time when it was finished.
    """
    scenario, sweep = study.scenario, study.scenario.sweep
    told = {kept.task.controller: kept.told["controller"] for kept in result.kept}
    told |= {spec.name: controller_told(spec) for spec in study.specs}
    return {
        "scenario": scenario.name,
        "scenario_sha256": scenario.digest,
        "seeds": sorted({*study.seeds, *(kept.task.seed for kept in result.kept)}),
        "sweep": asdict(sweep) if sweep else None,
        "step_s": study.step_s,
        "radio": asdict(scenario.radio),
        "interrupted": result.interrupted,
        "failed": [str(failed) for failed in result.failed],
        "controllers": told,
        "versions": {
            "kankaku": version("kankaku"),
            "python": platform.python_version(),
            **{name: version(name) for name in VERSIONED},
        },
        "sources_sha256": sources_sha256(),
        "processors": os.cpu_count(),
        "wall_s": round(wall_s, 3),
        "runs": [
            {
                **kept.task._asdict(),
                "train_steps": kept.told["train_steps"],
                "wall_s": kept.told["wall_s"],
                "finished": kept.told["finished"],
            }
            for kept in result.kept
        ],
    }
