"""What a controller says when an option has a value it cannot use."""

from kankaku.railway.errors import KankakuError


class OptionError(KankakuError):
    """An option with a value that is not allowed: what is wrong and what is allowed."""

    def __init__(self, problem: str, allowed: str) -> None:
        super().__init__("", problem, allowed)


def require(key: str, value: float, least: float, most: float) -> None:
    """
    Check the range of an option; not-a-number is in no range.

    Parameters
    ----------
    key
        Name of the option, with its unit.
    value
        Its value.
    least
        Smallest value allowed.
    most
        Greatest value allowed.

    Raises
    ------
    OptionError
        If the value is outside.
    """
    if not least <= value <= most:
        problem = f"{key} is {value:g}"
        raise OptionError(problem, f"{least:g} to {most:g}")
