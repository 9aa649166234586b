"""
Vehicle positions of GTFS-realtime: reports of trains from JSON or protobuf messages.

Field numbers are those of ``gtfs-realtime.proto``; of its wire format no more is read than the
fields that tell where a train stands.

References
----------
.. [1] MobilityData, *GTFS Realtime Reference*, version 2.0.
"""

import json
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

STOPPED = "STOPPED_AT"
_STATES = {0: "INCOMING_AT", 1: STOPPED, 2: "IN_TRANSIT_TO"}
_VARINT, _EIGHT_BYTES, _BYTES, _FOUR_BYTES = 0, 1, 2, 5
_LONGEST_VARINT = 70


class PositionReport(NamedTuple):
    """Where a train was at a moment, as it reported itself."""

    time_s: float
    """Since 1970. [s]"""
    trip: str
    """Empty where the train has none."""
    date: str
    """``YYYYMMDD`` of its day of service; may be empty."""
    vehicle: str
    route: str
    direction: str
    stop: str
    is_standing: bool


def json_reports(text: str) -> Iterator[PositionReport]:
    """
    Yield the reports of messages in JSON.

    Parameters
    ----------
    text
        A message, a list of messages, or a message in each line.

    Yields
    ------
    PositionReport
        By message.

    Raises
    ------
    ValueError
        If it is no such text.
    """
    try:
        told = json.loads(text)
        messages = told if isinstance(told, list) else [told]
    except json.JSONDecodeError:
        messages = [json.loads(line) for line in text.splitlines() if line.strip()]
    for message in messages:
        if not isinstance(message, Mapping) or not ({"header", "entity"} & message.keys()):
            msg = "is no FeedMessage"
            raise ValueError(msg)
        stamp = _of(_of(message, "header") or {}, "timestamp")
        for entity in _of(message, "entity") or ():
            vehicle = _of(entity, "vehicle") if isinstance(entity, Mapping) else None
            if isinstance(vehicle, Mapping):
                yield from _report(vehicle, stamp)


def _of(table: Mapping[str, Any], key: str) -> Any:  # noqa: ANN401 - of any message
    """Return a value by its name in the schema, or as JSON of protobuf writes it."""
    first, *others = key.split("_")
    return table.get(key, table.get(first + "".join(map(str.capitalize, others))))


def _report(vehicle: Mapping[str, Any], stamp: Any) -> Iterator[PositionReport]:  # noqa: ANN401
    """Yield the report of a vehicle, if it says when and where it is."""
    trip, own = (_of(vehicle, key) or {} for key in ("trip", "vehicle"))
    stop, time = _of(vehicle, "stop_id"), _of(vehicle, "timestamp") or stamp
    if stop in (None, "") or time in (None, "", 0, "0"):
        return
    state = _of(vehicle, "current_status")
    trip_id, date = (str(_of(trip, key) or "") for key in ("trip_id", "start_date"))
    route, direction = (_of(trip, key) for key in ("route_id", "direction_id"))
    yield PositionReport(
        float(time),
        trip_id,
        date,
        str(_of(own, "id") or _of(own, "label") or ""),
        str(route or ""),
        "" if direction is None else str(direction),
        str(stop),
        _STATES.get(state, state) == STOPPED,
    )


def protobuf_reports(content: bytes) -> Iterator[PositionReport]:
    """
    Yield the reports of a message in protobuf.

    Parameters
    ----------
    content
        One ``FeedMessage``.

    Yields
    ------
    PositionReport
        In the order of the message.

    Raises
    ------
    ValueError
        If it is no such message.
    """
    message = _fields(content)
    if 1 not in message:
        msg = "is no FeedMessage"
        raise ValueError(msg)
    stamp = _last(_fields(_last(message, 1)), 3)
    for entity in message.get(2, ()):
        position = _last(_fields(entity), 4)
        if position is None:
            continue
        fields = _fields(position)
        trip, own = (_fields(_last(fields, number) or b"") for number in (1, 8))
        route, direction = _text(trip, 5), _last(trip, 6)
        told = {
            "trip": {"trip_id": _text(trip, 1), "start_date": _text(trip, 3), "route_id": route},
            "vehicle": {"id": _text(own, 1), "label": _text(own, 2)},
            "stop_id": _text(fields, 7),
            "current_status": _last(fields, 4),
            "timestamp": _last(fields, 5),
        }
        told["trip"]["direction_id"] = direction
        yield from _report(told, stamp)


def _last(fields: Mapping[int, list[Any]], number: int) -> Any:  # noqa: ANN401 - number or bytes
    return fields[number][-1] if number in fields else None


def _text(fields: Mapping[int, list[Any]], number: int) -> str:
    found = _last(fields, number)
    return found.decode() if isinstance(found, bytes) else ""


def _fields(content: object) -> dict[int, list[Any]]:
    """Return the values of a message by field number: whole numbers, or bytes."""
    if not isinstance(content, bytes):
        msg = "is no FeedMessage"
        raise ValueError(msg)  # noqa: TRY004 - one kind of trouble for all of a file
    found: dict[int, list[Any]] = {}
    at = 0
    while at < len(content):
        tag, at = _varint(content, at)
        value: int | bytes
        if tag & 7 == _VARINT:
            value, at = _varint(content, at)
        else:
            length = {_EIGHT_BYTES: 8, _FOUR_BYTES: 4}.get(tag & 7, -1)
            if tag & 7 == _BYTES:
                length, at = _varint(content, at)
            if length < 0 or at + length > len(content):
                msg = "is no message of protobuf, or cut off"
                raise ValueError(msg)
            value, at = content[at : at + length], at + length
        found.setdefault(tag >> 3, []).append(value)
    return found


def _varint(content: bytes, at: int) -> tuple[int, int]:
    """Return a whole number and the place behind it."""
    value = 0
    for shift in range(0, _LONGEST_VARINT, 7):
        if at >= len(content):
            break
        value |= (content[at] & 0x7F) << shift
        at += 1
        if content[at - 1] < 0x80:
            return value, at
    msg = "is no message of protobuf, or cut off"
    raise ValueError(msg)
