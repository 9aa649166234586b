"""The results folder of an ensemble beside its dataset: a table, what was found, three figures."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from kankaku.analysis.page.html import PAGE
from kankaku.analysis.publish.results_folder import FORMATS, Draw, Kind, publish_folder
from kankaku.analysis.tables.across_tables import DELAY, ENERGY, STOPS
from kankaku.analysis.tables.columns import json_text
from kankaku.analysis.tables.ensemble_tables import STUDY_TABLES
from kankaku.railway.plan.seed_design import SeedDesign
from kankaku.railway.step.records import Column

FOUND = "study.json"
DRAWN = (STOPS, DELAY, ENERGY)
"""Indicators that are drawn if nobody asks for others."""


def ensemble_results(dataset: Mapping[str, tuple[Column, ...]], plan: str) -> Kind:
    """
    Return what the results folder of an ensemble may hold.

    Parameters
    ----------
    dataset
        Columns of the tables in its dataset.
    plan
        File that says which runs it has.

    Returns
    -------
    Kind
        The kind.
    """
    return Kind(
        "study",
        {**STUDY_TABLES, **dataset},
        figures=("box", "ecdf", "running_mean"),
        texts=(FOUND, PAGE),
        elsewhere=frozenset(dataset),
        made_from=plan,
    )


def publish_ensemble(  # noqa: PLR0913 - one argument per part of the folder
    folder: Path,
    kind: Kind,
    summary: pd.DataFrame,
    table: pd.DataFrame,
    found: Mapping[str, Any],
    plan: Mapping[str, Any],
    *,
    indicators: Sequence[str] = (),
    formats: Sequence[str] = FORMATS,
    designs: Mapping[str, SeedDesign] | None = None,
) -> None:
    """
    Write table, figures, findings, columns and plan.

    Parameters
    ----------
    folder
        An existing folder.
    kind
        What :func:`ensemble_results` returned.
    summary
        The table ``summary`` of the runs that count, with a column ``scenario``.
    table
        The table ``study``.
    found
        What else is told of the whole; anything that JSON can hold.
    plan
        Which runs it has.
    indicators
        Columns of the summary that are drawn.
    formats
        Of the figures; none if empty.
    designs
        How the seeds of each scenario share their draws; each for itself if None.
    """
    made: dict[str, Draw] = {}
    if formats and len(summary):
        # Here, because matplotlib takes half a second that not every command needs.
        from kankaku.analysis.figures.ensemble_figures import (  # noqa: PLC0415
            box_figure,
            ecdf_figure,
            running_mean_figure,
        )

        shown = (summary, list(plan["controllers"]), list(indicators or DRAWN))
        made = {
            "box": partial(box_figure, *shown),
            "ecdf": partial(ecdf_figure, *shown),
            "running_mean": partial(running_mean_figure, *shown, designs),
        }
    texts = {FOUND: json_text(found)}
    frames = {"study": table}
    publish_folder(folder, kind, frames, made, plan, texts=texts, formats=formats)
