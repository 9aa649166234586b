"""What can be wrong with the files of a scenario, and how it is said."""

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault: where it is, what is wrong and what is allowed."""

    file: str
    where: str
    """Key path in a TOML file, row and column in a CSV file. The header is row 1."""
    problem: str
    allowed: str

    def __str__(self) -> str:
        place = f"{self.file}: {self.where}" if self.where else self.file
        return f"{place}: {self.problem}; allowed: {self.allowed}"


class ScenarioError(ValueError):
    """A scenario folder cannot be used; ``faults`` holds everything that is wrong with it."""

    def __init__(self, faults: tuple[Fault, ...]) -> None:
        super().__init__("\n".join(str(fault) for fault in faults))
        self.faults = faults


def row_place(row: int, column: str = "") -> str:
    """
    Return how a place in a CSV file is named.

    Parameters
    ----------
    row
        Row as a spreadsheet counts it; the header is row 1.
    column
        Name of the column, empty for the whole row.

    Returns
    -------
    str
        For example ``row 7, column limit_kmh``.
    """
    return f"row {row}, column {column}" if column else f"row {row}"


def meant(name: str, known: Iterable[str]) -> str:
    """
    Return what is allowed instead of an unknown name.

    Parameters
    ----------
    name
        What the file says.
    known
        What it may say.

    Returns
    -------
    str
        The likeliest name if there is one, and all names.
    """
    names = list(known)
    if not names:
        return "nothing, because none is defined"
    stem = name.rpartition("_")[0] or name
    same_quantity = [other for other in names if stem in (other, other.rpartition("_")[0])]
    close = same_quantity or get_close_matches(name, names, n=1)
    everything = ", ".join(names) if len(names) <= 30 else f"one of {len(names)} known names"
    return f"{close[0]!r} (did you mean that?) among {everything}" if close else everything
