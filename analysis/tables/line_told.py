"""What readers of results need to know of the line and its trains, beside the tables."""

import math
from collections.abc import Collection, Mapping
from dataclasses import asdict
from itertools import pairwise
from typing import Any

from kankaku.railway.plan.line import Direction, Line
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.routing import onward
from kankaku.railway.plan.scenario import Scenario

LINE_FILE = "line.json"
"""Its file in a results folder."""


def line_told(scenario: Scenario, knows_future: Collection[str] = ()) -> dict[str, Any]:
    """
    Return what a results folder keeps of the scenario beside its tables.

    Parameters
    ----------
    scenario
        What was run.
    knows_future
        Controllers that are told the drawn dwell delays.

    Returns
    -------
    dict[str, Any]
        Title, stations with coordinates, centre line, tracks, platforms, points, limits,
        gradients, curves, blocks, crossings, trains, published figures; places by chainage,
        units in the names.
    """
    line = scenario.line
    told = {
        "title": scenario.title,
        "knows_future": sorted(knows_future),
        "stations": [asdict(station) for station in line.stations],
        "geometry_m_lon_lat_deg": [list(point) for point in line.geometry_lon_lat_deg],
        "tracks": _tracks(line),
        "joints": _joints(line),
        "platforms": [_placed(line, asdict(item), item.track) for item in line.platforms],
        "turnouts": [asdict(item) for item in line.turnouts],
        "limits": [asdict(item) for item in line.limits],
        "gradients": [asdict(item) for item in line.gradients],
        "curves": [asdict(item) for item in line.curves],
        "blocks": [_placed(line, asdict(item), item.track) for item in line.blocks],
        "crossings": [asdict(item) for item in line.crossings],
        "train_types": {name: _train_type(told) for name, told in scenario.train_types.items()},
        "type_of": {item.train: item.train_type for item in scenario.timetable.services},
        "published": asdict(scenario.published) if scenario.published else None,
        "sweep": asdict(scenario.sweep) if scenario.sweep else None,
    }
    return {name: finite(value) for name, value in told.items()}


def finite(value: Any) -> Any:  # noqa: ANN401 - whatever JSON can hold
    """
    Return the same as JSON can hold it.

    Parameters
    ----------
    value
        Numbers, texts, lists, mappings and nothing.

    Returns
    -------
    Any
        With nothing in place of numbers that are not finite.
    """
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(name): finite(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return value


def _tracks(line: Line) -> list[dict[str, Any]]:
    """Return the physical tracks with their places across the line."""
    found: dict[str, dict[str, Any]] = {}
    across = {t.id: float(n) for s in line.sections for n, t in enumerate(s.tracks)}
    for track in line.tracks:
        told = {
            "id": track.physical,
            "start_m": track.start_m,
            "end_m": track.end_m,
            "across": across.get(track.id, track.across),
            "ways": [int(track.direction)],
        }
        _placed(line, told, track.id)
        if track.physical in found:
            found[track.physical]["ways"].append(int(track.direction))
        else:
            found[track.physical] = told
    return list(found.values())


def _joints(line: Line) -> list[list[str]]:
    """Return which physical tracks trains go from and to."""
    if line.network:
        pairs = [(name, after) for name, following in onward(line).items() for after in following]
    else:
        sections = [[track.id for track in section.tracks] for section in line.sections]
        pairs = [
            (one, other) for here, there in pairwise(sections) for one in here for other in there
        ]
    physical = [
        (line.track_by_id[one].physical, line.track_by_id[other].physical) for one, other in pairs
    ]
    return [list(pair) for pair in dict.fromkeys(tuple(sorted(pair)) for pair in physical)]


def _placed(line: Line, told: dict[str, Any], track: str) -> dict[str, Any]:
    """Return the same by chainage, and with the physical track."""
    way = line.track_by_id[track]
    if way.direction is Direction.FALLING:
        start_m, end_m = told["start_m"], told["end_m"]
        told["start_m"], told["end_m"] = line.mirrored_m(end_m), line.mirrored_m(start_m)
        if "stop_m" in told:
            told["stop_m"] = line.mirrored_m(told["stop_m"])
    if "track" in told:
        told["track"] = way.physical
    return told


def _train_type(told: TrainType) -> Mapping[str, Any]:
    return {
        "cars": told.cars,
        "length_m": told.length_m,
        "mass_kg": told.mass_kg,
        "inertial_mass_kg": told.inertial_mass_kg,
        "service_brake_mps2": told.service_brake_mps2,
        "maximum_speed_mps": told.maximum_speed_mps,
        "resistance": asdict(told.resistance),
        "curve_resistance_m": told.curve_resistance_m,
        "supply": asdict(told.supply),
    }
