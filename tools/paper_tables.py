"""Published figures beside ours, one table for each paper, from what runs left in ``out/``."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from kankaku.analysis.results import read_results

OUT = Path(__file__).parents[1] / "out"
SATO = (
    ("interstation_stop_time_s", "stop time between stations, close-up running", "600 s"),
    ("interstation_stop_time_s", "the same, two-stage deceleration", "113 s (-81 %)"),
    ("energy_net_kwh", "energy, two-stage deceleration", "-1.0 %"),
)
RADIO = {
    "antenna_train_percent": "antenna to train [%]",
    "train_antenna_percent": "train to antenna [%]",
    "controller_switch_percent": "controller to switch [%]",
    "round_trip_mean_s": "round trip, mean [s]",
    "round_trip_max_s": "round trip, longest [s]",
}
AVAILABILITY = {
    "availability_percent": ("availability, conventional / central [%]", 3),
    "failures_per_year": ("failures per year, conventional / central", 2),
}
SYSTEMS = ("conventional", "central")


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """
    Return a Markdown table.

    Parameters
    ----------
    header
        Names of the columns.
    rows
        Cells, as many as names.

    Returns
    -------
    str
        Its lines; numbers to the right.
    """
    rule = ["---", *("---:" for _ in header[1:])]
    return "\n".join("| " + " | ".join(row) + " |" for row in (header, rule, *rows))


def sato_table() -> str:
    """Return two-stage deceleration in the rush hour, the scenario's own seed."""
    summary = read_results(OUT / "rush_hour", trajectories=False).summary
    by_name: Any = summary.set_index("controller")
    base, ours = by_name.loc["close_up"], by_name.loc["two_stage"]
    change = {
        name: f"{100.0 * (float(ours[name]) / float(base[name]) - 1.0):+.1f} %"
        for name in ("interstation_stop_time_s", "energy_net_kwh")
    }
    told = (
        f"{base['interstation_stop_time_s']:.0f} s (calibrated)",
        f"{ours['interstation_stop_time_s']:.0f} s ({change['interstation_stop_time_s']})",
        f"{change['energy_net_kwh']} net",
    )
    rows = [[label, published, own] for (_, label, published), own in zip(SATO, told, strict=True)]
    return markdown(["figure", "published", "ours"], rows)


def sugiyama_table() -> str:
    """Return radio load with 8 and 30 trains, and availability."""
    load = pd.read_csv(OUT / "rush_hour_radio" / "radio_load.csv")
    central = load[(load["system"] == "central") & load["published"].notna()]
    wide: Any = central.pivot_table(index="indicator", columns="case", sort=False)
    rows = []
    for name, label in RADIO.items():
        decimals = 2 if name.endswith("_s") else 1
        cells = [
            " / ".join(f"{value:.{decimals}f}" for value in wide.loc[name, kind])
            for kind in ("published", "value")
        ]
        rows.append([f"{label.removesuffix(']')}, 8 / 30 trains]", *cells])
    table: Any = pd.read_csv(OUT / "control_map_availability" / "availability.csv").set_index(
        "system"
    )
    for name, (label, decimals) in AVAILABILITY.items():
        cells = [
            " / ".join(f"{table.loc[system, column]:.{decimals}f}" for system in SYSTEMS)
            for column in (f"published_{name}", name)
        ]
        rows.append([label, *cells])
    return markdown(["figure", "published", "ours"], rows)


def takaoka_table() -> str:
    """Return what ATD gains, and what energy-saving driving saves."""
    sweep = read_results(OUT / "atd_headway", trajectories=False).sweep
    if sweep is None:
        msg = f"{OUT / 'atd_headway'} holds no sweep"
        raise ValueError(msg)
    cells: Any = sweep.set_index(["controller", "indicator"])
    gain = cells.loc[("atd", "greatest_shortening_s")]
    energy: Any = read_results(OUT / "eco_driving", trajectories=False).summary.set_index(
        "controller"
    )
    net = energy["energy_net_kwh"]
    saved = 100.0 * (float(net["eco"]) / float(net["close_up"]) - 1.0)
    rows = [
        [
            "greatest gain of ATD over multi-step ATC",
            f"{gain['published']:.0f} s",
            f"{gain['value']:.0f} s",
        ],
        ["energy for 3.85 % more run time", "-19.6 %", f"{saved:.1f} % net"],
    ]
    return markdown(["figure", "published", "ours"], rows)
