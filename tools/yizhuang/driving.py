"""
The speeds at which trains of the Yizhuang line are driven, so that runs take what is booked.

Computers drive the trains of the line, and choose a lower speed where time is left. Here it is one
speed for each leg: the lowest in whole km/h with which a train in the scenario's driving style
still arrives in time. A leg has none where not even the highest is in time.
"""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from kankaku.railway.motion.run_curve import driven_along, way_between
from kankaku.railway.plan.driving_style import DrivingStyle
from kankaku.railway.plan.line import Line, SpeedLimit
from kankaku.railway.plan.profile import NO_BUFFERS
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.scenarios.loading.load_driving import driving_style
from kankaku.scenarios.reading import schema
from kankaku.scenarios.reading.files import Reader
from kankaku.scenarios.reading.mistakes import ScenarioError
from tools.yizhuang.line import Rows
from tools.yizhuang.timetable import Leg, LegTimes, read_line_and_train

SLOWEST_KMH, FASTEST_KMH = 40, 80


def read_style(folder: Path) -> DrivingStyle:
    """
    Return how trains are driven.

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
    data = reader.toml(folder / "scenario.toml", "scenario")
    main, mistakes = schema.check(schema.ScenarioFile, data or {}, "scenario.toml")
    if main is None or reader.mistakes:
        raise ScenarioError((*reader.mistakes, *mistakes))
    return driving_style(main, main.driving)


def driven_speed_table(folder: Path, times: Mapping[Leg, LegTimes]) -> Rows:
    """
    Return the driven speeds.

    Parameters
    ----------
    folder
        Folder with the tables of the line, the train and the driving style.
    times
        Run times by leg, in running order.

    Returns
    -------
    Rows
        Rows, header first.
    """
    line, train_type = read_line_and_train(folder)
    style = read_style(folder)
    rows: Rows = [["start_km", "end_km", "speed_kmh"]]
    for (start, end), leg in zip(pairwise(line.stations), times.values(), strict=True):
        ends_m = start.chainage_m, end.chainage_m
        left_s = leg.run_s - style.departure_reaction_s
        for speed_kmh in range(SLOWEST_KMH, FASTEST_KMH):
            if driven_s(line, train_type, style, ends_m, speed_kmh / 3.6) <= left_s:
                rows.append([*(round(at_m / 1000.0, 3) for at_m in ends_m), speed_kmh])
                break
    return rows


def driven_s(
    line: Line,
    train_type: TrainType,
    style: DrivingStyle,
    ends_m: tuple[float, float],
    speed_mps: float,
) -> float:
    """
    Return how long a run takes when nobody hinders it.

    Parameters
    ----------
    line
        The line.
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
        From start to stop. [s]
    """
    slowed = replace(line, driven_speeds=(SpeedLimit(*ends_m, speed_mps),))
    way = way_between(
        style.line(slowed, hurried=False), style.train(train_type), ends_m, (0.0, 0.0), NO_BUFFERS
    )
    return driven_along(way, style.coasting_band_mps).run_time_s
