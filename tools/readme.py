"""
Write the result tables of the documentation from ``out/``: ``make readme``.

Reads what the make targets ``rush-hour``, ``sakai``, ``seeds``, ``limits``, ``steps`` and
``bench`` left, and replaces the text between ``<!-- name -->`` and ``<!-- end -->``.
"""

import json
import re
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from analysis import comparison, comparison_texts, read_results
from analysis.sweep import SWEEP_INDICATORS
from tools.bench import CONTROLLERS

PROJECT = Path(__file__).parents[1]
OUT = PROJECT / "out"
SHOWN = (
    "interstation_stop_time_s",
    "interstation_stops",
    "interstation_crawl_time_s",
    "mean_arrival_delay_s",
    "final_arrival_delay_s",
    "secondary_delay_s",
    "energy_net_kwh",
)
PLAIN = ("close_up", "two_stage", "two_stage_plain", "approach_point")
EXCLUSIVE = ("close_up_exclusive", "approach_point_exclusive")


def comparison_table(folder: Path, controllers: Sequence[str] = ()) -> str:
    """
    Return the comparison of a results folder.

    Parameters
    ----------
    folder
        Results folder.
    controllers
        Which ones, baseline first; all if empty.

    Returns
    -------
    str
        A Markdown table.
    """
    summary = read_results(folder, trajectories=False).summary
    if controllers:
        summary = summary[summary["controller"].isin(controllers)]
    return _markdown(*comparison_texts(comparison(summary, SHOWN)))


def limits_table() -> str:
    """Return stop time and mean delay against the longest dwell delay."""
    table = pd.read_csv(OUT / "limits.csv")
    rows = []
    for cap_s, both in table.groupby("cap_s", sort=True):
        by_name = both.set_index("controller")
        stop_s = by_name["interstation_stop_time_s"]
        delay_s = by_name["mean_arrival_delay_s"]
        change_pct = 100.0 * (stop_s["two_stage"] / stop_s["close_up"] - 1.0)
        added_s = delay_s["two_stage"] - delay_s["close_up"]
        rows.append(
            [
                f"{cap_s:.0f} s",
                f"{stop_s['close_up']:.0f} s",
                f"{stop_s['two_stage']:.0f} s",
                f"{change_pct:+.0f} %",
                f"{added_s:+.1f} s",
            ]
        )
    header = ["longest dwell delay", "`close_up`", "`two_stage`", "change", "mean delay"]
    return _markdown(header, rows)


def steps_table() -> str:
    """Return the change of the indicators with the step."""
    table = pd.read_csv(OUT / "steps.csv")
    names = [name for name in table.columns if name not in {"controller", "step_s"}]
    rows = [
        [f"{row['step_s']:g} s", row["controller"], *(f"{row[name]:+.2f}" for name in names)]
        for row in table.to_dict("records")
    ]
    return _markdown(["step", "controller", *names], rows)


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
    return _markdown(header, rows)


def _planning(times_ms: Mapping[str, float]) -> str:
    return f"{times_ms['median']:.2f}, {times_ms['p99']:.1f} ms" if times_ms else "-"


def sakai_table() -> str:
    """Return the three cases of Sakai et al. 2020 beside the published figures."""
    rows = []
    for case in (1, 2, 3):
        table = read_results(OUT / f"sakai_case{case}", trajectories=False).sweep
        if table is None:
            msg = f"{OUT / f'sakai_case{case}'} holds no sweep"
            raise ValueError(msg)
        cells = table[table["controller"] == "approach_point"].set_index("indicator")
        pairs = cells.loc[list(SWEEP_INDICATORS), ["value", "published"]].to_numpy().ravel()
        rows.append([f"case {case}", *("-" if np.isnan(it) else f"{it:.1f}" for it in pairs)])
    labels = [label for label, _ in SWEEP_INDICATORS.values()]
    header = [text for label in labels for text in (f"{label} [s]", "published")]
    return _markdown(["", *header], rows)


def _markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    rule = ["---", *("---:" for _ in header[1:])]
    return "\n".join("| " + " | ".join(row) + " |" for row in (header, rule, *rows))


def _replace(file: Path, name: str, make: Callable[[], str]) -> None:
    text = file.read_text(encoding="utf-8")
    pattern = rf"(<!-- {name} -->\n).*?(<!-- end -->)"
    changed = re.sub(
        pattern, lambda found: f"{found[1]}{make()}\n{found[2]}", text, flags=re.DOTALL
    )
    file.write_text(changed, encoding="utf-8")


def main() -> None:
    """Replace the tables and the figure."""
    readme, model = PROJECT / "README.md", PROJECT / "docs" / "model.md"
    _replace(readme, "own-seed", lambda: comparison_table(OUT / "rush_hour", PLAIN))
    seeds = OUT / "seeds" / "rush_hour"
    _replace(readme, "seeds", lambda: comparison_table(seeds, PLAIN))
    _replace(readme, "exclusive", lambda: comparison_table(seeds, EXCLUSIVE))
    _replace(readme, "limits", limits_table)
    _replace(readme, "sakai", sakai_table)
    _replace(readme, "bench", bench_table)
    _replace(model, "steps", steps_table)
    for folder, figure in (("rush_hour", "time_distance"), ("sakai_case1", "intervals")):
        file = f"{figure}.png"
        shutil.copyfile(OUT / folder / file, PROJECT / "docs" / file)


if __name__ == "__main__":
    main()
