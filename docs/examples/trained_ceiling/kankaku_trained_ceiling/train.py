"""
Find the table of ``kankaku_trained_ceiling`` by a cross-entropy search, in a few minutes.

``python -m kankaku_trained_ceiling.train`` writes weights.json; ``--generations`` and
``--population`` make it longer.
The first 16 trains of the rush hour run under training seeds; what is found is then tried on the
whole rush hour under seeds that were never trained on. The same arguments find the same weights.
"""

import argparse
import json
import math
import time
from dataclasses import replace
from pathlib import Path
from statistics import mean
from typing import NamedTuple

import numpy as np

import kankaku
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight

from . import WEIGHTS, TrainedCeiling, TrainedCeilingOptions

WRITTEN_TO = Path(__file__).with_name(WEIGHTS)

SCENARIO, TRAINS, STEP_S = "rush_hour", 16, 0.5
TRAINED_ON, TRIED_ON = (101, 102), (1, 2, 3)
GAP_M, WAIT_S = (100.0, 400.0, 1200.0), (-20.0, 10.0, 60.0)
ELITE = 3
"""From each generation the best so many make the next one. [-]"""
SPREAD_KMH, FACTOR_SPREAD = 15.0, 0.3
SMOOTHING = 0.7
"""So much of mean and spread is renewed by a generation. [-]"""
MOST_KMH = 130.0


class Figures(NamedTuple):
    """What a run is judged by."""

    stops_s: float
    """Stop time between stations. [s]"""
    stops: int
    late_s: float
    """Mean lateness of arrivals; who is early is not late. [s]"""
    energy_kwh: float
    """Net, per train. [kWh]"""
    trains: int

    def cost(self, usual: "Figures") -> float:
        """Return what is lost beside another run; weights and floors as in the benchmark."""
        parts = (
            (0.25, self.stops_s / self.trains, usual.stops_s / usual.trains, 5.0),
            (0.30, self.late_s, usual.late_s, 10.0),
            (0.20, self.energy_kwh, usual.energy_kwh, 1.0),
        )
        return sum(w * math.log((own + floor) / (its + floor)) for w, own, its, floor in parts)


def figures(scenario: kankaku.Scenario, controller: str, seed: int) -> Figures:
    """Run a controller once."""
    run = kankaku.run_once(scenario, controller, seed=seed, step_s=STEP_S)
    if not run.violations.empty:
        problem = f"{controller}, seed {seed}: a run that is not safe"
        raise SystemExit(problem)
    stops_s, many = run.interstation_stops["duration_s"], len(run.energy)
    late_s = float(run.calls["arrival_delay_s"].clip(lower=0.0).mean())
    energy_kwh = float(run.energy["net_kwh"].sum()) / many
    return Figures(float(stops_s.sum()), len(stops_s), late_s, energy_kwh, many)


def options_of(vector: FloatArray) -> TrainedCeilingOptions:
    """Return the options that a vector of the search stands for."""
    table = tuple(round(float(np.clip(value, 0.0, MOST_KMH)), 2) for value in vector[:-1])
    factor = round(float(np.clip(vector[-1], 0.0, 2.0)), 3)
    return TrainedCeilingOptions(GAP_M, WAIT_S, table, factor)


class Search:
    """A cross-entropy search for the table."""

    def __init__(self, scenario: kankaku.Scenario) -> None:
        self._scenario, self._tried = scenario, 0
        self._usual = {
            seed: figures(scenario, "moving_block+close_up", seed) for seed in TRAINED_ON
        }

    def cost(self, options: TrainedCeilingOptions) -> float:
        """Return the mean cost of a table over the training seeds."""
        self._tried += 1
        controller = registered(options, f"tried_{self._tried}")
        return mean(
            figures(self._scenario, controller, seed).cost(usual)
            for seed, usual in self._usual.items()
        )

    def found(self, generations: int, population: int) -> tuple[TrainedCeilingOptions, float]:
        """Return the best table that was tried, and its cost."""
        random = np.random.default_rng(20)
        # To begin with: so fast that the way is used up when the leader has cleared it.
        centre = [
            min(3.6 * gap_m / (max(wait_s, 0.0) + 20.0), 90.0)
            for wait_s in WAIT_S
            for gap_m in GAP_M
        ]
        middle = np.array([*centre, 0.5])
        spread = np.array([*np.full(len(centre), SPREAD_KMH), FACTOR_SPREAD])
        best, least = options_of(middle), math.inf
        for number in range(generations):
            drawn = [middle, *(random.normal(middle, spread) for _ in range(population - 1))]
            tables = [options_of(vector) for vector in drawn]
            costs = [self.cost(table) for table in tables]
            order = np.argsort(costs, kind="stable")
            if costs[order[0]] < least:
                best, least = tables[order[0]], costs[order[0]]
            elite = np.array([drawn[place] for place in order[:ELITE]])
            middle = SMOOTHING * elite.mean(axis=0) + (1.0 - SMOOTHING) * middle
            spread = SMOOTHING * elite.std(axis=0) + (1.0 - SMOOTHING) * spread
            print(
                f"generation {number + 1}: best {min(costs):+.4f}, median {np.median(costs):+.4f}"
            )
        return best, least


def registered(options: TrainedCeilingOptions, name: str) -> str:
    """Make a table known as an operation for as long as this program runs."""
    operation = f"{name}_ceiling"

    def build(world: World, _: TrainedCeilingOptions, foresight: Foresight) -> TrainedCeiling:
        return TrainedCeiling(world, options, foresight)

    kankaku.register_operation(operation, build, TrainedCeilingOptions, "a table that is tried")
    return f"moving_block+{operation}"


def main() -> None:
    """Search, try what was found on other seeds, and write the weights."""
    parser = argparse.ArgumentParser(description="Find the table by a cross-entropy search.")
    parser.add_argument("--generations", type=int, default=5)
    parser.add_argument("--population", type=int, default=10)
    parser.add_argument("--out", type=Path, default=WRITTEN_TO)
    chosen = parser.parse_args()
    if chosen.generations < 1 or chosen.population < ELITE:
        parser.error(f"allowed: 1 generation or more, a population of {ELITE} or more")
    begun_s, whole = time.process_time(), kankaku.load(SCENARIO)
    timetable = replace(whole.timetable, services=whole.timetable.services[:TRAINS])
    best, least = Search(replace(whole, timetable=timetable)).found(
        chosen.generations, chosen.population
    )
    print(f"trained in {time.process_time() - begun_s:.0f} s of processor time: {least:+.4f}")
    controller, tried = registered(best, "found"), []
    for seed in TRIED_ON:
        own, usual = (figures(whole, name, seed) for name in (controller, "moving_block+close_up"))
        tried.append({"seed": seed, "own": own._asdict(), "close_up": usual._asdict()})
        print(f"seed {seed}: cost {own.cost(usual):+.4f}\n  own      {own}\n  close_up {usual}")
    told = {
        "weights": {
            "gap_m": best.gap_m,
            "wait_s": best.wait_s,
            "ceiling_kmh": best.ceiling_kmh,
            "leader_factor": best.leader_factor,
        },
        "trained": {
            "scenario": SCENARIO,
            "trains": TRAINS,
            "seeds": TRAINED_ON,
            "generations": chosen.generations,
            "population": chosen.population,
            "cost": round(least, 4),
        },
        "tried": tried,
    }
    chosen.out.write_text(json.dumps(told, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
