"""
Speed beside bare SUMO: ``make bench``.

The bare ``sumo`` binary runs the generated files as they are, driving the trains itself.
Our run is the same line and trains under a controller with all records on, tables written.
Both are timed in turn, so that a slow machine slows both, and the ratio is what counts. One hour
of radio traffic is timed beside the clock.
"""

import json
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from kankaku.analysis.saved_run import SavedRun, Trip
from kankaku.analysis.tables.radio_tables import LoadCase
from kankaku.analysis.tables.run_tables import run_tables, write_run
from kankaku.railway.motion.journey import booked_journey
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.control import Operation
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Advice, Authority, LineState
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.radio_network import load_radio_plan
from kankaku.studies import study
from kankaku.studies.radio_study import EvenTrains, Question, perform
from kankaku.sumo_net.build import build, sumo_binary
from tools.replanning import replanning_ms

PROJECT = Path(__file__).parents[1]
STEP_S = 0.1
ROUNDS = 3
CONTROLLERS = (
    "close_up",
    "atc",
    "atd",
    "two_stage",
    "approach_point",
    "approach_point_exclusive",
    "control_map",
)
TRAINS = 30
"""On the line at any time of the hour of radio traffic. [-]"""
PHASES = {
    "engine.observe": "observe",
    "protection.authorise": "protect",
    "operation.advise": "operate",
    "drive.command": "drive",
    "engine.apply": "apply",
    "engine.advance": "advance",
}
FIRST_STEP = """
import sys, study
from pathlib import Path
from scenarios import load
class Reached(Exception): pass
def stop(name, layer):
    if name == "engine":
        layer.advance = stop_now
    return layer
def stop_now(): raise Reached
scenario = load(Path(sys.argv[1]))
try:
    study.run_once(scenario, scenario.controllers[0], scenario.seed, 0.1, wrap=stop)
except Reached:
    pass
"""


class Timed:
    """Stands in for a layer and adds up the time of its calls."""

    def __init__(self, spent_s: dict[str, float], name: str, layer: object) -> None:
        self._spent_s = spent_s
        self._name = name
        self._layer = layer

    def __getattr__(self, attribute: str) -> Callable[..., Any]:
        """Return a method of the layer that is timed."""
        method = getattr(self._layer, attribute)
        key, spent_s = f"{self._name}.{attribute}", self._spent_s

        def timed(*arguments: object) -> object:
            started = perf_counter()
            result = method(*arguments)
            spent_s[key] = spent_s.get(key, 0.0) + perf_counter() - started
            return result

        setattr(self, attribute, timed)
        return timed


class PlanningTimed:
    """Stands in for an operation and keeps the time of the calls that changed its plans."""

    def __init__(self, spent_s: list[float], operation: Operation[Any]) -> None:
        self._spent_s = spent_s
        self._operation = operation

    def initial(self) -> Any:  # noqa: ANN401 - each operation has its own memory type
        """Return the memory before the first step."""
        return self._operation.initial()

    def advise(self, state: LineState, authority: Authority, memory: object) -> tuple[Advice, Any]:
        """Return what the operation says."""
        started = perf_counter()
        advice, planned = self._operation.advise(state, authority, memory)
        if planned is not memory:
            self._spent_s.append(perf_counter() - started)
        return advice, planned


def planning_ms(scenario: Scenario, name: str) -> dict[str, float]:
    """
    Return how long it takes to plan after an event.

    Parameters
    ----------
    scenario
        What to run.
    name
        Controller.

    Returns
    -------
    dict[str, float]
        Median, 99th percentile and greatest time of the steps in which plans changed, for all
        the trains that the events of the step concern. [ms]
    """
    spent_s: list[float] = []

    def wrap(layer: str, made: Any) -> Any:  # noqa: ANN401
        return PlanningTimed(spent_s, made) if layer == "operation" else made

    _run(scenario, name, wrap=wrap)
    if not spent_s:
        return {}
    shown = {"median": 50.0, "p99": 99.0, "greatest": 100.0}
    return {key: round(1000.0 * float(np.percentile(spent_s, q)), 3) for key, q in shown.items()}


def bare_s(scenario: Scenario) -> float:
    """
    Return the wall time of the bare SUMO binary.

    Parameters
    ----------
    scenario
        Whose files it runs.

    Returns
    -------
    float
        From its start to its end. [s]
    """
    world = study.world_of(scenario, STEP_S)
    delays_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
    with tempfile.TemporaryDirectory() as folder:
        files = build(scenario, world, delays_s, Path(folder))
        started = perf_counter()
        command = [str(sumo_binary("sumo")), "-c", str(files.config), "--no-warnings"]
        subprocess.run(command, check=True, capture_output=True)  # noqa: S603
        return perf_counter() - started


