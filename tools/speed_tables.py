"""The tables of speed and step for the documentation; see ``tools.results``."""

import json
from pathlib import Path

import pandas as pd

from kankaku.railway.step.engine_ways import ENGINES
from tools.bench import CONTROLLERS, SIZES
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
        for name in CONTROLLERS
    ]
    return markdown(["controller", *(f"`{engine}`" for engine in ENGINES)], rows)


def growth_table() -> str:
    """Return what a train-step costs by the number of trains."""
    figures = json.loads((OUT / "bench.json").read_text(encoding="utf-8"))
    ways = {
        "one after another": figures["us_per_train_step"],
        "together": figures["us_per_train_step_together"],
    }
    rows = [
        [
            str(trains),
            *(f"{cost[engine][str(trains)]:.2f}" for cost in ways.values() for engine in ENGINES),
        ]
        for trains in SIZES
    ]
    header = [f"{way}, `{engine}`" for way in ways for engine in ENGINES]
    return markdown(["trains", *header], rows)
