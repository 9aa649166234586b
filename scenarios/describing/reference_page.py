"""The reference as a page of the documentation."""

from collections.abc import Iterator

from kankaku.scenarios.describing.described_files import (
    NEEDED,
    DescribedFile,
    DescribedKey,
    KeySort,
    described_files,
)
from kankaku.scenarios.describing.told_reference import toml_text

_ABOUT = """\
Every file, column and key, as the program reads them. `kankaku describe calls.csv` tells the same
in a terminal, and `kankaku describe --json-schema DIR` writes it for editors: with
`#:schema DIR/scenario.schema.json` in the first line of `scenario.toml`, an editor that knows TOML
completes keys and marks mistakes. What a scenario is made of is told in
[Scenario files](../scenario_files.md).
"""


def reference_page() -> str:
    """
    Return the page.

    Returns
    -------
    str
        MyST Markdown: a table for each file.
    """
    parts = ["# Every column and key", _ABOUT]
    for file in described_files().values():
        parts += [f"## {file.name}", f"{file.about} *{file.otherwise.capitalize()}.*"]
        parts.append("\n".join(_table(file)))
    return "\n\n".join(parts) + "\n"


def _table(file: DescribedFile) -> Iterator[str]:
    yield f"| {file.kind} | unit | allowed | left out | example | meaning |"
    yield "|---|---|---|---|---|---|"
    for key in file.keys:
        cells = (f"`{key.name}`", key.unit, key.allowed, *_rest(key))
        yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def _rest(key: DescribedKey) -> tuple[str, str, str]:
    otherwise = f"*{NEEDED}*" if key.otherwise == NEEDED else key.otherwise
    if key.sort is KeySort.COLUMN:
        return otherwise, f"`{key.example}`", key.meaning
    example = f"`{toml_text(key.example)}`" if key.sort is KeySort.KEY else ""
    return otherwise, example, key.meaning
