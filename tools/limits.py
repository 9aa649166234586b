"""
What limits two-stage deceleration: ``make limits``.

The rule turns standing into rolling for as long as its first stage lasts. This runs the rush
hour with the same draws, capped at several longest dwell delays, and prints how much of the
stop time between stations is left.
"""

import sys
from dataclasses import replace
from pathlib import Path

import pandas as pd

from kankaku.studies import study

PROJECT = Path(__file__).parents[1]
CAPS_S = (60.0, 90.0, 120.0, 180.0, 240.0)
SEEDS = 5
INDICATORS = ("interstation_stop_time_s", "mean_arrival_delay_s", "energy_net_kwh")


def main() -> None:
    """Run, print the table, and write ``out/limits.csv``."""
    chosen = study.choose(
        PROJECT / "scenarios" / "rush_hour",
        names=("close_up", "two_stage"),
        seeds=SEEDS,
        step_s=0.2,
        jobs=2,
        fresh=True,
    )
    rows = []
    for cap_s in CAPS_S:
        delays = replace(chosen.scenario.dwell_delays, cap_s=cap_s)
        capped = replace(chosen, scenario=replace(chosen.scenario, dwell_delays=delays))
        summary = study.run_study(capped, PROJECT / "out" / "limits" / f"{cap_s:g}").summary
        if summary is None:
            msg = "no run was finished"
            raise RuntimeError(msg)
        means = summary.groupby("controller", sort=False)[list(INDICATORS)].mean()
        rows.append(means.assign(cap_s=cap_s).reset_index())
    table = pd.concat(rows)
    table.round(3).to_csv(PROJECT / "out" / "limits.csv", index=False)
    sys.stdout.write(table.round(1).to_string(index=False) + "\n")


if __name__ == "__main__":
    main()
