"""Field units to SI units."""

from functools import lru_cache

HALF_DAY_S = 43200
"""Who goes further back in time means the next day. [s]"""


def metres(chainage_km: float) -> float:
    """
    Return metres; whole millimetres, so that equal chainages stay equal.

    Parameters
    ----------
    chainage_km
        Chainage as the files have it. [km]

    Returns
    -------
    float
        The same. [m]
    """
    return round(1000.0 * chainage_km, 3)


@lru_cache(maxsize=1 << 17)
def whole_seconds(clock: str) -> int:
    """
    Return a time of day in seconds.

    Parameters
    ----------
    clock
        ``HH:MM:SS``.

    Returns
    -------
    int
        Seconds after midnight. [s]
    """
    hours, minutes, rest = clock.split(":")
    return 3600 * int(hours) + 60 * int(minutes) + int(rest)


def clock_of(time_s: int) -> str:
    """
    Return a time of day as files have it.

    Parameters
    ----------
    time_s
        Seconds after midnight. [s]

    Returns
    -------
    str
        ``HH:MM:SS``.
    """
    return f"{time_s // 3600:02d}:{time_s // 60 % 60:02d}:{time_s % 60:02d}"


def next_day(earlier: str, later: str) -> str:
    """
    Return the end of a sentence for those who begin to count anew at midnight.

    Parameters
    ----------
    earlier, later
        Two times of day of which the second should not be the earlier one, ``HH:MM:SS``.

    Returns
    -------
    str
        What to write; empty if midnight does not explain the second time.
    """
    if whole_seconds(earlier) - whole_seconds(later) < HALF_DAY_S:
        return ""
    return f"; after midnight write {int(later[:2]) + 24}{later[2:]}"
