"""The results folder of several scenarios: one table, two figures, a report."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from kankaku.analysis.page.html import PAGE
from kankaku.analysis.publish.results_folder import (
    FORMATS,
    Draw,
    Kind,
    image_names,
    publish_folder,
)
from kankaku.analysis.tables.across_tables import ACROSS_TABLES
from kankaku.analysis.texts.across_texts import Part, across_report

ACROSS_RESULTS = Kind(
    "across", ACROSS_TABLES, figures=("across", "pareto"), texts=("report.md", PAGE)
)


def publish_across(
    folder: Path,
    parts: Sequence[Part],
    table: pd.DataFrame,
    notes: Sequence[str],
    provenance: Mapping[str, Any],
    *,
    formats: Sequence[str] = FORMATS,
) -> None:
    """
    Write table, figures, report, columns and provenance.

    Parameters
    ----------
    folder
        An existing folder.
    parts
        The scenarios.
    table
        The table ``across``.
    notes
        What a reader has to know of the comparison.
    provenance
        What was run; anything that JSON can hold.
    formats
        Of the figures; nothing is drawn without any.
    """
    made: dict[str, Draw] = {}
    # Of a baseline alone there is nothing to draw.
    if formats and len(set(table["controller"])) > 1:
        # Here, because matplotlib takes half a second that not every command needs.
        from kankaku.analysis.figures.across_figure import across_figure  # noqa: PLC0415
        from kankaku.analysis.figures.pareto_figure import pareto_figure  # noqa: PLC0415

        made = {"pareto": partial(pareto_figure, table), "across": partial(across_figure, table)}
    report = across_report(parts, table, notes, image_names(made, formats))
    publish_folder(
        *(folder, ACROSS_RESULTS, {"across": table}, made, provenance),
        texts={"report.md": report},
        formats=formats,
    )
