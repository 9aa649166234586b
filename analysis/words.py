"""How names, times and speeds are told to readers: the same in tables, texts and figures."""

import re

KMH_PER_MPS = 3.6
DAY_S = 86_400.0
_TIME = re.compile(r"([0-9]{1,2}):([0-5][0-9])(?::([0-5][0-9](?:\.[0-9]{1,3})?))?")


def label_of(name: str) -> str:
    """
    Return a name as a reader likes to see it.

    Parameters
    ----------
    name
        Identifier of a controller.

    Returns
    -------
    str
        The same with spaces.
    """
    return name.replace("_", " ")


def told_of(name: str, *, knows_future: bool) -> str:
    """
    Return a controller's name with a warning where there has to be one.

    Parameters
    ----------
    name
        The name.
    knows_future
        It is told the drawn dwell delays, as nobody ever is.

    Returns
    -------
    str
        The name.
    """
    return f"{name} (knows the future)" if knows_future else name


FORETOLD = "Who knows the future is told the drawn dwell delays and is there for comparison only."


def clock(time_s: float, _position: int | None = None, *, seconds: bool = False) -> str:
    """
    Return a time of day.

    Parameters
    ----------
    time_s
        Seconds after midnight. [s]
    seconds
        Show seconds too.

    Returns
    -------
    str
        ``hh:mm`` or ``hh:mm:ss``.
    """
    whole = round(time_s)
    minutes = f"{whole // 3600 % 24:02d}:{whole // 60 % 60:02d}"
    return f"{minutes}:{whole % 60:02d}" if seconds else minutes


def time_of_day_s(text: str) -> float | None:
    """
    Return the time that a user names.

    Parameters
    ----------
    text
        ``h:mm``, ``hh:mm`` or ``hh:mm:ss``, also with parts of a second; hours after midnight go on
        from 24.

    Returns
    -------
    float | None
        Seconds after midnight; None if the text is no time. [s]
    """
    found = _TIME.fullmatch(text.strip())
    if not found:
        return None
    return 3600.0 * int(found[1]) + 60.0 * int(found[2]) + float(found[3] or 0.0)
