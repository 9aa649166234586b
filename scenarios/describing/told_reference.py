"""The reference as text for a terminal of 80 columns."""

from collections.abc import Iterator, Sequence
from textwrap import wrap

import tomlkit

from kankaku.scenarios.describing.described_files import (
    NEEDED,
    DescribedFile,
    DescribedKey,
    KeySort,
    described_files,
)

WIDTH = 79
"""Characters of a line; a terminal has one more. [-]"""
_NAMES = 26


def told_files() -> list[str]:
    """
    Return what files there are.

    Returns
    -------
    list[str]
        Lines.
    """
    lines = []
    for file in described_files().values():
        lines += _beside(file.name, f"{file.about} {_sentence(file.otherwise)}", _NAMES)
    lines += ["", "kankaku describe calls.csv tells every column of that file."]
    return lines


def told_file(file: DescribedFile, keys: Sequence[DescribedKey] = ()) -> list[str]:
    """
    Return what is to be said of a file, or of some of its columns or keys.

    Parameters
    ----------
    file
        The file.
    keys
        Which columns or keys; all if there are none.

    Returns
    -------
    list[str]
        Lines.
    """
    lines = wrap(f"{file.name}: {file.about} {_sentence(file.otherwise)}", WIDTH)
    for key in keys or file.keys:
        lines += ["", *_told_key(key)]
    if not keys and file.kind == "column":
        lines += ["", "For example:", "", *_rows(file)]
    return lines


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def _beside(name: str, text: str, width: int, whole: int = WIDTH) -> list[str]:
    indented = " " * width
    first = f"{name:<{width - 1}} " if len(name) < width else ""
    lines = wrap(text, whole, initial_indent=first or indented, subsequent_indent=indented)
    return lines if first else [name, *lines]


def _told_key(key: DescribedKey) -> Iterator[str]:
    yield key.name
    yield from wrap(key.meaning, WIDTH, initial_indent="  ", subsequent_indent="  ")
    facts = [("unit", key.unit), ("allowed", key.allowed)]
    is_needed = key.otherwise == NEEDED
    facts.append(("needed", "always") if is_needed else ("left out", key.otherwise))
    if key.sort in {KeySort.KEY, KeySort.COLUMN}:
        facts.append(("example", example_text(key)))
    for name, text in facts:
        if text:
            yield from (f"  {line}" for line in _beside(name, text, 10, WIDTH - 2))


def example_text(key: DescribedKey) -> str:
    """
    Return an example as the file has it.

    Parameters
    ----------
    key
        A column or key.

    Returns
    -------
    str
        A cell, or a line of TOML.
    """
    if key.sort is KeySort.COLUMN:
        return str(key.example)
    return f"{key.path[-1]} = {toml_text(key.example)}"


def toml_text(value: object) -> str:
    """
    Return a value as TOML has it.

    Parameters
    ----------
    value
        A text, number, list or table.

    Returns
    -------
    str
        In one line.
    """
    if isinstance(value, dict):
        parts = (f"{name} = {toml_text(part)}" for name, part in value.items())
        return f"{{ {', '.join(parts)} }}"
    return str(tomlkit.item(value).as_string())


def _rows(file: DescribedFile) -> list[str]:
    header = ",".join(key.path[-1] for key in file.keys)
    row = ",".join(str(key.example) for key in file.keys)
    if len(header) <= WIDTH - 2:
        return [f"  {header}", f"  {row}"]
    return [*_broken(header), *_broken(row)]


def _broken(line: str) -> list[str]:
    """Return a long row in several lines; a mark says that it goes on."""
    parts: list[str] = []
    for cell in line.split(","):
        if parts and len(parts[-1]) + len(cell) < WIDTH - 6:
            parts[-1] += f",{cell}"
        else:
            parts.append(cell)
    return [
        f"{'  ' if not number else '    '}{part}{',' if number < len(parts) - 1 else ''}"
        for number, part in enumerate(parts)
    ]
