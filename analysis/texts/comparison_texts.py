"""The comparison of controllers in words: a table and a note."""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.indicators import COMPARED
from kankaku.analysis.words import told_of


def change_text(cell: Mapping[str, Any]) -> str:
    """
    Return a change as a reader likes to see it.

    Parameters
    ----------
    cell
        Unit, difference, half width of its interval and change in per cent, by the columns of
        ``COMPARISON``.

    Returns
    -------
    str
        In per cent where there are any, else in the indicator's unit; after the sign ± the half
        width where there is one.
    """
    difference, interval, percent = cell["difference"], cell["confidence_95"], cell["change_pct"]
    told, unit = (difference, cell["unit"]) if np.isnan(percent) else (percent, "%")
    decimals = _decimals(told) if np.isnan(percent) else 1
    # Adding nothing turns a rounded -0.0 into 0.0.
    text = f"{round(told, decimals) + 0.0:+,.{decimals}f}"
    if difference != 0.0 and not np.isnan(interval):
        half = abs(interval) if np.isnan(percent) else abs(interval * percent / difference)
        text += f" ± {half:,.{decimals}f}"
    return f"{text} {unit}".rstrip()


def comparison_texts(
    compared: pd.DataFrame, knows_future: Collection[str] = ()
) -> tuple[list[str], list[list[str]]]:
    """
    Return the comparison as texts, one row per indicator and one column per controller.

    Parameters
    ----------
    compared
        What :func:`comparison` returned.
    knows_future
        Names of the controllers that are told the drawn dwell delays.

    Returns
    -------
    tuple[list[str], list[list[str]]]
        Header and rows. A cell shows the mean and, but for the baseline, the change against
        it with the half width of its 95 % interval where there are several seeds.
    """
    controllers = list(dict.fromkeys(compared["controller"]))
    rows: dict[str, list[str]] = {}
    for cell in rows_of(compared):
        indicator, unit = cell["indicator"], cell["unit"]
        label = COMPARED[indicator].label if indicator in COMPARED else indicator
        row = rows.setdefault(indicator, [f"{label} [{unit}]" if unit else label])
        row.append(_cell_text(cell, baseline=cell["controller"] == controllers[0]))
    named = [told_of(name, knows_future=name in knows_future) for name in controllers]
    return ["indicator", *named], list(rows.values())


def comparison_note(compared: pd.DataFrame) -> str:
    """
    Return what the brackets of the texts hold.

    Parameters
    ----------
    compared
        What :func:`comparison` returned.

    Returns
    -------
    str
        Half a sentence.
    """
    baseline = compared["controller"].iloc[0]
    told = f"In brackets: change against {baseline}"
    others = compared[(compared["controller"] != baseline) & compared["difference"].notna()]
    in_units = others[others["change_pct"].isna()]["indicator"]
    labels = [item.label for name, item in COMPARED.items() if name in set(in_units)]
    if labels:
        told += f", no per cents where it is near zero or negative ({', '.join(labels)})"
    return told


def _cell_text(cell: Mapping[str, Any], *, baseline: bool) -> str:
    mean, difference = cell["mean"], cell["difference"]
    text = mean_text(mean)
    return text if baseline or np.isnan(difference) else f"{text} ({change_text(cell)})"


def mean_text(mean: float) -> str:
    """
    Return a mean as a reader likes to see it.

    Parameters
    ----------
    mean
        Any number.

    Returns
    -------
    str
        With more decimals the smaller it is; a dash if there is none.
    """
    return "-" if np.isnan(mean) else f"{mean:,.{_decimals(mean)}f}"


def _decimals(value: float) -> int:
    if abs(value) >= 1000.0:
        return 0
    return 2 if 0.0 < abs(value) < 1.0 else 1
