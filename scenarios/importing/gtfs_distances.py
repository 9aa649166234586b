"""Distances along a line: from ``shape_dist_traveled``, from shapes, or as the crow flies."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from math import cos, radians
from statistics import median

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.earth import EARTH_RADIUS_M, distance_m
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.importing.gtfs_files import refuse
from kankaku.scenarios.importing.gtfs_stations import FeedStation
from kankaku.scenarios.importing.gtfs_tables import FeedStop, ShapePoint
from kankaku.scenarios.importing.gtfs_trips import DayTrip
from kankaku.scenarios.reading.mistakes import Mistake, row_place

UNITS_M = {"metres": 1.0, "kilometres": 1000.0, "feet": 0.3048, "miles": 1609.344}
"""In which feeds may measure. [m]"""
LEAST_RATIO, MOST_RATIO = 0.9, 1.7
"""Between these lies a measured length over the great-circle distance. [-]"""
MOST_APART_M = 500_000.0
"""Between two stations that follow each other; more is a wrong coordinate. [m]"""
FARTHEST_M = 400.0
"""Platforms lie no farther from the shape of their trip. [m]"""
MOST_POINTS = 20_000
"""Of a shape. [-]"""
MOST_TRIED = 100
"""Shapes, where trips name none. [-]"""
_PATTERNS = 200
"""Of a line; more would say the same. [-]"""

Pair = tuple[str, str]


def chainages_km(
    line: Sequence[FeedStation],
    trips: Sequence[DayTrip],
    stops: Mapping[str, FeedStop],
    station_of: Mapping[str, str],
    shapes: Mapping[str, Sequence[ShapePoint]],
    notes: SourceNotes,
) -> list[float]:
    """
    Return where stations lie.

    Parameters
    ----------
    line
        In order.
    trips
        Trains along the line.
    stops
        By identifier.
    station_of
        Station by stop.
    shapes
        Ways of trips by identifier.
    notes
        Are told what distances rest on.

    Returns
    -------
    list[float]
        Chainages; 0 is the first station's. [km]

    Raises
    ------
    SourceError
        If two stations have neither coordinates nor a measured distance, or lie too far apart.
    """
    patterns = {
        (trip.shape, tuple(call.stop for call in trip.calls)): trip for trip in reversed(trips)
    }
    used = list(patterns.values())[-_PATTERNS:]
    straight_m = _straight_m(line)
    measured_m = _measured_m(used, station_of, straight_m, notes)
    if not any(trip.shape for trip in trips):
        used, shapes = _fitting(used, stops, shapes, notes)
    drawn_m = _drawn_m(used, stops, station_of, shapes, notes)
    lengths_m: list[float] = []
    basis: dict[str, list[str]] = {"measured": [], "shape": [], "straight": []}
    for one, other in pairwise(line):
        pair = one.id, other.id
        straight = straight_m.get(pair)
        for name, found in (("measured", measured_m), ("shape", drawn_m)):
            length_m = found.get(pair)
            if length_m and (straight is None or length_m > LEAST_RATIO * straight):
                basis[name].append(f"{one.id} to {other.id}")
                lengths_m.append(length_m)
                break
        else:
            if straight is None:
                _refuse_unplaced((one, other), stops, station_of)
            basis["straight"].append(f"{one.id} to {other.id}")
            lengths_m.append(straight or 0.0)
    _refuse_far(line, lengths_m, stops, station_of)
    _tell(basis, notes)
    ends_m = np.concatenate([[0.0], np.cumsum(lengths_m)])
    return [round(float(end_m) / 1000.0, 3) for end_m in ends_m]


def _refuse_far(
    line: Sequence[FeedStation],
    lengths_m: Sequence[float],
    stops: Mapping[str, FeedStop],
    station_of: Mapping[str, str],
) -> None:
    mistakes = []
    for number, length_m in enumerate(lengths_m):
        if length_m > MOST_APART_M:
            one, other = line[number], line[number + 1]
            (row, *_) = (stop.row for stop in stops.values() if station_of.get(stop.id) == other.id)
            problem = f"{other.name!r} lies {length_m / 1000.0:.0f} km from {one.name!r}"
            allowed = f"up to {MOST_APART_M / 1000.0:g} km between two stations"
            mistakes.append(Mistake("stops.txt", row_place(row, "stop_lat"), problem, allowed))
    if mistakes:
        refuse(mistakes)


def _refuse_unplaced(
    pair: Sequence[FeedStation], stops: Mapping[str, FeedStop], station_of: Mapping[str, str]
) -> None:
    names = {station.id for station in pair if station.lat_deg is None}
    allowed = "coordinates, or shape_dist_traveled in stop_times.txt"
    refuse(
        [
            Mistake("stops.txt", row_place(stop.row, "stop_lat"), "is empty", allowed)
            for stop in stops.values()
            if station_of.get(stop.id) in names
        ]
    )


def _tell(basis: Mapping[str, Sequence[str]], notes: SourceNotes) -> None:
    if basis["measured"]:
        notes.take("distances", "stop_times.txt: shape_dist_traveled")
    if basis["shape"]:
        notes.take("distances", "shapes.txt, between the points nearest to the platforms")
    straight = basis["straight"]
    if straight:
        whole = not basis["measured"] and not basis["shape"]
        value = "great-circle" + ("" if whole else f" from {', '.join(straight)}")
        why = "the feed has no usable shape there; a real line is rather longer"
        notes.assume("distances between stations", value, why)


def _straight_m(line: Sequence[FeedStation]) -> dict[Pair, float]:
    found = {}
    for one, other in pairwise(line):
        if one.lat_deg is None or other.lat_deg is None:
            continue
        places = (one.lon_deg or 0.0, one.lat_deg), (other.lon_deg or 0.0, other.lat_deg)
        found[one.id, other.id] = distance_m(*places)
    return found


def _medians(found: Mapping[Pair, Sequence[float]]) -> dict[Pair, float]:
    return {pair: median(values) for pair, values in found.items()}


def _measured_m(
    trips: Sequence[DayTrip],
    station_of: Mapping[str, str],
    straight_m: Mapping[Pair, float],
    notes: SourceNotes,
) -> dict[Pair, float]:
    """Return distances by ``shape_dist_traveled``, of pairs in the order of the line. [m]"""
    found: dict[Pair, list[float]] = {}
    for trip in trips:
        for one, other in pairwise(trip.calls):
            if one.distance is None or other.distance is None or other.distance <= one.distance:
                continue
            pair = station_of[one.stop], station_of[other.stop]
            for way in (pair, pair[::-1]):
                found.setdefault(way, []).append(other.distance - one.distance)
    apart = _medians(found)
    common = [pair for pair in straight_m if pair in apart and straight_m[pair] > 0.0]
    if not apart:
        return {}
    unit = "metres"
    if common:
        straight = sum(straight_m[pair] for pair in common)
        ratio = sum(apart[pair] for pair in common) / straight
        fits = {
            name: ratio * unit_m
            for name, unit_m in UNITS_M.items()
            if LEAST_RATIO <= ratio * unit_m <= MOST_RATIO
        }
        if not fits:
            told = "shape_dist_traveled, which fits the coordinates in no unit"
            notes.miss(told, "distances are worked out without it")
            return {}
        unit = min(fits, key=lambda name: abs(fits[name] - 1.0))
    notes.assume("unit of shape_dist_traveled", unit, "the feed does not name it; it fits best")
    return {pair: value * UNITS_M[unit] for pair, value in apart.items()}


def _fitting(
    trips: Sequence[DayTrip],
    stops: Mapping[str, FeedStop],
    shapes: Mapping[str, Sequence[ShapePoint]],
    notes: SourceNotes,
) -> tuple[list[DayTrip], Mapping[str, Sequence[ShapePoint]]]:
    """Return the longest trip with a shape that it fits, where no trip names one."""
    longest = max(trips, key=lambda trip: len(trip.calls))
    places_deg = [
        (stop.lat_deg, stop.lon_deg)
        for stop in (stops[call.stop] for call in longest.calls)
        if stop.lat_deg is not None and stop.lon_deg is not None
    ]
    if len(places_deg) < len(longest.calls):
        return [], {}
    straight_m = sum(distance_m(a[::-1], b[::-1]) for a, b in pairwise(places_deg))
    for name, points in list(shapes.items())[:MOST_TRIED]:
        for way in (points, points[::-1]) if len(points) <= MOST_POINTS else ():
            places_m = along_shape_m(way, places_deg)
            if places_m is None or any(b <= a for a, b in pairwise(places_m)):
                continue
            if LEAST_RATIO <= (places_m[-1] - places_m[0]) / max(straight_m, 1.0) <= MOST_RATIO:
                notes.assume(
                    "shape of the line", name, "trips name none; all stations lie along it"
                )
                return [replace(longest, shape=name)], {name: way}
    return [], {}


def _drawn_m(
    trips: Sequence[DayTrip],
    stops: Mapping[str, FeedStop],
    station_of: Mapping[str, str],
    shapes: Mapping[str, Sequence[ShapePoint]],
    notes: SourceNotes,
) -> dict[Pair, float]:
    """Return distances along shapes. [m]"""
    found: dict[Pair, list[float]] = {}
    far = []
    for trip in trips:
        points = shapes.get(trip.shape, ())
        own = [stops[call.stop] for call in trip.calls]
        if not 2 <= len(points) <= MOST_POINTS or any(stop.lat_deg is None for stop in own):
            continue
        places = along_shape_m(points, [(stop.lat_deg or 0.0, stop.lon_deg or 0.0) for stop in own])
        if places is None:
            far.append(trip.shape)
            continue
        for (one, start_m), (other, end_m) in pairwise(zip(own, places, strict=True)):
            pair = station_of[one.id], station_of[other.id]
            for way in (pair, pair[::-1]):
                found.setdefault(way, []).append(end_m - start_m)
    if far:
        told = f"shapes {', '.join(sorted(set(far)))}, {FARTHEST_M:g} m or more from platforms"
        notes.miss(told, "distances are worked out without them")
    return _medians(found)


def along_shape_m(
    points: Sequence[ShapePoint], places_deg: Sequence[tuple[float, float]]
) -> list[float] | None:
    """
    Return where on a shape places lie that it comes to one after the other.

    Parameters
    ----------
    points
        Of the shape, two or more.
    places_deg
        Latitude and longitude of the places, in running order. [deg]

    Returns
    -------
    list[float] | None
        Distances from the start of the shape, never falling, so that the places lie as near to it
        as they can; nothing if one of them is too far away. [m]
    """
    origin = points[0]
    scale = np.array([1.0, cos(radians(origin.lat_deg))]) * radians(1.0) * EARTH_RADIUS_M

    def level_m(degrees: Sequence[tuple[float, float]]) -> FloatArray:
        around = np.array(degrees, dtype=float) - (origin.lat_deg, origin.lon_deg)
        flat: FloatArray = around * scale
        return flat

    bends_m = level_m([(point.lat_deg, point.lon_deg) for point in points])
    steps_m = np.diff(bends_m, axis=0)
    lengths_m = np.hypot(*steps_m.T)
    starts_m = np.concatenate([[0.0], np.cumsum(lengths_m)[:-1]])
    square = np.where(lengths_m > 0.0, lengths_m**2, 1.0)
    costs, chosen, ways_m, off_m = np.zeros(len(lengths_m)), [], [], []
    for place in level_m(places_deg):
        share = np.clip(((place - bends_m[:-1]) * steps_m).sum(axis=1) / square, 0.0, 1.0)
        nearest = bends_m[:-1] + share[:, None] * steps_m
        away_m = np.hypot(*(place - nearest).T)
        # The cheapest way to come here from a piece before, or from this one.
        best = np.minimum.accumulate(costs)
        is_new = np.concatenate([[True], costs[1:] < best[:-1]])
        chosen.append(np.maximum.accumulate(np.where(is_new, np.arange(len(costs)), 0)))
        costs = best + away_m**2
        ways_m.append(starts_m + share * lengths_m)
        off_m.append(away_m)
    piece = int(np.argmin(costs))
    found_m = []
    for number in reversed(range(len(ways_m))):
        if off_m[number][piece] > FARTHEST_M:
            return None
        found_m.append(float(ways_m[number][piece]))
        piece = int(chosen[number][piece])
    return [max(found_m[number:]) for number in range(len(found_m))][::-1]
