"""The one base class of errors that a user can mend, and how any error is told in a line."""

from collections.abc import Sequence
from difflib import get_close_matches

LONGEST_NAME = 160
"""Characters; nobody meant a longer one. [-]"""


class KankakuError(ValueError):
    """
    What whoever uses the program can mend: where it is, what is wrong, and what is allowed.

    Every such error of every room is one of these, and one place tells them all.
    """

    verdict = "cannot be run"
    """What that means for the scenario that is used."""

    def __init__(self, where: str, problem: str = "", allowed: str = "") -> None:
        told = f"{where}: {problem}" if where and problem else where or problem
        super().__init__(f"{told}; allowed: {allowed}" if allowed else told)
        self.where = where
        self.problem = problem
        self.allowed = allowed

    @property
    def sentences(self) -> tuple[str, ...]:
        """Everything that is wrong, a sentence each."""
        return (str(self),)

    @property
    def pointer(self) -> str:
        """Where more is told, a sentence; empty if nowhere."""
        return ""


def sentence_of(error: BaseException) -> str:
    """
    Return an error in one line.

    Parameters
    ----------
    error
        Any error.

    Returns
    -------
    str
        Its kind and what it says.
    """
    told = " ".join(str(error).split())
    return f"{type(error).__name__}: {told}" if told else type(error).__name__


def suggesting(name: str, known: Sequence[str], told: str) -> str:
    """
    Return what is allowed instead of an unknown name, the likeliest one first.

    Parameters
    ----------
    name
        What was said.
    known
        What may be said.
    told
        All of that in words.

    Returns
    -------
    str
        The likeliest name, if there is one, and everything.
    """
    close = _likeliest(name, known)
    return f"{close!r} (did you mean that?) among {told}" if close else told


def _likeliest(name: str, names: Sequence[str]) -> str | None:
    """Return the name that is likeliest meant."""
    if len(name) > LONGEST_NAME:
        return None
    plain = {_plain(other): other for other in reversed(names)}
    stem = name.rpartition("_")[0] or name
    same_quantity = [other for other in names if stem in (other, other.rpartition("_")[0])]
    near = [plain[_plain(name)]] if _plain(name) in plain else same_quantity
    near = near or [plain[key] for key in get_close_matches(_plain(name), plain, n=1)]
    return near[0] if near else None


def _plain(name: str) -> str:
    return name.strip().casefold().replace(" ", "_").replace("-", "_")
