"""Example lines whose trains end on the way, or at the very end of a track."""

from dataclasses import replace

from kankaku.railway.plan.dwell import DwellDelays
from kankaku.railway.plan.line import Platform, Section, Track
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.timetable import Call, Service
from kankaku.testing.example_lines import make_scenario, straight_line


def short_turn_scenario(
    trains: int = 4,
    headway_s: float = 90.0,
    *,
    block_m: float | None = None,
    delays: DwellDelays | None = None,
    step_s: float = 0.5,
) -> Scenario:
    """
    Return a scenario in which every second train ends on the way.

    Parameters
    ----------
    trains
        Number of trains, named ``T1`` onwards; even ones end at ``mid``. [-]
    headway_s
        Booked interval. [s]
    block_m
        Length of the signal blocks; no signals where None. [m]
    delays
        Dwell delays; none where None.
    step_s
        Length of a step. [s]

    Returns
    -------
    Scenario
        One track with stops at 300 m, 1500 m and 3500 m; the line ends at 4000 m.
    """
    stops_m = {"west": 300.0, "mid": 1500.0, "east": 3500.0}
    booked_s = {"west": 0.0, "mid": 120.0, "east": 270.0}
    services = []
    for index in range(trains):
        ready_s = 25_200.0 + index * headway_s
        calls = tuple(
            Call(name, "main", stops_m[name], ready_s + at_s, ready_s + at_s + 30.0, 25.0)
            for name, at_s in booked_s.items()
        )
        short = index % 2 == 1
        service = Service(f"T{index + 1}", "west", "commuter", ("main",), calls[: 3 - short])
        services.append(replace(service, leaves_at_last_call=short))
    line = straight_line(stops_m, 4000.0, block_m=block_m)
    return make_scenario(line, services, delays=delays, step_s=step_s)


def joint_scenario(beyond_m: float, *, through: bool = False, step_s: float = 0.5) -> Scenario:
    """
    Return one train on two tracks one behind the other, that stops where each of them ends.

    Parameters
    ----------
    beyond_m
        Track beyond each stop position. [m]
    through
        The train does not call at the second one, and runs out of the line.
    step_s
        Length of a step. [s]

    Returns
    -------
    Scenario
        Stops at 200 m, where the train's tail stands at the very start, 1200 m and 2200 m.
    """
    stops_m = {"west": 200.0, "mid": 1200.0, "east": 2200.0}
    joint_m, end_m = stops_m["mid"] + beyond_m, stops_m["east"] + beyond_m
    tracks = Track("one", 0.0, joint_m), Track("two", joint_m, end_m)
    track_of = {"west": "one", "mid": "one", "east": "two"}
    line = replace(
        straight_line(stops_m, end_m),
        sections=tuple(Section(track.start_m, track.end_m, (track,)) for track in tracks),
        platforms=tuple(
            Platform(name, track_of[name], stop_m - 200.0, stop_m, stop_m)
            for name, stop_m in stops_m.items()
        ),
    )
    calls = tuple(
        Call(name, track_of[name], stop_m, ready_s, ready_s + 30.0, 25.0)
        for ready_s, (name, stop_m) in zip(
            (25_200.0, 25_320.0, 25_440.0), stops_m.items(), strict=True
        )
    )
    calls = calls[:2] if through else calls
    return make_scenario(
        line, [Service("T1", "west", "commuter", ("one", "two"), calls)], step_s=step_s
    )
