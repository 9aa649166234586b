"""Several scenarios in words: a table and a report that fit on 80 columns."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.tables.across_tables import (
    ACROSS,
    BOUND,
    CRAWL,
    DELAY,
    ENERGY,
    LATENESS,
    SHOWN,
    STOPS,
    cell_of,
)
from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.pareto import best_controllers
from kankaku.analysis.texts.comparison_texts import change_text, mean_text
from kankaku.analysis.texts.report import markdown
from kankaku.analysis.words import FORETOLD, told_of

WIDTH = 80
"""Characters of a line. [-]"""
HEADER = (
    ("stop", "time [s]"),
    ("crawl", "[s]"),
    ("delay", "[s]"),
    ("late", "[s]"),
    ("energy", "[kWh]"),
    ("un-", "safe"),
    ("unfin-", "ished"),
)
NO_CHANGES = ("",) * len(HEADER)
MEANINGS: Mapping[str, str] = {
    "stop time": f"stop time between stations: {STOPS}",
    "crawl": f"crawl between stations, stops included: {CRAWL}",
    "delay": f"mean arrival delay, early trains below 0: {DELAY}",
    "late": f"the same, early trains count as 0: {LATENESS}",
    "energy": f"net energy: {ENERGY}",
    "unsafe": "violations of safety invariants, all runs together",
    "unfinished": "trains that had not finished, all runs together",
}


class Part(NamedTuple):
    """A scenario in the report."""

    name: str
    title: str
    seeds: Sequence[int]
    step_s: float


def across_lines(table: pd.DataFrame) -> list[str]:
    """
    Return the table as lines.

    Parameters
    ----------
    table
        The table ``across``.

    Returns
    -------
    list[str]
        A heading per scenario, with the bound of the delay under the baseline; below it two lines
        per controller: means over runs, and the changes against the baseline with half of their
        95 % intervals. Up to 80 characters each.
    """
    baseline = table["controller"].iloc[0]
    found = [
        (row, _means(row), _changes(row) if row["controller"] != baseline else NO_CHANGES)
        for row in rows_of(table)
    ]
    texts = [*zip(*HEADER, strict=True), *(cells for _, *lines in found for cells in lines)]
    widths = [max(map(len, column)) for column in zip(*texts, strict=True)]
    left = WIDTH - sum(widths) - len(widths)

    def line(name: str, cells: Sequence[str]) -> str:
        ends = [f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True)]
        return f"{name:<{left}} {' '.join(ends)}".rstrip()

    lines = [line("", part) for part in zip(*HEADER, strict=True)]
    scenario = None
    for row, means, changes in found:
        if row["scenario"] != scenario:
            scenario = row["scenario"]
            lines += ["-" * WIDTH, *_heading(scenario, row[BOUND])]
        name = f"  {told_of(row['controller'], knows_future=row['knows_future'])}"
        if len(name) > left:
            lines.append(name)
            name = ""
        lines.append(line(name, means))
        if any(changes):
            lines.append(line("", changes))
    return lines


def _heading(scenario: str, bound_s: float) -> list[str]:
    if np.isnan(bound_s):
        return [scenario]
    least = f"least delay that any control could reach: {mean_text(bound_s)} s"
    if len(scenario) + len(least) + 2 > WIDTH:
        return [scenario, f"{least:>{WIDTH}}"]
    return [f"{scenario}{least:>{WIDTH - len(scenario)}}"]


def _means(row: Mapping[str, Any]) -> tuple[str, ...]:
    ran = row["runs"] > 0
    counts = [str(row[name]) if ran else "-" for name in ("violations", "unfinished")]
    return (*(mean_text(row[indicator]) for indicator in SHOWN), *counts)


def _changes(row: Mapping[str, Any]) -> tuple[str, ...]:
    changes = {
        STOPS: _change(row, STOPS),
        DELAY: _change(row, DELAY, per_cent=False).removesuffix(" s"),
        ENERGY: _change(row, ENERGY),
    }
    return (*(changes.get(indicator, "") for indicator in SHOWN), "", "")


def _change(row: Mapping[str, Any], indicator: str, *, per_cent: bool = True) -> str:
    cell = cell_of(row, indicator, per_cent=per_cent)
    return "" if np.isnan(cell["difference"]) else change_text(cell)


def across_note(table: pd.DataFrame) -> list[str]:
    """
    Return what the second lines of the table tell.

    Parameters
    ----------
    table
        The table ``across``.

    Returns
    -------
    list[str]
        Lines; none if there is nothing but the baseline.
    """
    if len(set(table["controller"])) < 2:
        return []
    told = f"Second lines: change against {table['controller'].iloc[0]}"
    if (table["pairs"] > 1).any():
        told += ", ± half of the 95 % confidence interval of differences paired by seed"
    told += "; no per cents where the baseline is near zero."
    if table["knows_future"].any():
        told += f" {FORETOLD}"
    return textwrap.wrap(told, WIDTH)


def across_report(
    parts: Sequence[Part], table: pd.DataFrame, notes: Sequence[str], figures: Sequence[str]
) -> str:
    """
    Return the report.

    Parameters
    ----------
    parts
        The scenarios.
    table
        The table ``across``.
    notes
        What a reader has to know of the comparison: options that differ, what failed.
    figures
        File names of the figures beside the report.

    Returns
    -------
    str
        Markdown, up to 80 characters a line.
    """
    ran = (
        f"{part.name}: {markdown(part.title)}; {_seeds(part.seeds)}, step {part.step_s:g} s"
        for part in parts
    )
    first = "Runs, tables and a report of each scenario lie in the folder of its name beside this."
    sections = (
        ["# Controllers across scenarios"],
        [*_items(ran), "", *textwrap.wrap(first, WIDTH)],
        ["```text", *across_lines(table), "```", "", *across_note(table)],
        [*_items(f"**{name}**: {meaning}" for name, meaning in MEANINGS.items())],
        *([["## Take note", "", *_items(map(markdown, notes))]] if notes else []),
        [f"![changes against the baseline]({name})" for name in figures],
        *([_best(table)] if len(set(table["controller"])) > 1 else []),
        textwrap.wrap(
            f"`across.csv` has the changes of all indicators in {len(ACROSS)} columns, "
            "`columns.csv` says what each of them means.",
            WIDTH,
        ),
    )
    return "\n".join(line for part in sections if part for line in [*part, ""]).rstrip() + "\n"


def _best(table: pd.DataFrame) -> Iterator[str]:
    """Yield which controllers no other one beats."""
    told = "By their means no other controller is better in stop time, delay and net energy at once"
    yield from textwrap.wrap(f"{told} than these:", WIDTH)
    yield ""
    parts = table.groupby("scenario", sort=False)
    yield from _items(
        f"{scenario}: {', '.join(best_controllers(part)) or 'none'}" for scenario, part in parts
    )


def _items(told: Iterator[str] | Sequence[str]) -> Iterator[str]:
    for item in told:
        yield from textwrap.wrap(f"- {item}", WIDTH, subsequent_indent="  ")


def _seeds(seeds: Sequence[int]) -> str:
    if len(seeds) == 1:
        return f"seed {seeds[0]}"
    return f"{len(seeds)} seeds from {seeds[0]} to {seeds[-1]}"
