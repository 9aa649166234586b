"""
How close trains can turn back at a terminal, by its layout: ``python -m tools.terminals``.

A row of trains comes as fast as the terminal takes them, each in its turn on the next platform
track, and goes back in the least time. Beside the simulated headway stands what follows from
run times alone: ways that conflict follow each other with the throw in between, a platform track
is free again when its train has left the points, and nothing else holds anybody.
"""

import sys
import tempfile
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kankaku.railway.motion.run_curve import fastest_run
from kankaku.railway.plan.passing import conflicting
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.units import clock_of
from kankaku.studies.study import world_of
from tools.plain_runs import run_plain

STOCK = Path(__file__).parents[1] / "scenarios" / "rush_hour" / "rolling_stock.toml"
TURN_BACK_S, THROW_S = 120.0, 6.5
RUN_S = 200.0
TRAINS, SETTLED = 16, 8
POINTS_M, FOULING_M, STOP_M, LENGTH_M, MARGIN_M = 2000.0, 80.0, 2400.0, 200.0, 25.0
MAIN = """schema_version = 1
title = "terminal"
seed = 1
step_s = 0.1
patience_min = 200.0

[turn_back]
minimum_s = 120.0

[controllers.close_up]
protection = "moving_block"
operation = "close_up"
"""


class Layout(NamedTuple):
    """A terminal: points, and platform tracks behind them that end at buffer stops."""

    tracks: int

    @property
    def ways_in(self) -> list[tuple[str, str]]:
        """The ways of trains to the platform tracks, in turn."""
        return [("in", f"p{number + 1}") for number in range(self.tracks)]

    @property
    def ways_out(self) -> list[tuple[str, str]]:
        """The ways back."""
        return [(f"p{number + 1}~", "out") for number in range(self.tracks)]


class Times(NamedTuple):
    """Run times of a train alone. [s]"""

    in_s: float
    """From its stand before the points to its stand at the platform."""
    in_clear_s: float
    """From that stand until its tail has left the points."""
    out_clear_s: float
    """From its departure until its tail has left the points."""


def write(layout: Layout, folder: Path, headway_s: float, run_s: float) -> None:
    """Write the scenario, booked with a headway and a time for the run to the terminal."""
    files = {
        "scenario.toml": MAIN,
        "rolling_stock.toml": STOCK.read_text("utf-8"),
        "stations.csv": "id,name,name_local,chainage_km,lon_deg,lat_deg\n"
        "a,A,A,0,139.0,35.7\nb,B,B,2.4,139.03,35.7\n",
        "nodes.csv": "id,km,kind,fouling_start_km,fouling_end_km,throw_s,proof_s\n"
        "west,-6.0,boundary,-6.0,-6.0,0,0\npoints,2.0,points,1.92,2.08,5,1.5\n"
        "end,2.6,buffer,2.6,2.6,0,0\n",
        "tracks.csv": "id,from_node,to_node,direction,across\n"
        f"in,west,points,rising,1\nout,west,points,falling,{max(layout.tracks, 2)}\n"
        + "".join(f"p{n + 1},points,end,both,{n + 1}\n" for n in range(layout.tracks)),
        "platforms.csv": "station,track,start_km,end_km,stop_km\n"
        "a,in,-0.21,0.01,0.0\na,out,-0.21,0.01,-0.2\n"
        + "".join(f"b,p{n + 1},2.19,2.41,2.4\n" for n in range(layout.tracks)),
        "dwell_stations.csv": "station,minimum_dwell_s,booked_dwell_s,delay_scale\n"
        "a,0,0,0\nb,20,20,0\n",
    }
    calls, services = ["train,station,track,arrival,departure"], ["train,train_type,next_train"]
    for number in range(TRAINS):
        track, begins_s = f"p{number % layout.tracks + 1}", 25200.0 + number * headway_s
        arrives_s = begins_s + run_s
        leaves_s = arrives_s + TURN_BACK_S
        calls += [
            f"r{number},a,in,{_clock(begins_s)},{_clock(begins_s)}",
            f"r{number},b,{track},{_clock(arrives_s)},{_clock(arrives_s + 20.0)}",
            f"f{number},b,{track},{_clock(arrives_s + 20.0)},{_clock(leaves_s)}",
            f"f{number},a,out,{_clock(leaves_s + run_s)},{_clock(leaves_s + run_s)}",
        ]
        services += [f"r{number},e233-1000,f{number}", f"f{number},e233-1000,"]
    files["calls.csv"], files["services.csv"] = "\n".join(calls), "\n".join(services)
    folder.mkdir(exist_ok=True)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def _clock(time_s: float) -> str:
    return clock_of(round(time_s))


