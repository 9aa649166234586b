"""
Speed beside bare SUMO: ``make bench``.

The bare ``sumo`` binary runs the generated files as they are, with block signals, driving the
trains itself. Ours is the same line and trains under a controller with all records on, tables
written. All are timed in turn by the time that they compute, round by round, so that a slow machine
slows all of them, and the ratio of the medians is what counts.
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np

from kankaku.analysis.saved_run import SavedRun, Trip
from kankaku.analysis.tables.radio_tables import LoadCase
from kankaku.analysis.tables.run_tables import run_tables, write_run
from kankaku.railway.motion.journey import booked_journey
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.step.engine_ways import ENGINES, EVERY_STEP, WITNESS
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.radio_network import load_radio_plan
from kankaku.studies import study
from kankaku.studies.radio_study import EvenTrains, Question, perform
from kankaku.sumo_net.build import build, sumo_binary
from tools.bench_traffic import LINES_M, traffic
from tools.replanning import replanning_ms

PROJECT = Path(__file__).parents[1]
FOLDER = PROJECT / "scenarios" / "rush_hour"
OUT = PROJECT / "out" / "bench.json"
HISTORY = PROJECT / "docs" / "bench_history.jsonl"
STEP_S = 0.1
CONTROLLERS = (
    "close_up",
    "atc",
    "atd",
    "d_atc",
    "two_stage",
    "approach_point",
    "stochastic_approach",
    "control_map",
)
TRAINS = 30
"""On the line at any time of the hour of radio traffic. [-]"""
SIZES = (40, 100, 400, 1000)
"""Trains of the traffic that grows. [-]"""
SEEDS = 40
"""Rush hours from which a thousand are extrapolated. [-]"""
CLOSE_UP = ControllerSpec("close_up", "moving_block", "close_up", {}, {})
PARTS = ("ratio", "growth", "thousand", "jobs", "start", "radio")


def bare_cpu_s(scenario: Scenario, folder: Path) -> float:
    """
    Return how long the bare SUMO binary computes.

    Parameters
    ----------
    scenario
        Whose files it runs.
    folder
        Where they are, or are to be written.

    Returns
    -------
    float
        From its start to its end. [s]
    """
    config = folder / "line.sumocfg"
    if not config.is_file():
        world = study.world_of(scenario, STEP_S)
        delays_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
        build(scenario, world, delays_s, folder)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [str(sumo_binary("sumo")), "-c", str(config), "--no-warnings"]
    subprocess.run(command, check=True, capture_output=True)  # noqa: S603
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def ours_cpu_s(scenario: Scenario, spec: ControllerSpec, engine: str) -> tuple[float, int]:
    """
    Return how long our run computes.

    Parameters
    ----------
    scenario
        What to run.
    spec
        Controller.
    engine
        How SUMO takes part.

    Returns
    -------
    tuple[float, int]
        From the scenario in memory to the tables on disk [s], and the train-steps.
    """
    started = process_time()
    record = study.run_once(scenario, spec, scenario.seed, scenario.step_s, engine=engine)
    with tempfile.TemporaryDirectory() as folder:
        write_run(run_tables(record), Path(folder) / spec.name)
    return process_time() - started, record.train_steps


def spread(values: Sequence[float], digits: int = 2) -> dict[str, float]:
    """
    Return the median of some rounds with the least and the greatest.

    Parameters
    ----------
    values
        One of each round.
    digits
        Behind the point. [-]

    Returns
    -------
    dict[str, float]
        By ``median``, ``least`` and ``greatest``.
    """
    told = {"median": statistics.median(values), "least": min(values), "greatest": max(values)}
    return {name: round(value, digits) for name, value in told.items()}


def ratios(rounds: int, names: Sequence[str]) -> dict[str, Any]:
    """Return computing times beside bare SUMO's, all in turn in every round."""
    scenario = replace(load(FOLDER), step_s=STEP_S)
    by_name = {spec.name: spec for spec in scenario.controllers}
    pairs = [(engine, name) for engine in ENGINES for name in names]
    for engine, name in pairs:
        ours_cpu_s(scenario, by_name[name], engine)
    bare: list[float] = []
    spent: dict[tuple[str, str], list[tuple[float, int]]] = {pair: [] for pair in pairs}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(rounds):
            bare.append(bare_cpu_s(scenario, Path(folder)))
            for engine, name in pairs:
                spent[engine, name].append(ours_cpu_s(scenario, by_name[name], engine))
    ours = {pair: [cpu_s for cpu_s, _ in found] for pair, found in spent.items()}
    usual = statistics.median(bare)
    return {
        "bare_sumo_cpu_s": spread(bare),
        "run_cpu_s": {
            engine: {name: spread(ours[engine, name]) for name in names} for engine in ENGINES
        },
        "ratio_to_sumo": {
            engine: {
                name: round(statistics.median(ours[engine, name]) / usual, 2) for name in names
            }
            for engine in ENGINES
        },
        "train_steps_per_s": {
            engine: round(
                statistics.median(steps / cpu_s for cpu_s, steps in spent[engine, names[0]])
            )
            for engine in ENGINES
        },
        "planning_ms": replanning_ms(scenario),
    }


