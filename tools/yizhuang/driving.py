"""
The speeds at which trains of the Yizhuang line are driven, so that runs take what is booked.

Computers drive the trains of the line, and choose a lower speed where time is left. Here it is one
speed for each leg: the lowest in whole km/h with which a train in the scenario's driving style
still arrives in time. A leg has none where not even the highest is in time.
"""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

from tools.driven_speeds import driven_s, read_style
from tools.yizhuang.line import Rows
from tools.yizhuang.timetable import Leg, LegTimes, read_line_and_train

SLOWEST_KMH, FASTEST_KMH = 40, 80


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
        left_s = leg.run_s
        for speed_kmh in range(SLOWEST_KMH, FASTEST_KMH):
            if driven_s(line, train_type, style, ends_m, speed_kmh / 3.6) <= left_s:
                rows.append([*(round(at_m / 1000.0, 3) for at_m in ends_m), speed_kmh])
                break
    return rows
