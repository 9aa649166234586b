"""
How the indicators depend on the step: ``make steps``.

The default step of a scenario is the largest whose indicators differ by less than half a
per cent from those at 0.02 s. A single seed is a chaotic witness for indicators that a few
events decide, so the totals of several seeds are compared.
"""

import sys
from pathlib import Path

import pandas as pd

from kankaku.studies import study

PROJECT = Path(__file__).parents[1]
STEPS_S = (0.02, 0.05, 0.1, 0.2, 0.25, 0.5)
SEEDS = 3
INDICATORS = (
    "interstation_stop_time_s",
    "interstation_crawl_time_s",
    "secondary_delay_s",
    "energy_net_kwh",
    "scheduled_speed_kmh",
)


def main() -> None:
    """Run the rush hour at every step, print the table, and write ``out/steps.csv``."""
    out = PROJECT / "out" / "steps"
    rows = []
    for step_s in STEPS_S:
        chosen = study.choose(
            PROJECT / "scenarios" / "rush_hour",
            names=("close_up", "two_stage"),
            seeds=SEEDS,
            step_s=step_s,
            jobs=2,
            fresh=True,
        )
        summary = study.run_study(chosen, out / f"{step_s:g}").summary
        if summary is None:
            msg = "no run was finished"
            raise RuntimeError(msg)
        totals = summary.groupby("controller", sort=False)[list(INDICATORS)].sum()
        rows.append(totals.assign(step_s=step_s).reset_index())
        sys.stderr.write(f"step {step_s:g} s done\n")
    table = pd.concat(rows)
    finest = table[table["step_s"] == STEPS_S[0]].set_index("controller")
    shown = table[["step_s", "controller"]].copy()
    for name in INDICATORS:
        shown[name] = 100.0 * (table[name] / table["controller"].map(finest[name]) - 1.0)
    shown.round(3).to_csv(PROJECT / "out" / "steps.csv", index=False)
    sys.stdout.write("Change against a step of 0.02 s, per cent:\n")
    sys.stdout.write(shown.round(2).to_string(index=False) + "\n")


if __name__ == "__main__":
    main()
