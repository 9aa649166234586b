"""Availability and fault trees in words, for a terminal."""

from collections.abc import Sequence

from kankaku.analysis.tables.dependability import ROWS, Endurance, in_order, per_gigahour
from kankaku.railway.failures.fault_tree import (
    FaultTree,
    joint_probability,
    minimal_cut_sets,
    top_probability,
)

_SHOWN_SETS = 3


def availability_texts(found: Sequence[Endurance]) -> tuple[list[str], list[list[str]]]:
    """
    Return the systems as a table of texts.

    Parameters
    ----------
    found
        One per system.

    Returns
    -------
    tuple[list[str], list[list[str]]]
        Header and rows; what was published stands in brackets.
    """
    header = ["", *(system.configuration.title for system in found)]
    rows = []
    for name, (label, decimals) in ROWS.items():
        cells = []
        for system in found:
            told = system.configuration.published.get(name)
            beside = "" if told is None else f" ({told:.{decimals}f})"
            cells.append(f"{system.told[name]:.{decimals}f}{beside}")
        rows.append([label, *cells])
    for name, label in (
        ("failures_per_year", "failures per year, simulated"),
        ("stopped_h_per_year", "stopped hours per year, simulated"),
        ("whole_stops_per_year", "stops of the whole line per year, simulated"),
        ("whole_stopped_h_per_year", "hours of them per year, simulated"),
    ):
        pairs = [system.estimates[name][1] for system in found]
        rows.append([label, *(f"{it.mean:.3f} ± {it.half_width:.3f}" for it in pairs)])
    return header, rows


def fault_tree_texts(tree: FaultTree) -> tuple[list[str], list[list[str]]]:
    """
    Return the top events with their likeliest cut sets as a table of texts.

    Parameters
    ----------
    tree
        The fault tree.

    Returns
    -------
    tuple[list[str], list[list[str]]]
        Header and rows.
    """
    header = ["top event, and what brings it about", "per 1e9 hours", "share [%]"]
    rows = []
    for top in tree.tops:
        whole, sets = top_probability(tree, top), minimal_cut_sets(tree, top)
        rows.append([tree.gates[top].title, _short(per_gigahour(tree, whole)), "100.0"])
        for events in sets[:_SHOWN_SETS]:
            joint = joint_probability(tree, events)
            titles = [tree.events[name].title for name in in_order(tree, events)]
            share = 100.0 * joint / whole if whole else 0.0
            rate = _short(per_gigahour(tree, joint))
            rows.append([f"  {' + '.join(titles)}", rate, f"{share:.1f}"])
        left = len(sets) - _SHOWN_SETS
        if left > 0:
            rows.append([f"  and {left} more cut sets", "", ""])
    return header, rows


def _short(rate: float) -> str:
    return f"{rate:.3g}" if rate < 1e6 else f"{rate:.2e}"
