"""Level crossings and disruptions in SI units."""

import numpy as np

from kankaku.railway.plan.disruptions import Cause, Closure, Disruptions, Obstacle, PointsFailure
from kankaku.railway.plan.line import Crossing, Line, Turnout
from kankaku.scenarios.checks.check_timetable import seconds
from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.reading.schema import ClosureEntry, ScenarioFile, WindowEntry, WorkZoneEntry
from kankaku.scenarios.reading.units import metres


def to_turnouts(tables: LineTables) -> tuple[Turnout, ...]:
    """
    Convert turnouts to SI units.

    Parameters
    ----------
    tables
        Files without mistakes.

    Returns
    -------
    tuple[Turnout, ...]
        The turnouts.
    """
    return tuple(
        Turnout(
            row.id,
            metres(row.position_km),
            metres(row.fouling_start_km),
            metres(row.fouling_end_km),
            row.throw_s,
            row.proof_s,
        )
        for row in tables.turnouts
    )


def to_crossings(tables: LineTables) -> tuple[Crossing, ...]:
    """
    Convert level crossings to SI units.

    Parameters
    ----------
    tables
        Files without mistakes.

    Returns
    -------
    tuple[Crossing, ...]
        The crossings.
    """
    return tuple(
        Crossing(
            row.id,
            metres(row.start_km),
            metres(row.end_km),
            metres(row.strike_in_km),
            row.closing_s,
        )
        for row in tables.crossings
    )


def to_disruptions(main: ScenarioFile, line: Line) -> Disruptions:
    """
    Convert what goes wrong beside the track to SI units.

    Parameters
    ----------
    main
        Main file without mistakes.
    line
        The line.

    Returns
    -------
    Disruptions
        The disruptions.
    """
    chance = main.random_disruptions
    return Disruptions(
        closures=tuple(
            _to_closure(entry, line) for entry in (*main.work_zones, *main.equipment_faults)
        ),
        points_failures=tuple(
            PointsFailure(entry.turnout, *_window_s(entry)) for entry in main.points_failures
        ),
        obstacles=tuple(
            Obstacle(entry.crossing, *_window_s(entry)) for entry in main.crossing_obstacles
        ),
        points_failure_ratio=chance.points_failure_percent / 100.0,
        points_repair_s=chance.points_repair_s,
        obstacle_ratio=chance.obstacle_percent / 100.0,
        obstacle_s=chance.obstacle_s,
    )


def _to_closure(entry: ClosureEntry, line: Line) -> Closure:
    start_m, end_m = metres(entry.start_km), metres(entry.end_km)
    from_s, to_s = _window_s(entry)
    work = isinstance(entry, WorkZoneEntry)
    late = entry.released if isinstance(entry, WorkZoneEntry) else None
    return Closure(
        id=entry.id,
        cause=Cause.WORK if work else Cause.FAILURE,
        tracks=entry.tracks or line.tracks_between(start_m, end_m),
        start_m=start_m,
        end_m=end_m,
        from_s=from_s,
        # Nobody knows beforehand how long a repair will take.
        until_s=to_s if work else np.inf,
        released_s=to_s if late is None else float(seconds(late)),
    )


def _window_s(entry: WindowEntry) -> tuple[float, float]:
    return float(seconds(entry.from_)), float(seconds(entry.to))
