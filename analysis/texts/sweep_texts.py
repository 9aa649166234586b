"""A sweep in words: a table for a terminal and a report."""

import numpy as np
import pandas as pd

from kankaku.analysis.tables.sweep import SWEEP_INDICATORS


def sweep_texts(indicators: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """
    Return the indicators of a sweep as texts, one row each and one column per controller.

    Parameters
    ----------
    indicators
        The table ``sweep``.

    Returns
    -------
    tuple[list[str], list[list[str]]]
        Header and rows; a last column holds the published values if there are any.
    """
    controllers = list(dict.fromkeys(indicators["controller"]))
    published = bool(indicators["published"].notna().any())
    rows = []
    for indicator, own in indicators.groupby("indicator", sort=False):
        label = SWEEP_INDICATORS[str(indicator)][0]
        values = own.set_index("controller")["value"]
        cells = [_cell_text(float(values[name])) for name in controllers]
        if published:
            cells.append(_cell_text(float(own["published"].max())))
        rows.append([f"{label} [{own['unit'].iloc[0]}]", *cells])
    return ["indicator", *controllers, *(["published"] if published else [])], rows


def _cell_text(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.1f}"
