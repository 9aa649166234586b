"""What the command ``explain`` shows: a paragraph, a table of all controllers, and a figure."""

import json
import math
from collections.abc import Sequence
from pathlib import Path

from kankaku.analysis.asked_results import read_asked
from kankaku.analysis.explaining import Explainer, Explanation
from kankaku.analysis.tables.columns import csv_text, rows_of
from kankaku.analysis.tables.explained import EXPLANATIONS
from kankaku.analysis.words import clock
from kankaku.commands.figure_files import file_of_figure
from kankaku.commands.screen import refusals, show_warnings
from kankaku.commands.shared_options import Format
from kankaku.commands.told_tables import (
    echo,
    json_rows,
    paragraph,
    path_line,
    plain,
    show_fitting,
)
from kankaku.railway.places import name_problem

EXPLAINED = "explained"
"""Folder for figures in a results folder."""
_MARKS = str.maketrans({":": "", " ": "_", "/": "_", "\\": "_"})


def tell_why(
    folder: Path,
    train: str,
    at: str,
    controllers: Sequence[str],
    seed: int | None,
    figure: Path | None,
    *,
    form: Format,
) -> int:
    """
    Tell why a train was slow.

    Parameters
    ----------
    folder
        Results folder.
    train
        Train number.
    at
        Time of day.
    controllers
        Of these; all if empty. The first one is told in words.
    seed
        Of which seed; the first one if None.
    figure
        File for the figure; one in the results folder if None.
    form
        How the table is written.

    Returns
    -------
    int
        How the command ends.
    """
    with refusals(folder, folder):
        asked = read_asked(folder, controllers=controllers, seed=seed)
        show_warnings(asked.notes)
        found = Explainer(asked.results, controllers, seed=seed).explain(train, at)
        if form is Format.JSON:
            rows = json_rows(rows_of(found.table))
            for row in rows:
                row["text"] = found.texts[str(row["controller"])]
            echo(json.dumps(rows, indent=2, ensure_ascii=False))
        elif form is Format.CSV:
            echo(csv_text(found.table, EXPLANATIONS))
        else:
            paragraph(found.text)
            _show_table(found)
        if figure is not None or form is Format.TABLE:
            _draw(found, asked.results.folder, figure)
    return 0


def _show_table(found: Explanation) -> None:
    header = [
        "controller",
        "was",
        "km/h",
        "bound by",
        "ahead",
        "stood s",
        "lost s",
        "late s",
        "chain",
        "mostly from",
        "place m",
        "since",
        "plan",
        "authority to m",
    ]
    left = show_fitting(header, [_cells(row) for row in rows_of(found.table)], kept=2, texts=2)
    if left:
        paragraph(f"{left} more columns on a wider screen, or with --format csv.")


def _cells(row: dict[str, object]) -> list[str]:
    def number(name: str) -> str:
        value = float(str(row[name]))
        return "-" if math.isnan(value) else f"{value:,.0f}"

    since_s = float(str(row["since_s"]))
    origin = f"{row['origin_train']} {row['origin_station']}".strip()
    cells = [
        row["controller"],
        str(row["state"]).replace("_", " "),
        number("speed_kmh"),
        str(row["reason"]).replace("_", " ") or "-",
        row["cause"] or "-",
        number("stood_s"),
        number("lost_s"),
        number("arrival_delay_s"),
        row["chain"] or "-",
        f"{origin} {number('origin_s')} s" if origin else "-",
        number("front_m"),
        "-" if math.isnan(since_s) else clock(since_s, seconds=True),
        row["plan"] or "-",
        number("limit_m"),
    ]
    return [plain(cell) for cell in cells]


def _draw(found: Explanation, folder: Path, figure: Path | None) -> None:
    """Draw for the first controller under which the train was on the line."""
    shown = next((one for one in found.found if one.sample is not None), None)
    if shown is None:
        paragraph("No figure: the train was not on the line.")
        return
    file = figure
    if file is None:
        told = f"{shown.train}_{clock(shown.time_s, seconds=True)}_{shown.controller}"
        name = told.translate(_MARKS)
        file = folder / EXPLAINED / (f"{name}.png" if not name_problem(name) else "moment.png")
    written = file_of_figure(found.figure(shown.controller), file)
    path_line("Figure", written)
