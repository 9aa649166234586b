"""
What relative braking risks: the same run, judged as if a leader could stop dead.

``python brick_wall.py [SCENARIO]`` runs virtual coupling twice. Protection permits the same both
times. The monitor holds trains to the rule that protection declares: once to stand before where
the leader comes to a stand with its emergency brake, once before its rear as it is now.
"""

import argparse
import math

import pandas as pd

import kankaku
from kankaku.controllers.protection.relative_braking import RelativeBraking, RelativeBrakingOptions
from kankaku.railway.step.control import Separation

DECLARED, DEAD = "relative_braking", "brick_wall"
SPACING = "spacing"
"""The emergency brake would not have stopped a train short of the rear ahead."""
TOLD = {
    "margin": "permitted into the margin",
    "band": "permitted beyond the rear",
    SPACING: "could not have stopped",
}


class BrickWall(RelativeBraking):
    """Permits what relative braking permits, and is judged as if leaders stopped dead."""

    separation = Separation.STANDING


kankaku.register_protection(
    DEAD, BrickWall, RelativeBrakingOptions, "relative braking, judged behind a brick wall"
)


def judged(
    scenario: str | kankaku.Scenario,
    operation: str = "virtual_coupling",
    *,
    seed: int = 1,
    step_s: float = 0.5,
) -> dict[str, pd.DataFrame]:
    """
    Run an operation over relative braking under both rules of separation.

    Parameters
    ----------
    scenario
        A scenario, its folder, or the name of a shipped one.
    operation
        What runs over it.
    seed
        Of the dwell delays.
    step_s
        Length of a step. [s]

    Returns
    -------
    dict[str, pandas.DataFrame]
        What the monitor found, by protection: a row for each violation.
    """
    return {
        name: kankaku.run_once(scenario, f"{name}+{operation}", seed=seed, step_s=step_s).violations
        for name in (DECLARED, DEAD)
    }


def main() -> None:
    """Print what the monitor found, and how fast the worst collision would have been."""
    parser = argparse.ArgumentParser(description="What relative braking risks.")
    parser.add_argument("scenario", nargs="?", default="rush_hour")
    chosen = kankaku.load(parser.parse_args().scenario)
    brake_mps2 = min(kind.emergency_brake_mps2 for kind in chosen.train_types.values())
    for name, found in judged(chosen).items():
        print(f"{name}: {len(found)} violations")
        for kind in sorted(set(found["kind"])):
            rows = found[found["kind"] == kind]
            most_m = float(rows["excess"].max())
            print(f"  {TOLD.get(kind, kind)}: {len(rows)} times, by {most_m:.1f} m at most")
            if kind == SPACING:
                speed_kmh = 3.6 * math.sqrt(2.0 * brake_mps2 * most_m)
                print(f"  fastest collision: about {speed_kmh:.0f} km/h")


if __name__ == "__main__":
    main()
