"""The tables of speed and step for the documentation; see ``tools.results``."""

import json
from pathlib import Path

import pandas as pd

from kankaku.railway.step.engine_ways import ENGINES
from tools.paper_tables import markdown

OUT = Path(__file__).parents[1] / "out"


def steps_table() -> str:
    """Return the change of the indicators with the step."""
    table = pd.read_csv(OUT / "steps.csv")
    names = [name for name in table.columns if name not in {"controller", "step_s"}]
    rows = [
        [f"{row['step_s']:g} s", row["controller"], *(f"{row[name]:+.2f}" for name in names)]
        for row in table.to_dict("records")
    ]
    return markdown(["step", "controller", *names], rows)


def bench_table() -> str:
    """Return the computing times of all controllers over that of bare SUMO."""
    figures = json.loads((OUT / "bench.json").read_text(encoding="utf-8"))
    ratios = figures["ratio_to_sumo"]
    rows = [
        [f"`{name}`", *(f"{ratios[engine][name]:.2f}" for engine in ENGINES)]
        for name in ratios[ENGINES[0]]
    ]
    return markdown(["controller", *(f"`{engine}`" for engine in ENGINES)], rows)
