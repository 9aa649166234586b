"""A GTFS feed whose times are those at which trains arrived and departed."""

import csv
import io
import zipfile
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.tables.causes import Seen
from kankaku.analysis.tables.columns import clock_texts, rows_of
from kankaku.analysis.tables.run_tables import RunTables

RAIL = 2
"""Kind of a route: rail. [-]"""
ROUTE = "line"
"""Identifier of the one route, which has both directions."""
LEAST_STOPS = 2
"""A trip with fewer stops is none. [-]"""
_MADE = (1980, 1, 1, 0, 0, 0)
"""Of every file in the archive, so that the same run gives the same bytes."""


class GtfsNames(NamedTuple):
    """What results do not tell and a feed has to."""

    line: str
    """What the line is called."""
    agency: str
    timezone: str
    """Of the times of day, by the name of the IANA database."""
    first_day: str
    """``YYYYMMDD``; the service runs on this day alone."""
    places_deg: Mapping[str, tuple[float | None, float | None]]
    """Longitude and latitude of stations by identifier; None is left empty."""
    local_names: Mapping[str, str]
    """Names in local letters by identifier."""


class GtfsFeed(NamedTuple):
    """A feed, and what is not in it."""

    archive: bytes
    left_out: tuple[str, ...]
    """Trains that reached fewer than two stations."""


def gtfs_feed(run: RunTables, stations: pd.DataFrame, names: GtfsNames) -> GtfsFeed:
    """
    Return a run as a GTFS feed.

    Parameters
    ----------
    run
        A run.
    stations
        The table ``stations``.
    names
        What has to be told beside it.

    Returns
    -------
    GtfsFeed
        Times to the nearest second, hours from 24 on after midnight. A call that was never reached
        is left out, and so is a train with fewer than two. ``stop_times.txt`` has the booked
        times and the delays in columns of its own, which readers of GTFS pass over.

    References
    ----------
    .. [1] MobilityData, *General Transit Feed Specification Reference*.
    """
    seen = Seen(run)
    trips, stop_times, left_out = [], [], []
    at_m = dict(zip(stations["station"], stations["chainage_m"], strict=True))
    for train in seen.trains:
        calls = rows_of(seen.calls(train))
        reached = [call for call in calls if np.isfinite(call["arrival_s"])]
        if len(reached) < LEAST_STOPS:
            left_out.append(train)
            continue
        first, last = calls[0]["station"], calls[-1]["station"]
        falls = int(at_m[last] < at_m[first])
        trips.append([ROUTE, "run", train, train, last, falls])
        stop_times += [_stop_time(train, call, calls[0]["stop_m"]) for call in reached]
    files: dict[str, Sequence[Sequence[object]]] = {
        "agency.txt": _agency(names),
        "stops.txt": _stops(stations, names),
        "routes.txt": [
            ["route_id", "agency_id", "route_short_name", "route_long_name", "route_type"],
            [ROUTE, "line", "", names.line, RAIL],
        ],
        "trips.txt": [
            [
                *("route_id", "service_id", "trip_id", "trip_short_name", "trip_headsign"),
                "direction_id",
            ],
            *trips,
        ],
        "stop_times.txt": [STOP_TIMES, *stop_times],
        "calendar_dates.txt": [
            ["service_id", "date", "exception_type"],
            ["run", names.first_day, 1],
        ],
        "feed_info.txt": [
            ["feed_publisher_name", "feed_publisher_url", "feed_lang", "feed_version"],
            ["Kankaku", "https://example.org", "en", f"{run.controller}, seed {run.seed}"],
        ],
    }
    return GtfsFeed(feed_archive(files), tuple(left_out))


STOP_TIMES = [
    "trip_id",
    "arrival_time",
    "departure_time",
    "stop_id",
    "stop_sequence",
    "shape_dist_traveled",
    "timepoint",
    "booked_arrival_time",
    "booked_departure_time",
    "arrival_delay_s",
]


def _stop_time(train: str, call: Mapping[str, float], origin_m: float) -> list[object]:
    arrival_s = call["arrival_s"]
    departure_s = call["departure_s"] if np.isfinite(call["departure_s"]) else arrival_s
    times = clock_texts(
        np.array([arrival_s, departure_s, call["booked_arrival_s"], call["booked_departure_s"]])
    )
    apart_m = abs(call["stop_m"] - origin_m)
    sequence, station = int(call["sequence"]), call["station"]
    delay = f"{call['arrival_delay_s']:.3f}"
    return [train, *times[:2], station, sequence, f"{apart_m:.1f}", 1, *times[2:], delay]


def _agency(names: GtfsNames) -> list[list[object]]:
    header: list[object] = ["agency_id", "agency_name", "agency_url", "agency_timezone"]
    return [header, ["line", names.agency, "https://example.org", names.timezone]]


def _stops(stations: pd.DataFrame, names: GtfsNames) -> list[list[object]]:
    rows: list[list[object]] = [["stop_id", "stop_name", "stop_desc", "stop_lat", "stop_lon"]]
    for station in rows_of(stations):
        name = station["station"]
        longitude_deg, latitude_deg = names.places_deg[name]
        local = names.local_names.get(name, "")
        degrees = [
            "" if degree is None else f"{degree:.6f}" for degree in (latitude_deg, longitude_deg)
        ]
        rows.append([name, station["name"], local, *degrees])
    return rows


def feed_archive(files: Mapping[str, Sequence[Sequence[object]]]) -> bytes:
    """
    Return tables as a feed in one file.

    Parameters
    ----------
    files
        Rows with their header, by name of the file.

    Returns
    -------
    bytes
        A zip archive, the same for the same tables.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, rows in files.items():
            text = io.StringIO()
            csv.writer(text, lineterminator="\n").writerows(rows)
            archive.writestr(zipfile.ZipInfo(name, _MADE), text.getvalue().encode())
    return buffer.getvalue()
