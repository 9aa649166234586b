"""The tables of the sensitivity study: for a terminal of 80 columns, and for the documentation."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from kankaku.railway.plan.scenario import Scenario
from tools.paper_tables import markdown
from tools.sensitivity.assumptions import ASSUMPTIONS
from tools.sensitivity.conclusion import CHANGES, Change

NO_MORE_THAN_NOISE = "*"
LABEL_WIDTH, CELL_WIDTH = 28, 13
HEADER = [f"{one.title} [{one.unit}]" for one in CHANGES]
SHORT_HEADER = ["", *(f"{one.short} [{one.unit}]" for one in CHANGES)]


def assumptions_table(scenario: Scenario) -> str:
    """
    Return the ranges as a Markdown table.

    Parameters
    ----------
    scenario
        The centre.

    Returns
    -------
    str
        A row per assumption.
    """
    rows = [
        [
            f"{one.title} [{one.unit}]" if one.unit else one.title,
            f"{one.said(scenario):.3g}",
            f"{one.low:g} to {one.high:g}",
            one.reason,
        ]
        for one in ASSUMPTIONS
    ]
    return markdown(["assumption", "as assumed", "range", "why it is doubted"], rows)


def effects_table(effects: Mapping[str, pd.DataFrame]) -> str:
    """
    Return the effects as a Markdown table.

    Parameters
    ----------
    effects
        By change, as :func:`tools.sensitivity.design.effects` tells them, with ``noise``.

    Returns
    -------
    str
        Mean absolute effect and, in brackets, spread of the effects; greatest first. A star stands
        beside an effect that is no greater than its noise.
    """
    return markdown(["assumption", *HEADER], _effect_cells(effects))


def plain_effects(effects: Mapping[str, pd.DataFrame]) -> str:
    """
    Return the effects as text of 80 columns.

    Parameters
    ----------
    effects
        As for :func:`effects_table`.

    Returns
    -------
    str
        Its lines, without a line feed at the end.
    """
    rows = _effect_cells(effects)
    return "\n".join(_line(cells) for cells in (SHORT_HEADER, *rows))


def ranges(
    design: pd.DataFrame, repeats: pd.DataFrame, centre: Mapping[str, float]
) -> list[tuple[str, list[str]]]:
    """
    Return where the conclusion lies.

    Parameters
    ----------
    design, repeats
        Conclusions at the points of the design, and at the centre with other seeds.
    centre
        The conclusion at the centre with the seeds of the design.

    Returns
    -------
    list[tuple[str, list[str]]]
        Rows of cells, one per change, with their labels.
    """
    rows: list[tuple[str, list[str]]] = [
        ("as assumed", [_told(change, centre[change.key]) for change in CHANGES]),
        ("as assumed, other seeds", [_span(change, repeats[change.key]) for change in CHANGES]),
        ("all assumptions moved", [_span(change, design[change.key]) for change in CHANGES]),
        (
            "of the points, less than 0",
            [f"{int((design[c.key] < 0.0).sum())}/{design[c.key].count()}" for c in CHANGES],
        ),
    ]
    return rows


def ranges_table(rows: Sequence[tuple[str, list[str]]]) -> str:
    """
    Return the ranges of the conclusion as a Markdown table.

    Parameters
    ----------
    rows
        As :func:`ranges` tells them.

    Returns
    -------
    str
        Its lines.
    """
    return markdown(
        ["`two_stage` against `close_up`", *HEADER], [[label, *cells] for label, cells in rows]
    )


def plain_ranges(rows: Sequence[tuple[str, list[str]]]) -> str:
    """
    Return the ranges of the conclusion as text of 80 columns.

    Parameters
    ----------
    rows
        As :func:`ranges` tells them.

    Returns
    -------
    str
        Its lines, without a line feed at the end.
    """
    return "\n".join(
        _line(cells) for cells in (SHORT_HEADER, *([label, *own] for label, own in rows))
    )


def _effect_cells(effects: Mapping[str, pd.DataFrame]) -> list[list[str]]:
    by_change = {name: own.set_index("assumption") for name, own in effects.items()}
    order = by_change[CHANGES[0].key]["mu_star"].sort_values(ascending=False).index
    titles = {one.key: one.title for one in ASSUMPTIONS}
    return [
        [
            titles[name],
            *(
                _effect(*by_change[change.key].loc[name, ["mu_star", "sigma", "noise"]])
                for change in CHANGES
            ),
        ]
        for name in order
    ]


def _effect(mu_star: float, sigma: float, noise: float) -> str:
    star = "" if mu_star > noise else NO_MORE_THAN_NOISE
    return f"{_number(mu_star)}{star} ({_number(sigma)})"


def _number(value: float) -> str:
    if not np.isfinite(value):
        return "-"
    decimals = 2 if abs(value) < 2.0 else 1 if abs(value) < 20.0 else 0
    return f"{value:.{decimals}f}"


def _told(change: Change, value: float) -> str:
    if not np.isfinite(value):
        return "-"
    return f"{value:+.0f}" if change.column == CHANGES[0].column else f"{value:+.2f}"


def _span(change: Change, values: pd.Series) -> str:
    return f"{_told(change, values.min())}..{_told(change, values.max())}"


def _line(cells: Sequence[str]) -> str:
    label, *others = cells
    return label.ljust(LABEL_WIDTH) + "".join(cell.rjust(CELL_WIDTH) for cell in others)
