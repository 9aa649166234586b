"""What can be wrong with the files of a scenario, and how it is said."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from kankaku.railway.errors import KankakuError, suggesting
from kankaku.scenarios.reading.cell_texts import printable

MOST_NAMED = 30
"""Known names that are told. [-]"""
MOST_KEPT = 10_000
"""Mistakes; more are only counted. [-]"""
MOST_CHARACTERS = 160
"""Of each part of a sentence, so that ten of them fit on a screen. [-]"""
_FILE = re.compile(r"([a-z_]+)\.(csv|toml|xlsx)\b")
_ROW = re.compile(r"row (\d+)(, column .*)?")


@dataclass(frozen=True, slots=True)
class Mistake:
    """One mistake: where it is, what is wrong and what is allowed."""

    file: str
    where: str
    """Key path in a TOML file, row and column in a CSV file. The header is row 1."""
    problem: str
    allowed: str

    def __str__(self) -> str:
        where, problem, allowed = map(_short, (self.where, self.problem, self.allowed))
        place = f"{self.file}: {where}" if where else self.file
        return f"{place}: {problem}; allowed: {allowed}"


def _short(text: str) -> str:
    kept = text if len(text) <= MOST_CHARACTERS else f"{text[:MOST_CHARACTERS]}..."
    return printable(kept)


class ScenarioError(KankakuError):
    """
    A scenario folder cannot be used; ``mistakes`` holds everything that is wrong with it.

    What is wrong in the same way in many rows of a column is one mistake.
    """

    verdict = "cannot be used"

    def __init__(self, mistakes: tuple[Mistake, ...]) -> None:
        self.mistakes = _folded(mistakes)
        super().__init__("\n".join(self.sentences))

    @property
    def sentences(self) -> tuple[str, ...]:
        """The mistakes, a sentence each."""
        return tuple(map(str, self.mistakes))

    @property
    def pointer(self) -> str:
        """The command that tells every column or key of the first file with a mistake."""
        files = (_FILE.match(mistake.file) for mistake in self.mistakes)
        found = next(filter(None, files), None)
        if found is None:
            return ""
        kind = "key" if found[2] == "toml" else "column"
        name = f"{found[1]}.{'toml' if kind == 'key' else 'csv'}"
        return f"kankaku describe {name} tells every {kind}"


def _folded(mistakes: Iterable[Mistake]) -> tuple[Mistake, ...]:
    """Return the mistakes, each sort of one column once, with the rows where it is found."""
    rows: dict[Mistake, list[int]] = {}
    first: dict[Mistake, Mistake] = {}
    distinct = list(dict.fromkeys(mistakes))
    for mistake in distinct[:MOST_KEPT]:
        found = _ROW.fullmatch(mistake.where)
        sort = replace(mistake, where=found[2] or "") if found else mistake
        first.setdefault(sort, mistake)
        rows.setdefault(sort, []).extend([int(found[1])] if found else [])
    folded = tuple(
        replace(mistake, problem=f"{mistake.problem}{also_in(rows[sort][1:])}")
        for sort, mistake in first.items()
    )
    more = len(distinct) - MOST_KEPT
    last = Mistake(distinct[-1].file, "", f"{more} more mistakes", "none") if more > 0 else None
    return (*folded, last) if last else folded


def also_in(rows: Sequence[int]) -> str:
    """
    Return the end of a sentence about the first of several rows.

    Parameters
    ----------
    rows
        The others.

    Returns
    -------
    str
        Their numbers, or how many they are if there are many; empty if there are none.
    """
    if not rows:
        return ""
    if len(rows) > 3:
        return f", and so in {len(rows)} more rows"
    return f", and so in row{'s' if len(rows) > 1 else ''} {', '.join(map(str, rows))}"


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
    everything = ", ".join(names) if len(names) <= MOST_NAMED else ""
    if not everything or len(everything) > MOST_CHARACTERS - 60:
        everything = f"one of {len(names)} known names"
    return suggesting(name, names, everything)
