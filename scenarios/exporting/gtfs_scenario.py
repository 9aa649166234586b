"""The timetable of a scenario as the tables of a GTFS feed."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from kankaku.railway.plan.line import Station
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.timetable import Service
from kankaku.scenarios.reading.units import clock_of

RAIL = 2
"""Kind of a route: rail. [-]"""
ROUTE, AGENCY, DAYS = "line", "line", "day"

Tables = dict[str, Sequence[Sequence[object]]]


class TimetableFeed(NamedTuple):
    """Tables of a feed, and what is not in them."""

    tables: Tables
    """Rows with their header, by file."""
    left_out: tuple[str, ...]
    """Trains with fewer than two calls."""


def timetable_feed(scenario: Scenario, timezone: str, first_day: str) -> TimetableFeed:
    """
    Return the booked times of a scenario as a GTFS feed.

    Parameters
    ----------
    scenario
        The scenario.
    timezone
        Of the times of day, by the name of the IANA database.
    first_day
        ``YYYYMMDD``; the service runs on this day alone.

    Returns
    -------
    TimetableFeed
        Times in whole seconds, hours from 24 on after midnight; distances in metres. Trains of
        the same stock have one ``block_id``.

    References
    ----------
    .. [1] MobilityData, *General Transit Feed Specification Reference*.
    """
    stations = {station.id: station for station in scenario.line.stations}
    services = [one for one in scenario.timetable.services if len(one.calls) > 1]
    kept = {one.train for one in services}
    left_out = tuple(one.train for one in scenario.timetable.services if one.train not in kept)
    block_of = blocks(scenario.timetable.services)
    trips: list[Sequence[object]] = []
    times: list[Sequence[object]] = []
    for service in services:
        first, last = (stations[service.calls[at].station] for at in (0, -1))
        falls = int(last.chainage_m < first.chainage_m)
        block = block_of.get(service.train, "")
        trips.append([ROUTE, DAYS, service.train, service.train, last.name, falls, block])
        times += _stop_times(service, stations)
    tables: Tables = {
        "agency.txt": [
            ["agency_id", "agency_name", "agency_url", "agency_timezone"],
            [AGENCY, scenario.name, "https://example.org", timezone],
        ],
        "stops.txt": _stops(scenario.line.stations),
        "routes.txt": [
            ["route_id", "agency_id", "route_short_name", "route_long_name", "route_type"],
            [ROUTE, AGENCY, "", scenario.title, RAIL],
        ],
        "trips.txt": [TRIPS, *trips],
        "stop_times.txt": [STOP_TIMES, *times],
        "calendar_dates.txt": [["service_id", "date", "exception_type"], [DAYS, first_day, 1]],
        "feed_info.txt": [
            ["feed_publisher_name", "feed_publisher_url", "feed_lang", "feed_version"],
            ["Kankaku", "https://example.org", "en", f"booked times of {scenario.name}"],
        ],
    }
    return TimetableFeed(tables, left_out)


TRIPS = [
    *("route_id", "service_id", "trip_id", "trip_short_name", "trip_headsign"),
    *("direction_id", "block_id"),
]
STOP_TIMES = [
    *("trip_id", "arrival_time", "departure_time", "stop_id", "stop_sequence"),
    *("shape_dist_traveled", "timepoint"),
]


def blocks(services: Sequence[Service]) -> dict[str, str]:
    """
    Return which trains have one stock.

    Parameters
    ----------
    services
        The trains.

    Returns
    -------
    dict[str, str]
        The first train of the stock by train; trains that neither take over stock nor hand it on
        are not there.
    """
    following = {one.train: one.next_train for one in services if one.next_train}
    taken = {*following.values()}
    found = {}
    for first in following:
        train = first
        if first in taken:
            continue
        while train:
            found[train] = first
            train = following.get(train, "")
    return found


def _stop_times(service: Service, stations: Mapping[str, Station]) -> list[Sequence[object]]:
    origin_m = stations[service.calls[0].station].chainage_m
    rows: list[Sequence[object]] = []
    for number, call in enumerate(service.calls, 1):
        times = (clock_of(round(time_s)) for time_s in (call.arrival_s, call.departure_s))
        apart_m = abs(stations[call.station].chainage_m - origin_m)
        rows.append([service.train, *times, call.station, number, f"{apart_m:.1f}", 1])
    return rows


def _stops(stations: Sequence[Station]) -> list[Sequence[object]]:
    rows: list[Sequence[object]] = [["stop_id", "stop_name", "stop_desc", "stop_lat", "stop_lon"]]
    for station in stations:
        degrees = [
            "" if degree is None else f"{degree:.8f}"
            for degree in (station.latitude_deg, station.longitude_deg)
        ]
        rows.append([station.id, station.name, station.name_local, *degrees])
    return rows
