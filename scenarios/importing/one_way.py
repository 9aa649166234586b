"""
A line in one running direction, from a source that has tracks: a chain with one track.

Trains stop with their fronts at the chainage of a station, as sources of tracks tell stops. Where
the source ends at a stop the line goes on, level and straight, for trains must stand somewhere.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import ceil
from typing import Any

from kankaku.scenarios.drafts.draft import Draft
from kankaku.scenarios.drafts.equipment import blocks_between, equip
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.sketch import DraftTrip, Sketch, Stop
from kankaku.scenarios.importing.formats import SourceError
from kankaku.scenarios.reading.mistakes import Mistake
from kankaku.scenarios.reading.row_formats import (
    BlockRow,
    CallRow,
    CurveRow,
    DwellStationRow,
    GradientRow,
    LimitRow,
    PlatformRow,
    ServiceRow,
    StationRow,
    TrackRow,
)
from kankaku.scenarios.reading.units import clock_of

BEFORE_M, BEYOND_M = 200.0, 300.0
"""From the line's ends to the first and the last stop where no track is told. [m]"""
MARGIN_M = 10.0
"""From either end of a train to that of its platform, and of the line. [m]"""
LEAST_APART_M = 50.0
"""Between two stops. [m]"""
DWELL_S, LEAST_DWELL_S = 30, 20
"""Booked, and what a train cannot do without. [s]"""
LATEST_S = 99 * 3600
"""No file tells a later time. [s after midnight]"""


@dataclass
class OneWay:
    """
    A line in one direction before it has trains.

    Raises
    ------
    SourceError
        If there are fewer than two stops, or two are too near to each other.
    """

    title: str
    notes: SourceNotes
    stops: tuple[Stop, ...]
    train_types: Mapping[str, Mapping[str, Any]]
    """Tables ``[train.NAME]`` by name."""
    extent_km: tuple[float, float]
    """Where the source has tracks."""
    limits: list[LimitRow] = field(default_factory=list)
    gradients: list[GradientRow] = field(default_factory=list)
    curves: list[CurveRow] = field(default_factory=list)
    block_edges_km: tuple[float, ...] = ()
    """Where the source has signals; none: no blocks are told."""
    net_brake: bool = False
    """Trains reach their brake rates on any gradient."""
    goes_on: bool = False
    """Limits and gradients at either end hold beyond it, too."""

    def __post_init__(self) -> None:
        """Refuse a line on which no train can be booked."""
        _refuse_stops(self)

    @property
    def longest_m(self) -> float:
        """Length of the longest train. [m]"""
        return max(float(entry["length_m"]) for entry in self.train_types.values())

    @property
    def sketch(self) -> Sketch:
        """The line as :class:`Runs` wants it."""
        return Sketch(
            title=self.title,
            notes=self.notes,
            stops=self.stops,
            trips=(),
            train_types=self.train_types,
            limits=self.limits,
            gradients=self.gradients,
            curves=self.curves,
        )


def drafted(way: OneWay, trips: Sequence[DraftTrip]) -> Draft:
    """
    Return the scenario of a line in one direction.

    Parameters
    ----------
    way
        The line.
    trips
        Its trains, in the order in which they run.

    Returns
    -------
    Draft
        A chain with one track, and four controllers.

    Raises
    ------
    SourceError
        If a train ends later than files can tell.
    """
    late = [trip.id for trip in trips if trip.calls[-1].departure_s > LATEST_S]
    if late:
        problem, allowed = f"train {late[0]!r} ends after 99 hours", "trains that end before"
        raise SourceError((str(Mistake(way.title, "timetable", problem, allowed)),))
    start_km, end_km = _extent_km(way)
    name, first = "main", way.stops[0].chainage_km
    length_m = way.longest_m
    draft = Draft(way.title, way.notes, _settings(way), _stock(way))
    draft.rows = {
        "stations.csv": [_station(stop) for stop in way.stops],
        "tracks.csv": [TrackRow(0, start_km, end_km, "line", name)],
        "platforms.csv": [_platform(stop, name, length_m) for stop in way.stops],
        "services.csv": [ServiceRow(0, trip.id, trip.train_type) for trip in trips],
        "calls.csv": [
            CallRow(
                *(0, trip.id, call.station, name),
                *(clock_of(call.arrival_s), clock_of(call.departure_s)),
            )
            for trip in trips
            for call in trip.calls
        ],
        "dwell_stations.csv": [*_dwells(way, trips)],
        "limits.csv": _within(way.limits, (start_km, end_km)),
        "gradients.csv": _within(way.gradients, (start_km, end_km)),
        "curves.csv": _within(way.curves, (start_km, end_km)),
        "blocks.csv": [*_blocks(way, name, (start_km, end_km))],
    }
    if way.goes_on:
        for file in ("limits.csv", "gradients.csv"):
            draft.rows[file] = _reaching(draft.rows[file], first, (start_km, end_km))
    way.notes.assume(
        "platforms",
        f"{length_m + 2.0 * MARGIN_M:g} m, {MARGIN_M:g} m longer than a standing train either way",
        "the source has stops, no platforms",
    )
    equip(draft)
    return draft


