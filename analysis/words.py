"""How names, times and speeds are told to readers: the same in tables, texts and figures."""

KMH_PER_MPS = 3.6


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