def times_of(scenario: Scenario) -> Times:
    """Return the run times of a train alone."""
    (train,) = {service.train_type for service in scenario.timetable.services}
    kind, line = scenario.train_types[train], world_of(scenario, scenario.step_s).lines[0]
    stand_m, clear_m = POINTS_M - FOULING_M - MARGIN_M, POINTS_M + FOULING_M
    run = fastest_run(line, kind, stand_m, STOP_M)
    in_clear_s = float(np.interp(clear_m + LENGTH_M, run.chainage_m, run.time_s))
    # On the way back the front begins where the tail was, and runs the other way.
    back = fastest_run(line, kind, 0.0, 2000.0)
    out_m = STOP_M - LENGTH_M - (POINTS_M - FOULING_M) + LENGTH_M
    return Times(run.run_time_s, in_clear_s, float(np.interp(out_m, back.chainage_m, back.time_s)))


def shortest_headway_s(scenario: Scenario, layout: Layout, times: Times) -> float:
    """
    Return the shortest headway that follows from run times alone.

    Trains go in and out in turn; each way is taken as early as those before it allow.
    """
    headway_s = 400.0
    for _ in range(20):
        booked = []
        for train in range(TRAINS):
            ways = layout.ways_in[train % layout.tracks], layout.ways_out[train % layout.tracks]
            in_s = train * headway_s
            booked += [(in_s, train, ways[0]), (in_s + times.in_s + TURN_BACK_S, train, ways[1])]
        starts_s = _starts_s(scenario, sorted(booked), times)
        entries_s = [starts_s[train, way] for _, train, way in sorted(booked) if way[0] == "in"]
        found_s = (entries_s[-1] - entries_s[SETTLED]) / (TRAINS - 1 - SETTLED)
        if abs(found_s - headway_s) < 0.01:
            break
        headway_s = found_s
    return headway_s


def _starts_s(
    scenario: Scenario, booked: Sequence[tuple[float, int, tuple[str, str]]], times: Times
) -> dict[tuple[int, tuple[str, str]], float]:
    """Return when each way is taken, in the booked order. [s]"""
    starts_s: dict[tuple[int, tuple[str, str]], float] = {}
    free: list[tuple[tuple[str, str], float]] = []
    for _, train, way in booked:
        comes_in = way[0] == "in"
        ready_s = 0.0
        if not comes_in:
            in_way = "in", way[0].removesuffix("~")
            ready_s = starts_s[train, in_way] + times.in_s + TURN_BACK_S
        for other, left_s in free:
            if conflicting(scenario.line, way, other):
                ready_s = max(ready_s, left_s + THROW_S)
            elif other == way:
                ready_s = max(ready_s, left_s)
        starts_s[train, way] = ready_s
        free.append((way, ready_s + (times.in_clear_s if comes_in else times.out_clear_s)))
    return starts_s


def simulated_s(scenario: Scenario) -> float:
    """Return the headway at which trains arrive once the terminal is as full as it can be. [s]"""
    world = world_of(scenario, scenario.step_s)
    delays_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
    spec = ControllerSpec("close_up", "moving_block", "close_up", {}, {})
    record = run_plain(scenario, world, spec, delays_s, scenario.seed)
    if record.violations or not record.completed.all():
        message = f"{len(record.violations)} violations, {record.unfinished}"
        raise RuntimeError(message)
    arrivals_s = [
        float(record.arrival_s[row, 1])
        for row, service in enumerate(scenario.timetable.services)
        if service.train.startswith("r")
    ]
    return float(np.mean([b - a for a, b in pairwise(arrivals_s)][SETTLED:]))


def main() -> None:
    """Print a row for each layout."""
    sys.stdout.write("| platform tracks | by run times [s] | simulated [s] |\n|---:|---:|---:|\n")
    with tempfile.TemporaryDirectory(prefix="kankaku-") as place:
        for tracks in (1, 2, 3):
            layout, folder = Layout(tracks), Path(place) / str(tracks)
            write(layout, folder, 600.0, RUN_S)
            scenario = load(folder)
            times = times_of(scenario)
            headway_s = shortest_headway_s(scenario, layout, times)
            # Booked as even runs, whose last fifth leads from the points to the stop.
            write(layout, folder, 0.97 * headway_s, 5.0 * times.in_s)
            found_s = simulated_s(load(folder))
            sys.stdout.write(f"| {tracks} | {headway_s:.1f} | {found_s:.1f} |\n")


if __name__ == "__main__":
    main()
