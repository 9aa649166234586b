"""Identifiers that nobody has yet."""

from collections.abc import Callable, Container

from kankaku.scenarios.reading.fields import LONGEST_NAME


def unused(
    stem: str,
    taken: Container[str],
    join: str = "-",
    longest: int = LONGEST_NAME,
    *,
    alike: Callable[[str], str] = str,
) -> str:
    """
    Return an identifier, with a number if another thing has it.

    Parameters
    ----------
    stem
        What it should be.
    taken
        What others have, as ``alike`` has it.
    join
        Stands before a number.
    longest
        Characters that it may have; a number takes the place of the last ones. [-]
    alike
        What of two identifiers must differ.

    Returns
    -------
    str
        One that is not taken.
    """
    found, number = stem, 1
    while alike(found) in taken:
        number += 1
        end = f"{join}{number}"
        found = stem[: longest - len(end)] + end
    return found
