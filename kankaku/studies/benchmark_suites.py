"""What the benchmark runs: suites, worlds of delays, seeds and step; all of it is fixed."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from kankaku.railway.plan.dwell import DwellDelays
from kankaku.railway.plan.line import Block, Track
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.timetable import Timetable
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.shipped import folder_of

VERSION = 1
"""Of suites, worlds, seeds, step and score: results of another one are not comparable."""
REFERENCE = "moving_block+close_up"
"""Whom every score is told against."""
SEEDS = (9001, 9002, 9003, 9004, 9005)
"""Mornings that nothing in this program was chosen by."""
STEP_S = 0.5
TAIL_LEVEL, TAIL_INDEX, TAIL_CAP_S = 0.9, 1.5, 300.0
"""From where on delays have a Pareto tail, its index, and what cuts it off. [-], [-], [s]"""
TAIL_LEVELS = (0.9, 0.95, 0.98, 0.99, 0.995, 0.998, 0.999)
WRONG_FACTOR, WRONG_CAP_S = 2.0, 240.0
"""By how much delays are longer than planners are told, and what cuts them off. [-], [s]"""


class Suite(NamedTuple):
    """A line and its trains."""

    scenario: str
    delays_of: str = ""
    """Scenario whose dwell delays its trains meet; empty for its own."""
    window_s: tuple[float, float] | None = None
    """Trains that depart at their origin within it; None for all. [s]"""
    block_m: float | None = None
    """Length of blocks on a line that has none; the last one of a track is shorter. [m]"""


SUITES: Mapping[str, Suite] = {
    "rush_hour": Suite("rush_hour"),
    "yizhuang": Suite("yizhuang"),
    "terminal": Suite("terminal", "rush_hour"),
    "branch": Suite("branch", "rush_hour", block_m=200.0),
    "whole_line": Suite("whole_line", window_s=(27000.0, 28800.0)),
}


def heavy_tailed(delays: DwellDelays) -> DwellDelays:
    """
    Return dwell delays with a Pareto tail.

    Parameters
    ----------
    delays
        The usual ones.

    Returns
    -------
    DwellDelays
        The same up to the level where the tail begins, and nowhere shorter.
    """
    usual_s = dict(zip(delays.levels, delays.delays_s, strict=True))
    levels = sorted({*delays.levels, *TAIL_LEVELS})
    begin_s = float(np.interp(TAIL_LEVEL, delays.levels, delays.delays_s))
    longer_s = []
    for level in levels:
        at_s = usual_s.get(level, float(np.interp(level, delays.levels, delays.delays_s)))
        if level > TAIL_LEVEL:
            # A quantile at 1 would be infinite: nothing is rarer than the rarest level.
            rare = 1.0 - min(level, TAIL_LEVELS[-1])
            tail_s = begin_s * ((1.0 - TAIL_LEVEL) / rare) ** (1.0 / TAIL_INDEX)
            at_s = max(at_s, tail_s)
        longer_s.append(at_s)
    cap_s = max(TAIL_CAP_S, delays.cap_s if np.isfinite(delays.cap_s) else 0.0)
    return replace(delays, levels=tuple(levels), delays_s=tuple(longer_s), cap_s=cap_s)


def _as_usual(scenario: Scenario) -> Scenario:
    return scenario


def _with_heavy_tails(scenario: Scenario) -> Scenario:
    return replace(scenario, dwell_delays=heavy_tailed(scenario.dwell_delays))


def _other_than_told(scenario: Scenario) -> Scenario:
    usual = scenario.dwell_delays
    met = replace(usual, scale=WRONG_FACTOR * usual.scale, cap_s=WRONG_CAP_S)
    return replace(scenario, dwell_delays=met, planned_delays=usual)


USUAL = "usual"
WORLDS: Mapping[str, Callable[[Scenario], Scenario]] = {
    USUAL: _as_usual,
    "heavy_tailed": _with_heavy_tails,
    "wrong_distribution": _other_than_told,
}
"""What trains meet at platforms; what planners are told is so but in the last one."""


class BenchmarkPlan(NamedTuple):
    """What is run of it."""

    suites: tuple[str, ...] = tuple(SUITES)
    worlds: tuple[str, ...] = tuple(WORLDS)
    seeds: tuple[int, ...] = SEEDS

    @property
    def is_whole(self) -> bool:
        """Whether it is all of it: anything less has no place in the table."""
        return self == BenchmarkPlan()


class BenchmarkTask(NamedTuple):
    """One run."""

    controller: str
    suite: str
    world: str
    seed: int

    def __str__(self) -> str:
        return f"{self.controller} on {self.suite}, {self.world}, seed {self.seed}"


def tasks_of(controllers: tuple[str, ...], plan: BenchmarkPlan) -> tuple[BenchmarkTask, ...]:
    """
    Return all runs of a benchmark.

    Parameters
    ----------
    controllers
        Who runs.
    plan
        What is run.

    Returns
    -------
    tuple[BenchmarkTask, ...]
        Controller by controller.
    """
    return tuple(
        BenchmarkTask(controller, suite, world, seed)
        for controller in controllers
        for suite in plan.suites
        for world in plan.worlds
        for seed in plan.seeds
    )


@cache
def suite_scenario(name: str) -> Scenario:
    """
    Return the scenario of a suite as trains usually meet it.

    Parameters
    ----------
    name
        Of the suite.

    Returns
    -------
    Scenario
        Read once in each process.
    """
    suite = SUITES[name]
    scenario = load(folder_of(suite.scenario))
    if suite.delays_of:
        delays = load(folder_of(suite.delays_of)).dwell_delays
        scenario = replace(scenario, dwell_delays=delays)
    if suite.window_s is not None:
        scenario = replace(scenario, timetable=within(scenario.timetable, *suite.window_s))
    if suite.block_m is not None:
        blocks = tuple(
            block for track in scenario.line.tracks for block in blocks_on(track, suite.block_m)
        )
        scenario = replace(scenario, line=replace(scenario.line, blocks=blocks))
    return scenario


def blocks_on(track: Track, block_m: float) -> list[Block]:
    """
    Return blocks of one length on a track.

    Parameters
    ----------
    track
        The track.
    block_m
        Their length; the last one is as long as what is left. [m]

    Returns
    -------
    list[Block]
        From its start to its end.
    """
    edges_m = [*np.arange(track.start_m, track.end_m - 1.0, block_m).tolist(), track.end_m]
    return [
        Block(f"{track.id}.{number}", track.id, start_m, end_m)
        for number, (start_m, end_m) in enumerate(pairwise(edges_m), start=1)
    ]


def within(timetable: Timetable, first_s: float, last_s: float) -> Timetable:
    """
    Return the trains that depart at their origin within a window.

    Parameters
    ----------
    timetable
        All trains.
    first_s, last_s
        Bounds of the window; the last one is without. [s]

    Returns
    -------
    Timetable
        In their order; stock that another train would take over next ends there.
    """
    kept = [
        service
        for service in timetable.services
        if first_s <= service.calls[0].departure_s < last_s
    ]
    names = {service.train for service in kept}
    return Timetable(
        tuple(
            service if service.next_train in names else replace(service, next_train="")
            for service in kept
        )
    )


def met_scenario(task: BenchmarkTask) -> Scenario:
    """
    Return what a run meets.

    Parameters
    ----------
    task
        The run.

    Returns
    -------
    Scenario
        That of its suite in its world.
    """
    return WORLDS[task.world](suite_scenario(task.suite))
