"""The score of the benchmark: from the figures of runs to one number with its parts."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from statistics import mean, median, stdev
from typing import Any, NamedTuple

from kankaku.studies.benchmark_suites import REFERENCE, USUAL

STOPS, DELAY, ENERGY, ROBUSTNESS, COMPUTING = "stops", "delay", "energy", "robustness", "computing"
WEIGHTS: Mapping[str, float] = {
    STOPS: 0.25,
    DELAY: 0.30,
    ENERGY: 0.20,
    ROBUSTNESS: 0.20,
    COMPUTING: 0.05,
}
"""Of the parts; they add up to 1. [-]"""
CONFIDENCE = 0.95
DECIMALS = 3


class Measure(NamedTuple):
    """What a part is computed from: the less the better."""

    of: Callable[[Mapping[str, Any]], float]
    floor: float
    """Added to both sides of a ratio, so that next to nothing is not divided by."""


MEASURES: Mapping[str, Measure] = {
    STOPS: Measure(lambda run: run["interstation_stop_time_s"] / run["trains"], 5.0),
    DELAY: Measure(lambda run: run["mean_arrival_lateness_s"], 10.0),
    ENERGY: Measure(lambda run: run["energy_net_kwh"] / run["trains"], 1.0),
    COMPUTING: Measure(lambda run: 1e6 * run["processor_s"] / max(run["train_steps"], 1), 20.0),
}
"""[s] per train, [s] per call, [kWh] per train, [us] per train and step."""
Figures = Mapping[str, Any]
"""A run as the result file has it."""
Key = tuple[str, str, int]
"""Suite, world and seed."""


class Score(NamedTuple):
    """What a controller is worth beside the reference, which has 100 everywhere."""

    score: float | None
    """None if the gate is closed. [-]"""
    low: float | None
    high: float | None
    """Bounds of the interval over seeds; None with a single one. [-]"""
    parts: Mapping[str, float]
    refused: tuple[str, ...]
    """Why the gate is closed, a sentence each."""

    def told(self) -> dict[str, Any]:
        """Return what a result file holds."""
        return {**self._asdict(), "parts": dict(self.parts), "refused": list(self.refused)}


def scores(runs: Sequence[Figures], contract: Mapping[str, Sequence[str]]) -> dict[str, Score]:
    """
    Return the score of every controller.

    Parameters
    ----------
    runs
        All runs, those of the reference among them.
    contract
        What of the contract a controller breaks, by its name; nothing where it is kept.

    Returns
    -------
    dict[str, Score]
        By controller, in the order of their runs.
    """
    by_name: dict[str, dict[Key, Figures]] = {}
    for run in runs:
        key = run["suite"], run["world"], run["seed"]
        by_name.setdefault(run["controller"], {})[key] = run
    closed = {
        name: (*contract.get(name, ()), *_refusals(own.values())) for name, own in by_name.items()
    }
    found = {}
    for name, own in by_name.items():
        refused = closed[name]
        if not refused and closed[REFERENCE]:
            refused = (f"{REFERENCE}, whom it is compared with, has no score",)
        found[name] = (
            Score(None, None, None, {}, refused) if refused else _score(own, by_name[REFERENCE])
        )
    return found


def _refusals(runs: Iterator[Figures] | Any) -> Iterator[str]:  # noqa: ANN401 - a view
    """Yield why runs are not to be scored: safety first."""
    for run in runs:
        where = f"{run['suite']}, {run['world']}, seed {run['seed']}"
        if run["failure"]:
            yield f"{where}: {run['failure']}"
        elif run["violations"]:
            yield f"{where}: {run['violations']} violations of safety"
        elif run["trains_completed"] < run["trains"]:
            yield f"{where}: {run['trains'] - run['trains_completed']} trains never arrive"


def gain(measure: Measure, own: float, reference: float) -> float:
    """
    Return how much less a controller needs than the reference.

    Parameters
    ----------
    measure
        What is compared.
    own, reference
        What both need.

    Returns
    -------
    float
        Logarithm of the ratio; 0 where they are alike. [-]
    """
    return math.log((reference + measure.floor) / (own + measure.floor))


def _score(own: Mapping[Key, Figures], reference: Mapping[Key, Figures]) -> Score:
    suites = list(dict.fromkeys(suite for suite, _, _ in own))
    worlds = list(dict.fromkeys(world for _, world, _ in own))
    seeds = list(dict.fromkeys(seed for _, _, seed in own))

    def of(part: str, world: str, seed: int) -> float:
        measure = MEASURES[part]
        keys = [(suite, world, seed) for suite in suites]
        return mean(gain(measure, measure.of(own[key]), measure.of(reference[key])) for key in keys)

    by_seed: dict[str, list[float]] = {}
    usual = USUAL if USUAL in worlds else worlds[0]
    others = [world for world in worlds if world != usual]
    for part in (STOPS, DELAY, ENERGY):
        by_seed[part] = [of(part, usual, seed) for seed in seeds]
    if others:
        by_seed[ROBUSTNESS] = [
            min(mean((of(STOPS, world, seed), of(DELAY, world, seed))) for world in others)
            for seed in seeds
        ]
    by_seed[COMPUTING] = [_computing(suites, own, reference)] * len(seeds)
    whole = math.fsum(WEIGHTS[part] for part in by_seed)
    totals = [
        math.fsum(WEIGHTS[part] * gains[row] for part, gains in by_seed.items()) / whole
        for row in range(len(seeds))
    ]
    middle, half = mean(totals), _half_width(totals)
    return Score(
        _hundred(middle),
        None if half is None else _hundred(middle - half),
        None if half is None else _hundred(middle + half),
        {part: _hundred(mean(gains)) for part, gains in by_seed.items()},
        (),
    )


def _computing(
    suites: Sequence[str], own: Mapping[Key, Figures], reference: Mapping[Key, Figures]
) -> float:
    """Nobody gains by it; medians, because the first run of a process compiles."""
    measure = MEASURES[COMPUTING]
    gains = []
    for suite in suites:
        usual = [
            median(measure.of(run) for key, run in runs.items() if key[0] == suite)
            for runs in (own, reference)
        ]
        gains.append(min(gain(measure, *usual), 0.0))
    return mean(gains)


def _half_width(values: Sequence[float]) -> float | None:
    if len(values) < 2:
        return None
    from scipy.stats import t  # noqa: PLC0415 - takes long to import

    quantile = float(t.ppf(0.5 + 0.5 * CONFIDENCE, len(values) - 1))
    return quantile * stdev(values) / math.sqrt(len(values))


def _hundred(logarithm: float) -> float:
    return round(100.0 * math.exp(logarithm), DECIMALS)
