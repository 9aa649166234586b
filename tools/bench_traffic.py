"""Traffic of any number of trains, for what a train-step costs: one after another, or together."""

from dataclasses import replace

from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.timetable import Call, Service, Timetable
from kankaku.testing.example_lines import make_scenario, straight_line

SPACING_M = 1200.0
"""From stop to stop. [m]"""
RUN_S, DWELL_S, HEADWAY_S = 90.0, 30.0, 150.0
READY_S = 3600.0
LINES_M = {"in_sequence": 24_000.0, "together": 120_000.0}
"""Length of the line: on the longer one five times as many trains run at once. [m]"""


def traffic(trains: int, length_m: float, step_s: float) -> Scenario:
    """
    Return a scenario of one track with a station every 1.2 km and a train every 150 s.

    Parameters
    ----------
    trains
        How many. [-]
    length_m
        Length of the line. [m]
    step_s
        Length of a step. [s]

    Returns
    -------
    Scenario
        No train is late, and none waits for another one.
    """
    count = int((length_m - 500.0) / SPACING_M)
    stops_m = {f"s{number}": 300.0 + number * SPACING_M for number in range(count)}
    line = straight_line(stops_m, length_m)
    services = [
        Service(f"T{number + 1}", "s0", "commuter", ("main",), _calls(stops_m, number * HEADWAY_S))
        for number in range(trains)
    ]
    scenario = make_scenario(line, services, step_s=step_s)
    return replace(scenario, timetable=Timetable(tuple(services)))


def _calls(stops_m: dict[str, float], late_s: float) -> tuple[Call, ...]:
    cycle_s = RUN_S + DWELL_S
    return tuple(
        Call(
            station=station,
            track="main",
            stop_m=stop_m,
            arrival_s=READY_S + late_s + number * cycle_s,
            departure_s=READY_S + late_s + number * cycle_s + DWELL_S,
            minimum_dwell_s=DWELL_S - 5.0,
        )
        for number, (station, stop_m) in enumerate(stops_m.items())
    )
