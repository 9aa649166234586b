"""Values of a JSON source with their places; everything that is wrong is gathered."""

import json
import math
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NoReturn

from kankaku.railway.errors import suggesting
from kankaku.scenarios.drafts.unused_names import unused
from kankaku.scenarios.importing.formats import SourceError
from kankaku.scenarios.reading.cell_texts import printable, shown, text_trouble
from kankaku.scenarios.reading.fields import LONGEST_NAME
from kankaku.scenarios.reading.mistakes import Mistake

MOST_TOLD = 50
"""Mistakes of a source that are told. [-]"""
_UNFIT = re.compile(r"[^A-Za-z0-9_.\-]+")


class KeyPlace:
    """
    A value of a JSON source, with its key path.

    Readers go on after a mistake with something harmless, and ``refuse`` tells all of them.

    Parameters
    ----------
    value
        As JSON has it; None where it is missing, or is wrong already.
    file
        Name of the source.
    where
        Key path, such as ``stops.values[3]``.
    mistakes
        Gathers what is wrong.
    lost
        The value is missing or wrong, and that is told already.
    """

    def __init__(
        self, value: object, file: str, where: str, mistakes: list[str], *, lost: bool = False
    ) -> None:
        self.value = value
        self.file = file
        self.where = where
        self._mistakes = mistakes
        self._lost = lost

    def wrong(self, problem: str, allowed: str) -> None:
        """Note that the value is wrong."""
        if not self._lost:
            sentence = str(Mistake(self.file, self.where, problem, allowed))
            self._mistakes.append(sentence)
        self._lost = True

    def refuse(self) -> None:
        """
        Refuse the source if anything was wrong with it.

        Raises
        ------
        SourceError
            With everything.
        """
        if self._mistakes:
            told = self._mistakes[:MOST_TOLD]
            more = len(self._mistakes) - len(told)
            last = [f"{self.file}: {more} more mistakes; allowed: none"] if more else []
            raise SourceError((*told, *last))

    def has(self, key: str) -> bool:
        """Return whether the value is a table with this key, and something stands there."""
        return isinstance(self.value, dict) and self.value.get(key) is not None

    def at(self, key: str) -> "KeyPlace":
        """Return the value of a key that must be there."""
        where = f"{self.where}.{key}" if self.where else key
        if isinstance(self.value, dict):
            if key in self.value:
                return KeyPlace(self.value[key], self.file, where, self._mistakes)
            missing = KeyPlace(None, self.file, where, self._mistakes)
            missing.wrong("is missing", f"the key {key!r}")
            return missing
        self.wrong(f"is {shown(self.value)}", "a table with keys")
        return KeyPlace(None, self.file, where, self._mistakes, lost=True)

    def items(self) -> list["KeyPlace"]:
        """Return the parts of a list."""
        if not isinstance(self.value, list):
            self.wrong(f"is {shown(self.value)}", "a list")
            return []
        return [
            KeyPlace(value, self.file, f"{self.where}[{number}]", self._mistakes)
            for number, value in enumerate(self.value)
        ]

    def parts(self, key: str) -> list["KeyPlace"]:
        """Return the parts of a list that may be absent."""
        return self.at(key).items() if self.has(key) else []

    def pairs(self) -> Iterator[tuple[str, "KeyPlace"]]:
        """Yield the keys of a table with their values."""
        if not isinstance(self.value, dict):
            self.wrong(f"is {shown(self.value)}", "a table with keys")
            return
        for key in self.value:
            yield key, self.at(key)

    def number(self, low: float, high: float) -> float:
        """Return a number in a range; the lowest one where it is none."""
        value, good = self.value, False
        if isinstance(value, int | float) and not isinstance(value, bool):
            good = low <= value <= high  # of an integer of any size, too
        if not good:
            self.wrong(f"is {shown(value)}", f"a number from {low:g} to {high:g}")
            return low
        return float(value)  # type: ignore[arg-type]

    def text(self) -> str:
        """Return a text that has something in it; an empty one where it is none."""
        if not isinstance(self.value, str) or not self.value:
            self.wrong(f"is {shown(self.value)}", "a text")
            return ""
        trouble = text_trouble(self.value)
        if trouble:
            self.wrong(trouble, "a text of one line, at most 200 characters")
        return self.value

    def one_of(self, allowed: Iterable[str]) -> str:
        """Return a text that is one of these; an empty one where it is not."""
        known = tuple(allowed)
        if self.value not in known:
            told = ", ".join(known[:20]) or "nothing, because none is defined"
            if isinstance(self.value, str) and len(known) > 1:
                told = suggesting(self.value, known, told)
            self.wrong(f"is {shown(self.value)}", told)
            return ""
        return str(self.value)


def read_json(path: Path) -> KeyPlace:
    """
    Read a JSON source.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    KeyPlace
        All that it holds.

    Raises
    ------
    SourceError
        If it cannot be read, or is not JSON.
    """
    allowed = "a file in JSON"
    try:
        data = json.loads(path.read_text("utf-8-sig"), parse_constant=_no_number)
        # Half a character, which no file can hold, may be written as an escape.
        json.dumps(data, ensure_ascii=False).encode()
    except OSError as error:
        sentence = f"{path.name}: cannot be read: {error.strerror}; allowed: {allowed}"
        raise SourceError((sentence,)) from error
    except RecursionError as error:
        sentence = f"{path.name}: is nested too deeply; allowed: {allowed}"
        raise SourceError((sentence,)) from error
    except ValueError as error:
        # Text that is not UTF-8, not JSON, or a number of thousands of digits.
        raise SourceError((f"{path.name}: {printable(str(error))}; allowed: {allowed}",)) from error
    return KeyPlace(data, path.name, "", [])


def _no_number(name: str) -> NoReturn:
    msg = f"{name} is no number"
    raise ValueError(msg)


class SafeIds:
    """Identifiers that files of a scenario allow, one for each of a source."""

    def __init__(self) -> None:
        self._given: dict[str, str] = {}
        self._taken: set[str] = set()

    def of(self, told: str) -> str:
        """
        Return the identifier for one of the source; for the same one always the same.

        Parameters
        ----------
        told
            As the source has it.

        Returns
        -------
        str
            Letters, digits, ``-``, ``_`` and ``.``; with a number where two would be alike.
        """
        if told not in self._given:
            stem = _UNFIT.sub("-", told).strip("-")[:LONGEST_NAME] or "x"
            self._given[told] = name = unused(stem, self._taken)
            self._taken.add(name)
        return self._given[told]


def safe_text(told: str, otherwise: str) -> str:
    """
    Return a name that people read, as far as a file of a scenario may hold it.

    Parameters
    ----------
    told
        As the source has it.
    otherwise
        Stands where that cannot be held.

    Returns
    -------
    str
        One of the two.
    """
    plain = " ".join(told.split())
    return otherwise if not plain or text_trouble(plain) else plain


def whole_s(seconds: float) -> int:
    """
    Return whole seconds that are not less.

    Parameters
    ----------
    seconds
        A time. [s]

    Returns
    -------
    int
        The same, or up to a second more. [s]
    """
    return math.ceil(seconds - 1e-6)
