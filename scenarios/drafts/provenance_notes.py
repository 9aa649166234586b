"""What a scenario was made of: taken, assumed, missing, and whose terms hold."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypeVar

SOURCES_FILE = "SOURCES.md"

N = TypeVar("N")


class Taken(NamedTuple):
    """Something that stands in the source."""

    what: str
    where: str
    """File, column or key of the source."""


class Assumed(NamedTuple):
    """Something that the source does not say, and that a run needs."""

    what: str
    value: str
    why: str


class Missing(NamedTuple):
    """Something of the source, or of reality, that the scenario does not have."""

    what: str
    effect: str


@dataclass
class SourceNotes:
    """Everything that ``SOURCES.md`` tells; whoever assumes something adds it here."""

    origin: str
    """The source in a sentence, with its date where it has one."""
    terms: str = ""
    """Licence of the source, as far as it says."""
    taken: list[Taken] = field(default_factory=list)
    assumed: list[Assumed] = field(default_factory=list)
    missing: list[Missing] = field(default_factory=list)

    def take(self, what: str, where: str) -> None:
        """Note something that stands in the source."""
        self._note(self.taken, Taken(what, where))

    def assume(self, what: str, value: str, why: str) -> None:
        """Note something that the source does not say."""
        self._note(self.assumed, Assumed(what, value, why))

    def miss(self, what: str, effect: str) -> None:
        """Note something that is left out."""
        self._note(self.missing, Missing(what, effect))

    @staticmethod
    def _note(notes: list[N], note: N) -> None:
        if note not in notes:
            notes.append(note)

    def markdown(self, title: str) -> str:
        """
        Return the text of ``SOURCES.md``.

        Parameters
        ----------
        title
            Of the scenario.

        Returns
        -------
        str
            Markdown: origin, terms, and a table each of what was taken, assumed and is missing.
        """
        parts = [f"# {title}: sources and assumptions", self.origin]
        if self.terms:
            parts.append(f"Terms: {self.terms}")
        parts += _section("What was taken", ("what", "where"), self.taken)
        parts += _section("What was assumed", ("what", "value", "why"), self.assumed)
        parts += _section("What is missing", ("what", "effect"), self.missing)
        return "\n\n".join(parts) + "\n"


def _section(heading: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    if not rows:
        return []
    lines = [_line(head), _line(["---"] * len(head)), *map(_line, rows)]
    return [f"## {heading}", "\n".join(lines)]


def _line(cells: Sequence[str]) -> str:
    plain = (" ".join(cell.replace("|", "\\|").split()) for cell in cells)
    return f"| {' | '.join(plain)} |"
