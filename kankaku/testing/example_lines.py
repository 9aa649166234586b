"""Small example lines for checks and tests; numbers are round, not any real line's."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from kankaku.railway.plan.dwell import DwellDelays
from kankaku.railway.plan.line import (
    Block,
    Gradient,
    Line,
    Platform,
    Section,
    SpeedLimit,
    Station,
    Track,
    Turnout,
)
from kankaku.railway.plan.rolling_stock import PowerSupply, Traction, TrainType, handbook_resistance
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.timetable import Call, Service, Timetable
from kankaku.railway.plan.world import World, build_world

PLATFORM_MARGIN_M = 10.0
"""Platform beyond both ends of a standing train. [m]"""


def commuter_train(length_m: float = 200.0, brake_mps2: float = 1.0) -> TrainType:
    """
    Return a ten-car electric train of round numbers.

    Parameters
    ----------
    length_m
        Length. [m]
    brake_mps2
        Service brake. [m/s2]

    Returns
    -------
    TrainType
        About 0.9 m/s2 up to 40 km/h, at most 110 km/h.
    """
    return TrainType(
        id="commuter",
        cars=10,
        length_m=length_m,
        mass_kg=400_000.0,
        rotating_mass_ratio=0.08,
        traction=Traction(400_000.0, 11.0, 22.0),
        resistance=handbook_resistance(160_000.0, 240_000.0, 10),
        service_brake_mps2=brake_mps2,
        emergency_brake_mps2=1.3,
        maximum_speed_mps=110.0 / 3.6,
        supply=PowerSupply(0.88, 0.85, 320_000.0, 5.0e6, 2.0, 200_000.0),
    )


def make_scenario(
    line: Line,
    services: Sequence[Service],
    train: TrainType | None = None,
    delays: DwellDelays | None = None,
    step_s: float = 0.5,
) -> Scenario:
    """
    Return a scenario of one train type.

    Parameters
    ----------
    line
        The line.
    services
        First train first.
    train
        Type of every train; :func:`commuter_train` where None.
    delays
        Dwell delays; none where None.
    step_s
        Length of a step. [s]

    Returns
    -------
    Scenario
        Without controllers.
    """
    kind = train or commuter_train()
    return Scenario(
        name="example",
        title="An example line",
        line=line,
        train_types={kind.id: kind},
        timetable=Timetable(tuple(services)),
        dwell_delays=delays or DwellDelays(),
        controllers=(),
        seed=1,
        step_s=step_s,
        patience_s=1800.0,
        digest="",
    )


def world_of(scenario: Scenario) -> World:
    """
    Return the world of a scenario.

    Parameters
    ----------
    scenario
        The scenario.

    Returns
    -------
    World
        With the scenario's own step and driving style.
    """
    return build_world(
        scenario.line,
        scenario.train_types,
        scenario.timetable,
        scenario.step_s,
        scenario.driving,
        scenario.dwell_delays,
    )


def stations_at(chainages_m: Mapping[str, float]) -> tuple[Station, ...]:
    """
    Return stations named by their identifiers.

    Parameters
    ----------
    chainages_m
        Chainage by identifier. [m]

    Returns
    -------
    tuple[Station, ...]
        In the order given.
    """
    return tuple(
        Station(identifier, identifier.title(), identifier, chainage_m, 0.0, 0.0)
        for identifier, chainage_m in chainages_m.items()
    )


def platform_for(station: str, track: str, stop_m: float, length_m: float = 200.0) -> Platform:
    """
    Return a platform just longer than a train.

    Parameters
    ----------
    station, track
        Where.
    stop_m
        Stop position of the front. [m]
    length_m
        Length of the train. [m]

    Returns
    -------
    Platform
        The platform.
    """
    start_m = max(stop_m - length_m - PLATFORM_MARGIN_M, 0.0)
    return Platform(station, track, start_m, stop_m + PLATFORM_MARGIN_M, stop_m)


def blocks_every(track: Track, spacing_m: float) -> tuple[Block, ...]:
    """
    Return blocks of equal length on a track, the last one shorter.

    Parameters
    ----------
    track
        The track.
    spacing_m
        Length of a block. [m]

    Returns
    -------
    tuple[Block, ...]
        From the start of the track to its end.
    """
    blocks: list[Block] = []
    start_m = track.start_m
    while start_m < track.end_m:
        end_m = min(start_m + spacing_m, track.end_m)
        blocks.append(Block(f"{track.id}-{len(blocks) + 1}", track.id, start_m, end_m))
        start_m = end_m
    return tuple(blocks)


def straight_line(
    stops_m: Mapping[str, float],
    end_m: float,
    gradients: Sequence[Gradient] = (),
    limits: Sequence[SpeedLimit] = (),
    block_m: float | None = None,
) -> Line:
    """
    Return a line of one track.

    Parameters
    ----------
    stops_m
        Stop position by station. [m]
    end_m
        End of the line. [m]
    gradients, limits
        Gradients and speed limits.
    block_m
        Length of the signal blocks; no signals where None. [m]

    Returns
    -------
    Line
        The line, beginning at chainage 0.
    """
    track = Track("main", 0.0, end_m)
    return Line(
        name="straight",
        stations=stations_at(stops_m),
        sections=(Section(0.0, end_m, (track,)),),
        platforms=tuple(platform_for(name, "main", stop) for name, stop in stops_m.items()),
        turnouts=(),
        limits=tuple(limits),
        gradients=tuple(gradients),
        curves=(),
        balises_m=(),
        blocks=blocks_every(track, block_m) if block_m else (),
    )


def two_station_scenario(  # noqa: PLR0913 - one argument per figure of the line
    trains: int = 1,
    headway_s: float = 120.0,
    *,
    spacing_m: float = 1000.0,
    run_s: float = 90.0,
    dwell_s: float = 30.0,
    gradients: Sequence[Gradient] = (),
    limits: Sequence[SpeedLimit] = (),
    block_m: float | None = None,
    delays: DwellDelays | None = None,
    step_s: float = 0.5,
) -> Scenario:
    """
    Return a scenario of two stations, ``west`` and ``east``, on one track.

    Parameters
    ----------
    trains
        Number of trains, named ``T1`` onwards. [-]
    headway_s
        Booked interval. [s]
    spacing_m
        Distance of the stop positions; the first is at 300 m. [m]
    run_s
        Booked running time. [s]
    dwell_s
        Booked time at a platform; 5 s more than the minimum. [s]
    gradients, limits, block_m
        As in :func:`straight_line`.
    delays
        Dwell delays; none where None.
    step_s
        Length of a step. [s]

    Returns
    -------
    Scenario
        The first train stands ready at 07:00:00; the line ends 500 m past ``east``.
    """
    stops_m = {"west": 300.0, "east": 300.0 + spacing_m}
    line = straight_line(stops_m, stops_m["east"] + 500.0, gradients, limits, block_m)
    services = [
        Service(
            train=f"T{index + 1}",
            origin="west",
            train_type="commuter",
            route=("main",),
            calls=_booked(stops_m, "main", 25_200.0 + index * headway_s, run_s, dwell_s),
        )
        for index in range(trains)
    ]
    return make_scenario(line, services, delays=delays, step_s=step_s)


def _booked(
    stops_m: Mapping[str, float], track: str, ready_s: float, run_s: float, dwell_s: float
) -> tuple[Call, ...]:
    return tuple(
        Call(
            station=station,
            track=track,
            stop_m=stop_m,
            arrival_s=ready_s + index * (run_s + dwell_s),
            departure_s=ready_s + index * (run_s + dwell_s) + dwell_s,
            minimum_dwell_s=dwell_s - 5.0,
        )
        for index, (station, stop_m) in enumerate(stops_m.items())
    )


def merge_scenario(
    trains: int = 2,
    headway_s: float = 90.0,
    *,
    dwell_s: float = 30.0,
    run_s: float = 90.0,
    block_m: float | None = None,
    delays: DwellDelays | None = None,
    step_s: float = 0.5,
) -> Scenario:
    """
    Return a scenario whose origin has two platform tracks that merge.

    Odd trains start from track ``north``, even ones from ``south``; ``T1`` goes first.

    Parameters
    ----------
    trains
        Number of trains. [-]
    headway_s
        Booked interval. [s]
    dwell_s
        Booked time at a platform; 5 s more than the minimum. [s]
    run_s
        Booked running time. [s]
    block_m
        Length of the signal blocks; no signals where None. [m]
    delays
        Dwell delays; none where None.
    step_s
        Length of a step. [s]

    Returns
    -------
    Scenario
        Stops at 300 m and 1500 m, turnout at 400 m (fouling from 340 m to 410 m), end at 2000 m.
    """
    north, south = Track("north", 0.0, 400.0), Track("south", 0.0, 400.0)
    main = Track("main", 400.0, 2000.0)
    tracks = (north, south, main)
    line = replace(
        straight_line({"west": 300.0, "east": 1500.0}, 2000.0),
        name="merge",
        sections=(Section(0.0, 400.0, (north, south)), Section(400.0, 2000.0, (main,))),
        platforms=(
            platform_for("west", "north", 300.0),
            platform_for("west", "south", 300.0),
            platform_for("east", "main", 1500.0),
        ),
        turnouts=(Turnout("throat", 400.0, 340.0, 410.0),),
        blocks=tuple(b for t in tracks for b in blocks_every(t, block_m)) if block_m else (),
    )
    services = []
    for index in range(trains):
        track = "south" if index % 2 else "north"
        ready_s = 25_200.0 + index * headway_s
        booked = _booked({"west": 300.0, "east": 1500.0}, track, ready_s, run_s, dwell_s)
        calls = (booked[0], replace(booked[1], track="main"))
        services.append(Service(f"T{index + 1}", "west", "commuter", (track, "main"), calls))
    return make_scenario(line, services, delays=delays, step_s=step_s)
