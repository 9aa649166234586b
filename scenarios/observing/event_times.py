"""Times of observed events in the forms in which people write them."""

import re
from datetime import UTC, date, datetime, timedelta, tzinfo
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from kankaku.scenarios.observing.visits import EventsError
from kankaku.scenarios.reading.cell_texts import clock, clock_trouble, shown
from kankaku.scenarios.reading.units import whole_seconds

DAY_S = 86400
DAY_BEGINS_S = 4 * 3600
"""Where no date of service is told, a day lasts until then of the next one. [s]"""
TIME_TEXT = "HH:MM:SS, YYYY-MM-DDTHH:MM:SS with or without offset, seconds since 1970, or nothing"
_EPOCH = re.compile(r"[0-9]{9,10}(?:\.[0-9]+)?")
_PLAIN_DATE = re.compile(r"([0-9]{4})-?([0-9]{2})-?([0-9]{2})")


def zone_of(name: str) -> tzinfo | None:
    """
    Return a time zone.

    Parameters
    ----------
    name
        Such as ``Europe/Berlin``; may be empty.

    Returns
    -------
    tzinfo | None
        The zone; nothing for an empty name.

    Raises
    ------
    EventsError
        If there is none of that name.
    """
    if not name:
        return None
    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, ValueError, OSError) as error:
        told = f"--timezone: no zone {shown(name)}; allowed: a name such as Europe/Berlin"
        raise EventsError((told,)) from error


def midnight_s(text: str) -> float | None:
    """
    Return when a day begins.

    Parameters
    ----------
    text
        ``YYYY-MM-DD`` or ``YYYYMMDD``; from Excel also with a time of 0.

    Returns
    -------
    float | None
        Seconds since some midnight, the same one for all days; nothing if it is no date. [s]
    """
    found = _PLAIN_DATE.fullmatch(text.removesuffix(" 00:00:00"))
    try:
        day = date(int(found[1]), int(found[2]), int(found[3])) if found else None
    except ValueError:
        day = None
    return float(DAY_S * day.toordinal()) if day else None


def instant_s(moment: datetime, zone: tzinfo | None) -> float:
    """
    Return what clocks on the line show.

    Parameters
    ----------
    moment
        A date and a time, with or without offset.
    zone
        Of the line; nothing to take the time as it is written.

    Returns
    -------
    float
        As :func:`midnight_s` counts. [s]
    """
    if zone is not None and moment.tzinfo is not None:
        moment = moment.astimezone(zone)
    whole = timedelta(hours=moment.hour, minutes=moment.minute, seconds=moment.second)
    return DAY_S * moment.toordinal() + whole.total_seconds() + moment.microsecond / 1e6


def epoch_s(seconds: float, zone: tzinfo | None) -> float:
    """
    Return what clocks on the line show.

    Parameters
    ----------
    seconds
        Since 1970. [s]
    zone
        Of the line; universal time if there is none.

    Returns
    -------
    float
        As :func:`midnight_s` counts. [s]
    """
    return instant_s(datetime.fromtimestamp(seconds, UTC), zone)


def service_day_s(time_s: float) -> float:
    """
    Return when the day of service of a moment began.

    Parameters
    ----------
    time_s
        As :func:`midnight_s` counts. [s]

    Returns
    -------
    float
        Its midnight. [s]
    """
    return DAY_S * ((time_s - DAY_BEGINS_S) // DAY_S)


def time_s(text: str, day_s: float | None, zone: tzinfo | None) -> float:
    """
    Return when something happened.

    Parameters
    ----------
    text
        As somebody wrote it.
    day_s
        Midnight of its day of service, where one is told. [s]
    zone
        Of the line.

    Returns
    -------
    float
        As :func:`midnight_s` counts. [s]

    Raises
    ------
    ValueError
        With what is wrong, if it is no time.
    """
    of_day = clock(text)
    if of_day:
        return (day_s or 0.0) + whole_seconds(of_day)
    if _EPOCH.fullmatch(text):
        return epoch_s(float(text), zone)
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        moment = None
    if moment is None or len(text) < len("2026-01-01T00:00"):
        # Of a time alone; here it may have a date.
        trouble = clock_trouble(text)
        told = f": it {trouble}" if trouble and "date" not in trouble else ""
        msg = f"{shown(text)} is no time{told}"
        raise ValueError(msg)
    return instant_s(moment, zone)
