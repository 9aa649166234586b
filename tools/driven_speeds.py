"""Runs of one train in a scenario's driving style, and the speed at which a run takes a time."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from kankaku.railway.motion.run_curve import driven_run_s
from kankaku.railway.plan.driving_style import DrivingStyle
from kankaku.railway.plan.line import Line, SpeedLimit
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.scenarios.loading.load_driving import read_driving
from kankaku.scenarios.reading.files import Reader
from kankaku.scenarios.reading.mistakes import ScenarioError

SLOWEST_KMH = 30


def read_style(folder: Path) -> DrivingStyle:
    """
    Return how the trains of a scenario are driven.

    Parameters
    ----------
    folder
        Folder of the scenario.

    Returns
    -------
    DrivingStyle
        That of the scenario.

    Raises
    ------
    ScenarioError
        If ``scenario.toml`` has mistakes.
    """
    reader = Reader()
    style = read_driving(reader, folder)
    if reader.mistakes:
        raise ScenarioError(tuple(reader.mistakes))
    return style


def driven_s(
    line: Line,
    train_type: TrainType,
    style: DrivingStyle,
    ends_m: tuple[float, float],
    speed_mps: float,
) -> float:
    """
    Return how long a run takes when nobody hinders it and it is not late.

    Parameters
    ----------
    line
        The line; its own driven speeds do not count.
    train_type
        The train.
    style
        How it is driven.
    ends_m
        Where the front starts and stops. [m]
    speed_mps
        What it is driven at, at most. [m/s]

    Returns
    -------
    float
        From when it may depart to its stop. [s]
    """
    slowed = replace(line, driven_speeds=(SpeedLimit(*ends_m, speed_mps),))
    return driven_run_s(slowed, train_type, style, ends_m)


def nearest_speed_kmh(run_s: Callable[[int], float], wanted_s: float, fastest_kmh: int) -> int:
    """
    Return the whole speed with which a run takes most nearly a time.

    Parameters
    ----------
    run_s
        Run time by speed, never longer with a higher one. [km/h] to [s]
    wanted_s
        The time. [s]
    fastest_kmh
        The highest speed. [km/h]

    Returns
    -------
    int
        The speed. [km/h]
    """
    slow, fast = SLOWEST_KMH, fastest_kmh
    while fast - slow > 1:
        middle = (slow + fast) // 2
        if run_s(middle) > wanted_s:
            slow = middle
        else:
            fast = middle
    return min((slow, fast), key=lambda speed_kmh: abs(run_s(speed_kmh) - wanted_s))
