"""The tables of speed and step for the documentation; see ``tools.results``."""

import json
from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from tools.bench import CONTROLLERS
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
    """Return the figures of the benchmark."""
    figures = json.loads((OUT / "bench.json").read_text(encoding="utf-8"))
    rows = [
        [
            f"`{name}`",
            f"{figures[name]['ratio_to_sumo']:.1f}",
            f"{figures[name]['train_steps_per_s'] / 1000:.0f} thousand",
            _planning(figures[name]["planning_ms"]),
            ", ".join(
                f"{phase} {100 * share:.0f} %"
                for phase, share in figures[name]["phase_shares"].items()
            ),
        ]
        for name in CONTROLLERS
    ]
    header = [
        "controller",
        "time over bare SUMO's",
        "train-steps per second",
        "planning, median and 99 %",
        "where it goes",
    ]
    return markdown(header, rows)


def _planning(times_ms: Mapping[str, float]) -> str:
    return f"{times_ms['median']:.2f}, {times_ms['p99']:.1f} ms" if times_ms else "-"