def growth(rounds: int, names: Sequence[str]) -> dict[str, Any]:
    """Return what a train-step costs by the number of trains, one after another and together."""
    del names
    found: dict[str, Any] = {}
    for line, length_m in LINES_M.items():
        by_size: dict[str, dict[str, float]] = {engine: {} for engine in ENGINES}
        for trains in SIZES:
            scenario = traffic(trains, length_m, STEP_S)
            for engine in ENGINES:
                costs = [
                    1e6 * cpu_s / steps
                    for cpu_s, steps in (
                        ours_cpu_s(scenario, CLOSE_UP, engine) for _ in range(max(1, rounds // 2))
                    )
                ]
                by_size[engine][str(trains)] = round(statistics.median(costs), 3)
        found[line] = by_size
    return {
        "us_per_train_step": found["in_sequence"],
        "us_per_train_step_together": found["together"],
    }


def thousand(_: int, __: Sequence[str]) -> dict[str, Any]:
    """Return how long a thousand rush hours compute, from some of them."""
    scenario = replace(load(FOLDER), step_s=STEP_S)
    spec = next(spec for spec in scenario.controllers if spec.name == "close_up")
    hours = {}
    for engine, seeds in ((WITNESS, SEEDS), (EVERY_STEP, SEEDS // 8)):
        started = process_time()
        for seed in range(1, seeds + 1):
            study.run_once(scenario, spec, seed, STEP_S, engine=engine)
        hours[engine] = round((process_time() - started) / seeds * 1000.0 / 3600.0, 3)
    return {"core_hours_per_1000_rush_hours": hours[WITNESS], "core_hours_by_engine": hours}


def jobs(_: int, __: Sequence[str]) -> dict[str, Any]:
    """Return by how much two processes are faster than one, by the clock."""
    taken_s = {}
    for processes in (1, 2):
        chosen = study.choose(
            FOLDER, names=["close_up"], seeds=SEEDS, step_s=STEP_S, jobs=processes, engine=WITNESS
        )
        with tempfile.TemporaryDirectory() as folder:
            started = perf_counter()
            study.run_study(chosen, Path(folder))
            taken_s[processes] = perf_counter() - started
    return {"two_jobs_over_one": round(taken_s[1] / taken_s[2], 2)}


def start(rounds: int, names: Sequence[str]) -> dict[str, Any]:
    """Return how long processes compute that do little: their start."""
    del names
    commands = {
        "import": [sys.executable, "-c", "import kankaku"],
        "help": [sys.executable, "-m", "kankaku", "--help"],
    }
    found = {}
    for name, command in commands.items():
        spent_s = []
        for _ in range(rounds):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run(command, check=True, cwd=PROJECT, capture_output=True)  # noqa: S603
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            spent_s.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        found[name] = spread(spent_s)
    return {"start_cpu_s": found}


def radio_hour(rounds: int, names: Sequence[str]) -> dict[str, Any]:
    """Return the time that one hour of radio traffic takes, by the clock."""
    del names
    scenario = load(FOLDER)
    world = study.world_of(scenario, STEP_S)
    journey = booked_journey(world, world.profile, 0)
    time_s = np.arange(journey.time_s[0], journey.time_s[-1], 1.0)
    trips = (Trip(time_s, journey.at(time_s)[0]),)
    run = SavedRun(FOLDER, "booked", scenario.seed, "", "", trips)
    question = Question(load_radio_plan(FOLDER, scenario.line), run, scenario.seed)
    times_s = []
    for _ in range(rounds):
        started = perf_counter()
        found = perform(question, EvenTrains(0, TRAINS))
        times_s.append(perf_counter() - started)
        if not isinstance(found, LoadCase) or round(found.trains) != TRAINS:
            msg = "not the traffic that was to be timed"
            raise TypeError(msg)
    return {"radio_hour_s": round(statistics.median(times_s), 2)}


MEASURES: Mapping[str, Callable[[int, Sequence[str]], dict[str, Any]]] = dict(
    zip(PARTS, (ratios, growth, thousand, jobs, start, radio_hour), strict=True)
)


def write(found: Mapping[str, Any], parts: Sequence[str]) -> dict[str, Any]:
    """
    Put figures beside those of earlier parts, and into the history.

    Parameters
    ----------
    found
        What was measured.
    parts
        Which parts of it.

    Returns
    -------
    dict[str, Any]
        All figures that there are.
    """
    earlier = json.loads(OUT.read_text("utf-8")) if OUT.is_file() else {}
    figures = {**earlier, **found, "step_s": STEP_S}
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
    told = {"measured": datetime.now(UTC).isoformat(timespec="seconds"), "parts": list(parts)}
    with HISTORY.open("a", encoding="utf-8") as history:
        history.write(json.dumps({**told, **found}) + "\n")
    return figures


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print, and write ``out/bench.json``."""
    parser = argparse.ArgumentParser(description="Speed beside bare SUMO.")
    parser.add_argument("--only", default=",".join(PARTS), help="parts, with commas")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--controllers", default=",".join(CONTROLLERS), help="with commas")
    asked = parser.parse_args(arguments)
    parts = asked.only.split(",")
    if unknown := [part for part in parts if part not in MEASURES]:
        parser.error(f"--only: {', '.join(unknown)}; allowed: {', '.join(PARTS)}")
    found: dict[str, Any] = {"processors": os.cpu_count()}
    for part in parts:
        found |= MEASURES[part](asked.rounds, asked.controllers.split(","))
    found["peak_rss_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    sys.stdout.write(json.dumps(write(found, parts), indent=2) + "\n")


if __name__ == "__main__":
    main()
