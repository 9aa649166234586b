"""
What the reserve of the control map brings and costs: ``make reserve``.

Followers count on a train at its stop to stay longer than it has to, by the reserve. This runs the
rush hour with several reserves beside close-up running and two-stage deceleration.
"""

import sys
from dataclasses import replace
from pathlib import Path

from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.studies import study

PROJECT = Path(__file__).parents[1]
RESERVES_S = (0.0, 5.0, 10.0, 15.0, 20.0)
SEEDS = 5
BESIDE = ("close_up", "two_stage")
MAP = "control_map"
INDICATORS = (
    "interstation_stop_time_s",
    "mean_arrival_delay_s",
    "final_arrival_delay_s",
    "energy_net_kwh",
)


def with_reserve(spec: ControllerSpec, reserve_s: float) -> ControllerSpec:
    """
    Return the control map with a reserve.

    Parameters
    ----------
    spec
        The scenario's control map.
    reserve_s
        The reserve. [s]

    Returns
    -------
    ControllerSpec
        Named after the reserve.
    """
    options = {**spec.protection_options, "reserve_s": reserve_s}
    return replace(spec, name=f"{spec.name}_{reserve_s:g}s", protection_options=options)


def main() -> None:
    """Run, print the table, and write ``out/reserve.csv``."""
    chosen = study.choose(
        PROJECT / "scenarios" / "rush_hour", names=(*BESIDE, MAP), seeds=SEEDS, jobs=2, fresh=True
    )
    *beside, mapped = chosen.specs
    specs = (*beside, *(with_reserve(mapped, reserve_s) for reserve_s in RESERVES_S))
    chosen = replace(chosen, specs=specs)
    summary = study.run_study(chosen, PROJECT / "out" / "reserve").summary
    if summary is None:
        msg = "no run was finished"
        raise RuntimeError(msg)
    means = summary.groupby("controller", sort=False)[list(INDICATORS)].mean()
    means.round(3).to_csv(PROJECT / "out" / "reserve.csv")
    sys.stdout.write(means.round(1).to_string() + "\n")


if __name__ == "__main__":
    main()
