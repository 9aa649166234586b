"""How a comparison of controllers is shown: verdict first, as wide as the screen, with marks."""

import json
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from kankaku.analysis.tables.across_tables import DELAY, ENERGY, STOPS
from kankaku.analysis.tables.columns import csv_text, typed_frame
from kankaku.analysis.tables.compare import COMPARISON, comparison
from kankaku.analysis.tables.indicators import COMPARED
from kankaku.analysis.tables.verdict import Mark, competing_controllers, marked, verdict
from kankaku.analysis.texts.comparison_texts import comparison_note, comparison_texts, mean_text
from kankaku.analysis.texts.verdict_texts import safety_text, verdict_text
from kankaku.analysis.words import told_of
from kankaku.commands.screen import answers
from kankaku.commands.shared_options import Format
from kankaku.commands.told_tables import (
    echo,
    fitting,
    json_rows,
    paragraph,
    plain,
    show_fitting,
)
from kankaku.railway.step.records import Column

MARKED = (
    *COMPARISON,
    Column("mark", "str", "", "better, worse or alike, beside the first controller; or empty"),
    Column("best", "bool", "", "no controller that competes does better"),
)
FIRST = (STOPS, DELAY, ENERGY, "interstation_stops", "interstation_crawl_time_s")
"""What is shown first where not everything fits on the screen."""
SIGNS: Mapping[str, str] = {"better": "▲", "worse": "▼", "best": "★"}
PLAIN_SIGNS: Mapping[str, str] = {"better": "^", "worse": "v", "best": "*"}
"""For a screen or a file that holds ASCII only."""
LEAST_WITH_CHANGES = 3
"""Where fewer indicators than this fit with their changes, means and marks have to do. [-]"""


def show_comparison(
    summary: pd.DataFrame,
    knows_future: Collection[str],
    peers: Collection[str],
    form: Format,
    folder: Path,
) -> None:
    """
    Show how controllers compare.

    Parameters
    ----------
    summary
        The table ``summary``.
    knows_future
        Controllers that are told the drawn dwell delays.
    peers
        Controllers under which another program drives the trains: they compete for nothing, too.
    form
        For people, or for other programs.
    folder
        Results folder.
    """
    compared = comparison(summary)
    aside = {*knows_future, *peers}
    rows = marked(compared, competing_controllers(summary, aside))
    found = verdict(summary, aside)
    if form is Format.CSV:
        columns = {column.name: [row[column.name] for row in rows] for column in MARKED}
        echo(csv_text(typed_frame(columns, MARKED), MARKED))
    elif form is Format.JSON:
        told = {
            "results": str(folder),
            "verdict": verdict_text(found),
            "safety": safety_text(found),
            "comparison": json_rows(rows),
        }
        echo(json.dumps(told, indent=2, ensure_ascii=False))
    else:
        paragraph(verdict_text(found))
        paragraph(safety_text(found))
        _show(compared, rows, knows_future)


def _show(
    compared: pd.DataFrame, rows: Sequence[Mapping[str, Any]], knows_future: Collection[str]
) -> None:
    header, cells = comparison_texts(compared, knows_future)
    several = len(header) > 2
    signs = signs_of(answers.encoding)
    marks = {(row["controller"], row["indicator"]): _sign(row, signs) for row in rows}
    names = list(dict.fromkeys(row["controller"] for row in rows))
    indicators = list(dict.fromkeys(row["indicator"] for row in rows))
    if several:
        baseline = plain(names[0])
        paragraph(
            f"{comparison_note(compared)}. {signs['better']} better, {signs['worse']} worse than "
            f"{baseline}, {signs['best']} best."
        )
    whole = [
        [line[0], *(cell + marks[name, at] for cell, name in zip(line[1:], names, strict=True))]
        for line, at in zip(cells, indicators, strict=True)
    ]
    wide = [plain(name) for name in header]
    if not several or len(fitting(wide, whole, kept=1, width=answers.width)) == len(wide):
        show_fitting(wide, whole, kept=2)
        return
    _show_by_controller(rows, dict(zip(indicators, whole, strict=True)), names, knows_future)


def _show_by_controller(
    rows: Sequence[Mapping[str, Any]],
    whole: Mapping[str, Sequence[str]],
    names: Sequence[str],
    knows_future: Collection[str],
) -> None:
    """Show a row for each controller, with as many indicators as fit."""
    order = [name for name in FIRST if name in whole]
    order += [name for name in whole if name not in order]
    header = ["controller", *(_label(name) for name in order)]
    told = [plain(told_of(name, knows_future=name in knows_future)) for name in names]
    with_changes = [
        [told[number], *(whole[at][number + 1] for at in order)] for number in range(len(names))
    ]
    shown = with_changes
    if len(fitting(header, shown, kept=1, width=answers.width)) <= LEAST_WITH_CHANGES:
        signs = signs_of(answers.encoding)
        of = {(row["controller"], row["indicator"]): row for row in rows}
        shown = [
            [
                told[number],
                *(mean_text(of[name, at]["mean"]) + _sign(of[name, at], signs) for at in order),
            ]
            for number, name in enumerate(names)
        ]
    left = show_fitting(header, shown)
    if left:
        more = "1 more indicator" if left == 1 else f"{left} more indicators"
        changes = "" if shown is with_changes else ", and all changes,"
        paragraph(f"{more}{changes} on a wider screen, in report.md, or with --format csv.")


def _label(name: str) -> str:
    one = COMPARED.get(name)
    label = one.label if one else name.replace("_", " ")
    unit = one.column.unit if one else ""
    return f"{label} [{unit}]" if unit else label


def signs_of(encoding: str) -> Mapping[str, str]:
    """
    Return the marks that can be written.

    Parameters
    ----------
    encoding
        Of the screen or file.

    Returns
    -------
    Mapping[str, str]
        For ``better``, ``worse`` and ``best``.
    """
    try:
        "".join(SIGNS.values()).encode(encoding)
    except (UnicodeEncodeError, LookupError):
        return PLAIN_SIGNS
    return SIGNS


def _sign(row: Mapping[str, Any], signs: Mapping[str, str]) -> str:
    told = signs[row["mark"]] if row["mark"] in {Mark.BETTER, Mark.WORSE} else ""
    told += signs["best"] if row["best"] else ""
    return f" {told}" if told else ""