def ours_s(scenario: Scenario, name: str) -> tuple[float, RunRecord]:
    """
    Return the wall time of our run.

    Parameters
    ----------
    scenario
        What to run.
    name
        Controller.

    Returns
    -------
    tuple[float, RunRecord]
        From the scenario in memory to the tables on disk [s], and the record.
    """
    started = perf_counter()
    record = _run(scenario, name)
    with tempfile.TemporaryDirectory() as folder:
        write_run(run_tables(record), Path(folder) / name)
    return perf_counter() - started, record


def phase_shares(scenario: Scenario, name: str) -> dict[str, float]:
    """
    Return the share of each phase of the loop.

    Parameters
    ----------
    scenario
        What to run.
    name
        Controller.

    Returns
    -------
    dict[str, float]
        Shares of the loop's time; what is not a layer's counts as record. [-]
    """
    spent_s: dict[str, float] = {}
    started = perf_counter()
    _run(scenario, name, wrap=partial(Timed, spent_s))
    whole_s = perf_counter() - started
    shares = {phase: spent_s[key] / whole_s for key, phase in PHASES.items()}
    return {**shares, "record": 1.0 - sum(shares.values())}


def first_step_s(folder: Path) -> float:
    """
    Return the time from the start of a process to its first step, caches warm.

    Parameters
    ----------
    folder
        Scenario folder.

    Returns
    -------
    float
        Wall time. [s]
    """
    command = [sys.executable, "-c", FIRST_STEP, str(folder)]
    times = []
    for _ in range(2):
        started = perf_counter()
        subprocess.run(command, check=True, cwd=PROJECT)  # noqa: S603
        times.append(perf_counter() - started)
    return times[-1]


def radio_hour_s(scenario: Scenario, folder: Path) -> float:
    """
    Return the time that one hour of radio traffic takes.

    Parameters
    ----------
    scenario
        Whose first train gives the way that all trains run.
    folder
        Scenario folder.

    Returns
    -------
    float
        Wall time, median of some rounds. [s]
    """
    world = study.world_of(scenario, STEP_S)
    journey = booked_journey(world, world.profile, 0)
    time_s = np.arange(journey.time_s[0], journey.time_s[-1], 1.0)
    trips = (Trip(time_s, journey.at(time_s)[0]),)
    run = SavedRun(folder, "booked", scenario.seed, "", "", trips)
    question = Question(load_radio_plan(folder, scenario.line), run, scenario.seed)
    times_s = []
    for _ in range(ROUNDS):
        started = perf_counter()
        found = perform(question, EvenTrains(0, TRAINS))
        times_s.append(perf_counter() - started)
        if not isinstance(found, LoadCase) or round(found.trains) != TRAINS:
            msg = "not the traffic that was to be timed"
            raise TypeError(msg)
    return statistics.median(times_s)


def _run(scenario: Scenario, name: str, **options: Any) -> RunRecord:  # noqa: ANN401
    spec = next(spec for spec in scenario.controllers if spec.name == name)
    return study.run_once(scenario, spec, scenario.seed, STEP_S, **options)


def main() -> None:
    """Measure, print, and write ``out/bench.json``."""
    folder = PROJECT / "scenarios" / "rush_hour"
    scenario = load(folder)
    figures: dict[str, Any] = {"step_s": STEP_S, "first_step_s": first_step_s(folder)}
    for name in CONTROLLERS:
        ours_s(scenario, name)
        pairs = [(bare_s(scenario), *ours_s(scenario, name)) for _ in range(ROUNDS)]
        ratio = statistics.median(ours / bare for bare, ours, _ in pairs)
        rate = statistics.median(record.train_steps / ours for _, ours, record in pairs)
        shares = phase_shares(scenario, name)
        figures[name] = {
            "ratio_to_sumo": round(ratio, 2),
            "train_steps_per_s": round(rate),
            "bare_sumo_s": round(statistics.median(bare for bare, _, _ in pairs), 2),
            "run_s": round(statistics.median(ours for _, ours, _ in pairs), 2),
            "planning_ms": planning_ms(scenario, name),
            "phase_shares": {phase: round(share, 3) for phase, share in shares.items()},
        }
    # Its maps are the protection's, and made on a line full of trains.
    figures["control_map"]["planning_ms"] = replanning_ms(scenario)
    figures["radio_hour_s"] = round(radio_hour_s(scenario, folder), 2)
    baseline = figures["close_up"]
    figures["ratio_to_sumo"] = baseline["ratio_to_sumo"]
    figures["train_steps_per_s"] = baseline["train_steps_per_s"]
    figures["peak_rss_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    out = PROJECT / "out"
    out.mkdir(exist_ok=True)
    text = json.dumps(figures, indent=2) + "\n"
    (out / "bench.json").write_text(text, encoding="utf-8")
    sys.stdout.write(text)


if __name__ == "__main__":
    main()