def _refuse_stops(way: OneWay) -> None:
    allowed = f"stops {LEAST_APART_M:g} m apart or more, by rising distance"
    told = tuple(
        str(Mistake(way.title, f"stops {one.id!r} and {other.id!r}", "are too near", allowed))
        for one, other in pairwise(way.stops)
        if other.chainage_km - one.chainage_km < LEAST_APART_M / 1000.0 - 1e-9
    )
    if len(way.stops) < 2:
        told = (str(Mistake(way.title, "", f"{len(way.stops)} stops", "two stops or more")),)
    if told:
        raise SourceError(told)


def _extent_km(way: OneWay) -> tuple[float, float]:
    """Return where the line begins and ends, and note how far it was made longer."""
    room_m = way.longest_m + 2.0 * MARGIN_M
    first_km, last_km = way.stops[0].chainage_km, way.stops[-1].chainage_km
    start_km, end_km = way.extent_km
    if first_km - start_km < room_m / 1000.0:
        start_km = first_km - max(BEFORE_M, 10.0 * ceil(room_m / 10.0)) / 1000.0
    if end_km - last_km < 2.0 * MARGIN_M / 1000.0:
        end_km = last_km + BEYOND_M / 1000.0
    longer = [
        f"{1000.0 * by_km:.0f} m {side} what the source has"
        for side, by_km in (
            ("before", way.extent_km[0] - start_km),
            ("beyond", end_km - way.extent_km[1]),
        )
        if by_km > 1e-9
    ]
    if longer:
        how = "as at its end" if way.goes_on else "level and straight"
        why = "trains stand before their stop, and leave the line beyond it"
        way.notes.assume("line goes on", f"{' and '.join(longer)}, {how}", why)
    return _km(start_km), _km(end_km)


def _reaching(rows: Iterable[Any], first_km: float, extent_km: tuple[float, float]) -> list[Any]:
    """Return stretches of which the first and the last reach from end to end of the line."""
    made = list(rows)
    if made and made[0].start_km <= first_km:
        made[0] = replace(made[0], start_km=extent_km[0])
    if made:
        made[-1] = replace(made[-1], end_km=extent_km[1])
    return made


def _within(rows: Iterable[Any], extent_km: tuple[float, float]) -> list[Any]:
    """Return stretches, or their parts, that lie on the line."""
    cut = (
        replace(row, start_km=max(row.start_km, extent_km[0]), end_km=min(row.end_km, extent_km[1]))
        for row in rows
    )
    return [row for row in cut if row.start_km < row.end_km]


def _station(stop: Stop) -> StationRow:
    ends = (stop.name_local, stop.lon_deg, stop.lat_deg)
    return StationRow(0, stop.id, stop.name, stop.chainage_km, *ends)


def _platform(stop: Stop, track: str, length_m: float) -> PlatformRow:
    low_km = _km(stop.chainage_km - (length_m + MARGIN_M) / 1000.0)
    high_km = _km(stop.chainage_km + MARGIN_M / 1000.0)
    return PlatformRow(0, low_km, high_km, stop.id, track, _km(stop.chainage_km))


def _dwells(way: OneWay, trips: Sequence[DraftTrip]) -> list[DwellStationRow]:
    booked_s: dict[str, int] = {}
    for trip in trips:
        for call in trip.calls:
            stay_s = call.departure_s - call.arrival_s
            booked_s[call.station] = min(booked_s.get(call.station, stay_s), stay_s)
    value = f"{LEAST_DWELL_S} s, or the shortest booked one where that is less"
    way.notes.assume("minimum dwell", value, "what a train cannot do without is not in the source")
    rows = []
    for stop in way.stops:
        stay_s = booked_s.get(stop.id, DWELL_S)
        rows.append(DwellStationRow(0, stop.id, min(stay_s, LEAST_DWELL_S), stay_s, 1.0))
    return rows


def _blocks(way: OneWay, track: str, extent_km: tuple[float, float]) -> list[BlockRow]:
    inner = {_km(km) for km in way.block_edges_km}
    edges = [extent_km[0]]
    edges += sorted(km for km in inner if extent_km[0] + 0.001 < km < extent_km[1] - 0.001)
    if len(edges) == 1:
        return []
    edges.append(extent_km[1])
    return [
        BlockRow(0, low, high, f"{track}.{number:02d}", track)
        for number, (low, high) in enumerate(pairwise(edges), 1)
    ]


def even_edges_km(low_km: float, high_km: float, longest_m: float) -> list[float]:
    """
    Return where blocks of equal length begin on a stretch.

    Parameters
    ----------
    low_km, high_km
        The stretch. [km]
    longest_m
        Length that no block exceeds. [m]

    Returns
    -------
    list[float]
        Rising, its beginning included. [km]
    """
    return [row.start_km for row in blocks_between("", (low_km, high_km), longest_m)]


def _settings(way: OneWay) -> dict[str, object]:
    return {
        "schema_version": 1,
        "title": way.title,
        "seed": 1,
        "step_s": 0.1,
        "patience_min": 60.0,
    }


def _stock(way: OneWay) -> dict[str, object]:
    rate = {"brake_rate": "net"} if way.net_brake else {}
    types = {name: dict(entry) for name, entry in way.train_types.items()}
    return {"schema_version": 1, **rate, "train": types}


def _km(value: float) -> float:
    return round(value, 6)
