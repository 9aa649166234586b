"""Show one decision of the stochastic approach, number by number."""

import argparse
import sys
from typing import Any

from kankaku.controllers import registry
from kankaku.controllers.stochastic import waiting
from kankaku.controllers.stochastic.approach_options import StochasticApproachOptions
from kankaku.controllers.stochastic.approach_site import MeetingCalls, PlatformSite, approach_site
from kankaku.controllers.stochastic.belief import Belief
from kankaku.controllers.stochastic.run_in import Costs
from kankaku.controllers.stochastic.stochastic_approach import CAPS_MPS
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.railway.plan.world import World
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.shipped import folder_of
from kankaku.studies.study import world_of

SCENARIO, TRAINS = "rush_hour", ("723B", "745A")
ACTIONS = (
    *(f"{share:g} of the brake for stops" for share in waiting.BRAKE_SHARES),
    "coast",
    "hold",
    *(f"{share:g} of full traction" for share in waiting.PULL_SHARES),
)
EXPECTED = 1
"""The level of a delay as it is expected."""


def main() -> None:
    """Print the decision as a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--station", default="kawaguchi")
    parser.add_argument("--distance", type=float, default=300.0, help="to the limit, in m")
    parser.add_argument("--speed", type=float, default=8.0, help="in m/s")
    parser.add_argument("--overstay", type=float, default=20.0, help="so far, in s")
    asked = parser.parse_args()
    world = world_of(load(folder_of(SCENARIO)), 0.5)
    site = _site(world, asked.station)
    options = StochasticApproachOptions()
    costs = Costs(options.standing_cost, options.energy_cost_s_per_kwh)
    belief = Belief(world.expected_delays)
    sizes = CAPS_MPS[::2].copy(), waiting.times_of(belief, 1.0)
    tables = waiting.make_tables(site, belief, 1.0, costs, sizes)
    at = asked.distance, asked.speed, asked.overstay
    sys.stdout.write("\n".join(_decision(site, tables, costs, at)) + "\n")


def _site(world: World, station: str) -> PlatformSite:
    follower, leader = (world.timetable.trains.index(train) for train in TRAINS)
    calls = [
        [call.station for call in world.timetable.services[row].calls].index(station)
        for row in (follower, leader)
    ]
    spec = ControllerSpec("close_up", "moving_block", "close_up", {}, {})
    protection: Any = registry.build(spec, world).protection
    site = approach_site(world, protection, follower, MeetingCalls(calls[0], leader, calls[1]))
    if site is None:
        problem = f"nobody waits for {station}"
        raise SystemExit(problem)
    return site


def _decision(
    site: PlatformSite, tables: waiting.Tables, costs: Costs, at: tuple[float, float, float]
) -> list[str]:
    distance_m, speed_mps, overstay_s = at
    time = int(overstay_s / waiting.LOOK_S)
    hazard = float(tables.hazards[EXPECTED, time])
    after, later = tables.before[waiting.CERTAIN, 0], tables.during[EXPECTED, time + 1]
    lines = [
        f"Hazard of the release within {waiting.LOOK_S:g} s: {hazard:.3f}",
        "",
        "| action | then at | at | costs now | released: `T` | not yet: `V` | in the mean |",
        "|---|---|---|---|---|---|---|",
    ]
    totals = []
    for action in range(waiting.ACTIONS):
        motion = distance_m, speed_mps
        place, share, cost_s, then_mps = waiting.look_ahead(
            site.approach, tables.top_mps, motion, action, costs
        )
        gone_s = waiting.between(after, place, share)
        stays_s = waiting.between(later, place, share)
        totals.append(cost_s + hazard * gone_s + (1.0 - hazard) * stays_s)
        then_m = distance_m - 0.5 * (speed_mps + then_mps) * waiting.LOOK_S
        lines.append(
            f"| {ACTIONS[action]} | {then_m:.0f} m | {then_mps:.1f} m/s | {cost_s:+.3f} s "
            f"| {gone_s:.2f} s | {stays_s:.2f} s | {totals[-1]:.3f} s |"
        )
    best = ACTIONS[totals.index(min(totals))]
    return [*lines, "", f"Least: {best}"]


if __name__ == "__main__":
    main()
