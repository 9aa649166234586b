"""The files of a timetable to services, with the way of each train over the tracks of the line."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from kankaku.railway.plan.line import Line
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.timetable import Call, Service, Timetable
from kankaku.scenarios.checks.check_timetable import TimetableTables, calls_by_train, seconds
from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.checks.network_ways import directed, route_in
from kankaku.scenarios.checks.ways import ends_on_the_way, route_of
from kankaku.scenarios.reading.row_formats import CallRow, ServiceRow
from kankaku.scenarios.reading.units import metres


def to_timetable(
    timetable: TimetableTables,
    tables: LineTables,
    line: Line,
    train_types: Mapping[str, TrainType],
    turn_back_s: float,
) -> Timetable:
    """
    Convert a timetable to SI units.

    Parameters
    ----------
    timetable
        Its files, without mistakes.
    tables
        The files of the line.
    line
        The line.
    train_types
        Train types by identifier.
    turn_back_s
        Least time from the arrival of a train to its departure in the other direction. [s]

    Returns
    -------
    Timetable
        The services.
    """
    if not line.network:
        return Timetable(tuple(_on_chain(timetable, tables)))
    calls = calls_by_train(timetable)
    services = [
        _in_network(row, calls[row.train], timetable, line, tables) for row in timetable.services
    ]
    row_of = {service.train: row for row, service in enumerate(services)}
    for before in tuple(services):
        if before.next_train:
            row = row_of[before.next_train]
            length_m = train_types[before.train_type].length_m
            services[row] = _taken_over(line, before, services[row], length_m, turn_back_s)
    return Timetable(tuple(services))


def _on_chain(timetable: TimetableTables, line: LineTables) -> list[Service]:
    stop_m = {place: metres(platform.stop_km) for place, platform in line.platform_at.items()}
    calls = calls_by_train(timetable)
    sections = line.sections
    return [
        Service(
            train=service.train,
            origin=calls[service.train][0].station,
            train_type=service.train_type,
            route=tuple(
                sections[number][index].id for number, index in route_of(line, calls[service.train])
            ),
            calls=tuple(
                _to_call(timetable, call, call.track, stop_m[call.station, call.track])
                for call in calls[service.train]
            ),
            leaves_at_last_call=ends_on_the_way(line, calls[service.train]),
        )
        for service in timetable.services
    ]


def _in_network(
    row: ServiceRow,
    calls: Sequence[CallRow],
    timetable: TimetableTables,
    line: Line,
    tables: LineTables,
) -> Service:
    """Return a service, which ends at its last call."""
    way = route_in(line, tables, row, calls)
    found = []
    for call in calls:
        track = directed(line, call.track, way.direction)
        stop_m = line.platform_at[call.station, track].stop_m
        found.append(_to_call(timetable, call, track, stop_m))
    return Service(
        train=row.train,
        origin=calls[0].station,
        train_type=row.train_type,
        route=way.tracks,
        calls=tuple(found),
        leaves_at_last_call=True,
        next_train=row.next_train,
    )


def _to_call(timetable: TimetableTables, call: CallRow, track: str, stop_m: float) -> Call:
    """Return a call, with the dwell that holds for its train at its booked departure."""
    departure_s = float(seconds(call.departure))
    dwell = timetable.dwells.held(call.station, timetable.type_of_train[call.train], departure_s)
    return Call(
        station=call.station,
        track=track,
        stop_m=stop_m,
        arrival_s=float(seconds(call.arrival)),
        departure_s=departure_s,
        minimum_dwell_s=dwell.minimum_dwell_s,
        delay_scale=dwell.delay_scale,
    )


def _taken_over(
    line: Line, before: Service, service: Service, length_m: float, turn_back_s: float
) -> Service:
    """Return a service that begins with the stock of another one, where that stands."""
    ends, begins = before.calls[-1], service.calls[0]
    there, here = (line.track_by_id[call.track] for call in (ends, begins))
    if there.direction is here.direction:
        # It goes on as it stands, as soon as it may.
        first, turn_back_s = replace(begins, minimum_dwell_s=0.0), 0.0
    else:
        turning_s = max(turn_back_s - ends.minimum_dwell_s, 0.0)
        first = replace(
            begins,
            stop_m=line.mirrored_m(ends.stop_m - length_m),
            minimum_dwell_s=max(begins.minimum_dwell_s, turning_s),
        )
    return replace(service, calls=(first, *service.calls[1:]), turn_back_s=turn_back_s)
