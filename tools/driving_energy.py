"""
What a way of driving takes in time and energy: ``make driving``.

One train alone runs a leg, and the whole line with its booked dwells, as fast as it can, in the
scenario's style when it is late and when it is not, and as thrifty as the time of the normal run
allows. Writes ``out/driving.md``.
"""

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kankaku.analysis.tables.delay import technical_run_times_s
from kankaku.railway.plan.driving_style import FASTEST, DrivingStyle
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.timetable import Call, Service, Timetable
from kankaku.railway.plan.world import World, build_world
from kankaku.railway.step.records import RunRecord
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.shipped import folder_of
from tools.paper_tables import markdown
from tools.plain_runs import run_plain

OUT = Path(__file__).parents[1] / "out"
LEG = "kawaguchi", "akabane"
JOULES_PER_KWH = 3.6e6
SPARE_S = 0.5
"""A run is booked so much longer than it takes, so that nobody is late. [s]"""
HEADER = (
    "driven",
    "leg [s]",
    "traction [kWh]",
    "net [kWh]",
    "line [min]",
    "gross [kWh/car-km]",
    "net [kWh/car-km]",
)


class Way(NamedTuple):
    """A way of driving."""

    name: str
    operation: str
    driving: DrivingStyle


class Taken(NamedTuple):
    """What a run took."""

    run_s: float
    traction_kwh: float
    gross_kwh: float
    net_kwh: float
    distance_m: float


def ways(style: DrivingStyle) -> tuple[Way, ...]:
    """
    Return ways of driving, from the fastest to the thriftiest.

    Parameters
    ----------
    style
        That of the scenario.

    Returns
    -------
    tuple[Way, ...]
        The last one takes as long as the one before it.
    """
    return (
        Way("as fast as it can", "close_up", FASTEST),
        Way(f"{style.name}, late", "close_up", style.at_limits),
        Way(style.name, "close_up", style),
        Way(f"eco, in the time of {style.name}", "eco", FASTEST),
    )


def run_alone(scenario: Scenario, service: Service, way: Way) -> RunRecord:
    """
    Run one train alone over a moving block.

    Parameters
    ----------
    scenario
        Line and train.
    service
        The train.
    way
        How it is driven.

    Returns
    -------
    RunRecord
        What came of it.
    """
    world = _world(scenario, service, way.driving)
    delays_s = np.zeros((1, world.stop_m.shape[1] - 1))
    spec = ControllerSpec(way.name, "moving_block", way.operation, {}, {})
    return run_plain(scenario, world, spec, delays_s)


def _world(scenario: Scenario, service: Service, driving: DrivingStyle) -> World:
    timetable = Timetable((service,))
    return build_world(scenario.line, scenario.train_types, timetable, scenario.step_s, driving)


def taken(record: RunRecord) -> Taken:
    """
    Return what a train alone took.

    Parameters
    ----------
    record
        Of its run.

    Returns
    -------
    Taken
        From its first departure to its last arrival, dwells left out of the time.
    """
    calls, account = int(record.world.call_count[0]), record.energy
    runs_s = record.arrival_s[0, 1:calls] - record.departure_s[0, : calls - 1]
    gross_kwh = float(account.consumed_j[0]) / JOULES_PER_KWH
    return Taken(
        float(runs_s.sum()),
        float(account.traction_j[0]) / JOULES_PER_KWH,
        gross_kwh,
        gross_kwh - float(account.recovered_j[0]) / JOULES_PER_KWH,
        float(account.distance_m[0]),
    )


def with_runs(service: Service, runs_s: list[float]) -> Service:
    """
    Return a service booked by given run times, its dwells kept.

    Parameters
    ----------
    service
        The train.
    runs_s
        Run time to each call but the first. [s]

    Returns
    -------
    Service
        It leaves the line at its last call.
    """
    first, *others = service.calls
    calls, now_s = [first], first.departure_s
    for call, run_s in zip(others, runs_s, strict=True):
        stay_s = call.departure_s - call.arrival_s
        arrival_s = now_s + run_s
        now_s = arrival_s + stay_s
        calls.append(replace(call, arrival_s=arrival_s, departure_s=now_s))
    return replace(service, calls=tuple(calls), leaves_at_last_call=True)


def _leg(service: Service) -> Service:
    """Return the part of a service between the two stations of the leg."""
    stations = [call.station for call in service.calls]
    at = stations.index(LEG[0])
    first: Call = service.calls[at]
    return replace(
        service,
        origin=first.station,
        route=(first.track, *service.route[service.route.index(first.track) + 1 :]),
        calls=service.calls[at : at + 2],
    )


def rows(scenario: Scenario, service: Service) -> Iterator[tuple[str, ...]]:
    """
    Yield the rows of the table.

    Parameters
    ----------
    scenario
        Line, trains and driving style.
    service
        A train that calls everywhere.

    Yields
    ------
    tuple[str, ...]
        A row for each way of driving.
    """
    cars = scenario.train_types[service.train_type].cars
    runs_s: dict[str, list[float]] = {}
    for way in ways(scenario.driving):
        found = []
        for name, part in (("line", service), ("leg", _leg(service))):
            if way.operation != "eco":
                world = _world(scenario, part, way.driving)
                driven_s = technical_run_times_s(world)[0, 0, 1 : len(part.calls)]
                runs_s[name] = (driven_s + SPARE_S).tolist()
            found.append(taken(run_alone(scenario, with_runs(part, runs_s[name]), way)))
        line, leg = found
        car_km = cars * line.distance_m / 1000.0
        yield (
            way.name,
            f"{leg.run_s:.1f}",
            f"{leg.traction_kwh:.1f}",
            f"{leg.net_kwh:.1f}",
            f"{line.run_s / 60.0:.1f}",
            f"{line.gross_kwh / car_km:.2f}",
            f"{line.net_kwh / car_km:.2f}",
        )


def main() -> None:
    """Run, print the table, and write it."""
    scenario = load(folder_of("rush_hour"))
    service = max(scenario.timetable.services, key=lambda one: len(one.calls))
    table = markdown(HEADER, rows(scenario, service))
    OUT.mkdir(exist_ok=True)
    (OUT / "driving.md").write_text(table + "\n", encoding="utf-8")
    sys.stdout.write(table + "\n")


if __name__ == "__main__":
    main()
