"""A station with a track of its own for every second train, for checks and tests."""

from dataclasses import replace

from kankaku.railway.plan.line import Section, Track, Turnout
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.timetable import Call, Service
from kankaku.testing.example_lines import (
    blocks_every,
    make_scenario,
    platform_for,
    straight_line,
)

READY_S = 25_200.0


def loop_station_scenario(
    trains: int = 3,
    headway_s: float = 90.0,
    *,
    one_starts_inside: bool = False,
    block_m: float | None = None,
) -> Scenario:
    """
    Trains call at ``mid`` on ``north`` and ``south`` in turn, on one track before and after.

    The points lie at 1000 m (fouling from 940 m to 1060 m) and 1800 m (from 1740 m to
    1860 m); the stops at 400 m, 1600 m and 2400 m. If one starts inside, a train that stands
    on ``south`` from the beginning leaves between ``T1`` and the next one.
    """
    tracks = [Track("in", 0.0, 1000.0), Track("out", 1800.0, 3000.0)]
    north, south = Track("north", 1000.0, 1800.0), Track("south", 1000.0, 1800.0)
    stops_m = {"west": 400.0, "mid": 1600.0, "east": 2400.0}
    line = replace(
        straight_line(stops_m, 3000.0),
        name="loop station",
        blocks=tuple(
            block
            for track in (tracks[0], north, south, tracks[1])
            for block in blocks_every(track, block_m)
        )
        if block_m
        else (),
        sections=(
            Section(0.0, 1000.0, (tracks[0],)),
            Section(1000.0, 1800.0, (north, south)),
            Section(1800.0, 3000.0, (tracks[1],)),
        ),
        platforms=(
            platform_for("west", "in", 400.0),
            platform_for("mid", "north", 1600.0),
            platform_for("mid", "south", 1600.0),
            platform_for("east", "out", 2400.0),
        ),
        turnouts=(Turnout("fan", 1000.0, 940.0, 1060.0), Turnout("throat", 1800.0, 1740.0, 1860.0)),
    )
    return make_scenario(line, _services(trains, headway_s, one_starts_inside=one_starts_inside))


def _services(trains: int, headway_s: float, *, one_starts_inside: bool) -> list[Service]:
    services = []
    for index in range(trains):
        ready_s = READY_S + index * headway_s
        side = "south" if index % 2 else "north"
        calls = (
            Call("west", "in", 400.0, ready_s, ready_s + 30.0, 25.0),
            Call("mid", side, 1600.0, ready_s + 120.0, ready_s + 150.0, 25.0),
            Call("east", "out", 2400.0, ready_s + 230.0, ready_s + 260.0, 25.0),
        )
        services.append(Service(f"T{index + 1}", "west", "commuter", ("in", side, "out"), calls))
    if one_starts_inside:
        inside = (
            Call("mid", "south", 1600.0, READY_S, READY_S + 195.0, 25.0),
            Call("east", "out", 2400.0, READY_S + 275.0, READY_S + 305.0, 25.0),
        )
        services.insert(1, Service("S1", "mid", "commuter", ("south", "out"), inside))
    return services
