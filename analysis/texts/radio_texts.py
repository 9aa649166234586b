"""What a reader is told about the radio of a line: a table, and the answers in sentences."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from kankaku.analysis.tables.radio_tables import (
    LABELS,
    CellPoint,
    LoadCase,
    busiest_minute,
    carried,
    grouped,
    indicators,
    late_share,
)
from kankaku.analysis.words import clock, label_of
from kankaku.railway.radio.cells import Link, RadioPlan

_MISSING = "-"


def radio_load_texts(
    cases: Sequence[LoadCase], plan: RadioPlan
) -> tuple[list[str], list[list[str]]]:
    """
    Return the load of one system as a table of texts.

    Parameters
    ----------
    cases
        All simulations of that system.
    plan
        What was asked.

    Returns
    -------
    tuple[list[str], list[list[str]]]
        Header and rows; a published value stands to the right of ours.
    """
    header = [cases[0].system.title]
    columns: list[dict[str, str]] = []
    for case in cases:
        header.append(case.name)
        found = list(indicators(case, plan.late_s))
        columns.append({name: _number(name, unit, value) for name, unit, value, _ in found})
        if case.published:
            header.append("published")
            columns.append(
                {
                    name: _number(name, unit, told)
                    for name, unit, _, told in found
                    if not np.isnan(told)
                }
            )
    names = [name for name in LABELS if any(name in column for column in columns)]
    rows = [[LABELS[name], *(column.get(name, _MISSING) for column in columns)] for name in names]
    return header, rows


def _number(name: str, unit: str, value: float) -> str:
    if unit == "s":
        return f"{value:.2f}"
    return (
        f"{value:.2f}"
        if name in {"late_percent", "lost_percent"} and 0.0 < value < 0.1
        else f"{value:.1f}"
    )


def radio_sentences(
    cases: Sequence[LoadCase], points: Sequence[CellPoint], plan: RadioPlan
) -> list[str]:
    """
    Return the answers: where the load comes from, where it is greatest, what a cell carries.

    Parameters
    ----------
    cases
        All simulations of the line.
    points
        All simulations of a cell.
    plan
        What was asked.

    Returns
    -------
    list[str]
        Sentences.
    """
    even = [case for case in cases if case.published]
    pairs = [(one, two) for one, two in pairwise(even) if one.system.name == two.system.name]
    # A channel that is full does not grow with the trains.
    told = [
        slope_sentence(one, two, plan)
        for one, two in pairs
        if late_share(two.traffic, plan.late_s) == 0.0
    ]
    for case in cases:
        if case.start_s is not None and case.system.name == cases[0].system.name:
            share, cell, minute = busiest_minute(case.traffic)
            low_m, high_m = plan.cells.edges_m[cell : cell + 2].tolist()
            told.append(
                f"In the run {label_of(case.name)} the radio from antenna to train is busiest in "
                f"the minute from {clock(case.start_s + 60.0 * minute)} on, {100.0 * share:.0f} % "
                f"between km {low_m / 1000.0:.1f} and {high_m / 1000.0:.1f}."
            )
    return [*told, *(cell_sentence(curve, plan) for curve in grouped(points))]


def slope_sentence(one: LoadCase, two: LoadCase, plan: RadioPlan) -> str:
    """
    Return what one more train adds to the radio, and why.

    Parameters
    ----------
    one, two
        The same system with fewer and with more trains, both published.
    plan
        What was asked.

    Returns
    -------
    str
        A sentence.
    """
    system, kind = two.system, Link.ANTENNA_TRAIN
    more = two.trains - one.trains
    slope = (two.traffic.utilisation(kind) - one.traffic.utilisation(kind)) / more
    told = ""
    if one.published and two.published:
        pair = [case.utilisation.get(kind) for case in (one.published, two.published)]
        if pair[0] is not None and pair[1] is not None:
            told = f" (published: {100.0 * (pair[1] - pair[0]) / more:.2f})"
    cells = "one cell" if plan.cells.size == 1 else f"mean of {plan.cells.size} cells"
    return (
        f"Each train on the line adds {100.0 * slope:.2f} points from antenna to train{told}: "
        f"{1.0 / system.update_s:g} commands a second, {two.units_per_train:.2f} radio units that "
        f"serve a train, {1000.0 * system.airtime_s:.1f} ms; {cells}."
    )


def cell_sentence(points: Sequence[CellPoint], plan: RadioPlan) -> str:
    """
    Return how many trains a cell carries.

    Parameters
    ----------
    points
        Of one system and number of trackside devices, trains rising from 1.
    plan
        What was asked.

    Returns
    -------
    str
        A sentence.
    """
    system, devices, trains = points[0].system, points[0].trackside_devices, carried(points)
    place = f"{system.title}{f', {devices} trackside devices' if devices else ''}"
    if trains == points[-1].trains:
        return f"{place}: one cell carries {trains} trains and more."
    return (
        f"{place}: one cell carries {trains} trains before commands run late. With {trains + 1}, "
        f"some take longer than {plan.late_s:g} s or are never sent because newer ones replace "
        "them."
    )
