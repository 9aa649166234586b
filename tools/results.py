"""
Write the result tables of the documentation from ``out/``: ``make results``.

Reads what the make targets ``rush-hour``, ``capacity``, ``radio``, ``availability``, ``sakai``,
``takaoka``, ``seeds``, ``approach``, ``stress``, ``map``, ``yizhuang``, ``limits``, ``reserve``,
``losses``, ``steps``, ``interval``, ``driving``, ``sensitivity``, ``variance`` and ``bench``
left, and replaces the text between ``<!-- name -->`` and ``<!-- end -->``.
"""

import json
import re
import shutil
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from kankaku.analysis.figures.style import write_figure
from kankaku.analysis.figures.time_distance import time_distance_figure
from kankaku.analysis.results import read_results
from kankaku.analysis.tables.compare import change_pct, comparison
from kankaku.analysis.tables.dependability import ROWS as AVAILABILITY_ROWS
from kankaku.analysis.tables.radio_tables import LABELS as RADIO_LABELS
from kankaku.analysis.tables.sweep import SWEEP_INDICATORS
from kankaku.analysis.texts.comparison_texts import comparison_texts
from kankaku.analysis.words import label_of
from tools.bench import TRAINS
from tools.paper_tables import markdown, sato_table, sugiyama_table, takaoka_table
from tools.speed_tables import bench_table, steps_table

PROJECT = Path(__file__).parents[1]
OUT = PROJECT / "out"
SHOWN = (
    "interstation_stop_time_s",
    "interstation_stops",
    "interstation_crawl_time_s",
    "mean_arrival_delay_s",
    "final_arrival_delay_s",
    "secondary_delay_s",
    "energy_net_kwh",
)
PRINTED = (
    "interstation_stop_time_s",
    "interstation_stops",
    "mean_arrival_delay_s",
    "energy_net_kwh",
)
"""Indicators in README.md."""
SHORT = ("close_up", "two_stage", "d_atc", "atc")
"""Controllers in README.md."""
SATO = ("close_up", "two_stage")
CARRIED = ("close_up", "two_stage", "approach_point", "d_atc", "atc")
"""Controllers of the second line."""
PLAIN = ("close_up", "two_stage", "two_stage_plain", "approach_point")
MAPPED = ("close_up_planned", "two_stage_planned", "control_map")
EXCLUSIVE = ("close_up_exclusive", "approach_point_exclusive")
PROTECTED = ("close_up", "atc", "atd", "d_atc")
ECO = ("energy_gross_kwh", "energy_net_kwh", "scheduled_speed_kmh")
WEIGHED = (
    "interstation_stop_time_s",
    "interstation_stops",
    "interstation_crawl_time_s",
    "closed_doors_time_s",
    "mean_arrival_delay_s",
    "delay_above_bound_s",
    "final_arrival_delay_s",
    "energy_net_kwh",
)
DRAWN = ("close_up", "two_stage", "atc", "atd")
"""Controllers in the first figure."""
CAPACITY_ROWS = {
    "headway_s": "headway of the line, simulated [s]",
    "blocking_time_headway_s": "by blocking times [s]",
    "trains_per_hour": "trains per hour",
    "transport_capacity": "transport capacity [km/h x trains/h]",
    "occupation_percent": "occupation by the booked timetable [%]",
}
FIGURES = {
    "time_distance": "time_distance",
    "rush_hour_capacity/capacity": "capacity",
    "rush_hour_capacity/stairway": "stairway",
    "rush_hour_radio/radio_load": "radio_load",
    "rush_hour_radio/cell_capacity": "cell_capacity",
    "control_map_availability/availability": "availability",
    "control_map_availability/fault_tree": "fault_tree",
    "sakai_case1/intervals": "intervals",
    "atd_headway/speed_distance": "atd_headway",
    "losses/losses": "losses",
    "control_map/control_map/control_map": "control_map",
    "sensitivity/sensitivity": "sensitivity",
    "seeds/across/across": "across",
    "approach/across/pareto": "pareto",
}
"""Figures of the documentation, by their places in ``out/``."""


def comparison_table(
    folder: Path, controllers: Sequence[str] = (), indicators: Sequence[str] = SHOWN
) -> str:
    """
    Return the comparison of a results folder.

    Parameters
    ----------
    folder
        Results folder.
    controllers
        Which ones, baseline first; all if empty.
    indicators
        Columns of the summary.

    Returns
    -------
    str
        A Markdown table.
    """
    summary = read_results(folder, trajectories=False).summary
    if controllers:
        summary = summary[summary["controller"].isin(controllers)]
    return markdown(*comparison_texts(comparison(summary, indicators)))


def limits_table() -> str:
    """Return stop time and mean delay against the longest dwell delay."""
    table = pd.read_csv(OUT / "limits.csv")
    rows = []
    for cap_s, both in table.groupby("cap_s", sort=True):
        by_name = both.set_index("controller")
        stop_s = by_name["interstation_stop_time_s"]
        delay_s = by_name["mean_arrival_delay_s"]
        less_s = stop_s["two_stage"] - stop_s["close_up"]
        percent = change_pct("interstation_stop_time_s", less_s, stop_s["close_up"])
        added_s = delay_s["two_stage"] - delay_s["close_up"]
        rows.append(
            [
                f"{cap_s:.0f} s",
                f"{stop_s['close_up']:.0f} s",
                f"{stop_s['two_stage']:.0f} s",
                f"{less_s:+.1f} s" if np.isnan(percent) else f"{percent:+.0f} %",
                f"{added_s:+.1f} s",
            ]
        )
    header = ["longest dwell delay", "`close_up`", "`two_stage`", "change", "mean delay"]
    return markdown(header, rows)


def reserve_table() -> str:
    """Return what the reserve of the control map brings and costs."""
    table = pd.read_csv(OUT / "reserve.csv")
    rows = [
        [
            re.sub(r"^`control_map_(\d+)s`$", r"`control_map`, \1 s", f"`{row['controller']}`"),
            f"{row['interstation_stop_time_s']:.0f} s",
            f"{row['mean_arrival_delay_s']:.1f} s",
            f"{row['final_arrival_delay_s']:.1f} s",
            f"{row['energy_net_kwh']:,.0f} kWh",
        ]
        for row in table.to_dict("records")
    ]
    header = ["controller", "stop time", "mean delay", "delay at the last station", "energy, net"]
    return markdown(header, rows)


def faults_table() -> str:
    """Return what faults of a control map did, by failure mode."""
    table = pd.read_csv(OUT / "control_map_faults" / "fault_table.csv")
    rows = [
        [
            f"{row['kind']}: {row['variant']}",
            f"{row['runs']:.0f}",
            f"{row['detected_percent']:.0f} %",
            "-" if np.isnan(row["detected_after_s"]) else f"{row['detected_after_s']:.1f} s",
            row["reaction"],
            f"{row['trains_braked']:.2f}",
            f"{row['trains_stopped']:.2f}",
            f"{row['delay_caused_s']:.1f} s",
            f"{row['unsafe_events']:.0f}",
        ]
        for row in table.to_dict("records")
    ]
    header = [
        "fault",
        "runs",
        "detected",
        "after",
        "reaction",
        "trains braked",
        "trains stopped",
        "delay caused",
        "unsafe events",
    ]
    return markdown(header, rows)


def losses_table() -> str:
    """Return delay and emergency brakings against the loss of telegrams."""
    means = (
        pd.read_csv(OUT / "losses" / "losses.csv")
        .groupby(["loss_percent", "controller"])[["mean_arrival_delay_s", "emergency_brakings"]]
        .mean()
    )
    names = list(dict.fromkeys(means.index.get_level_values("controller")))
    rows = [
        [
            f"{loss_percent:g} %",
            *(f"{both.loc[name, 'mean_arrival_delay_s']:.1f} s" for name in names),
            *(f"{both.loc[name, 'emergency_brakings']:.1f}" for name in names),
        ]
        for loss_percent, both in (
            (loss_percent, rows.droplevel(0))
            for loss_percent, rows in means.groupby("loss_percent", sort=True)
        )
    ]
    header = [
        "telegrams lost",
        *(f"mean delay, `{name}`" for name in names),
        *(f"emergency brakings, `{name}`" for name in names),
    ]
    return markdown(header, rows)


def sakai_table() -> str:
    """Return the three cases of Sakai et al. 2020 beside the published figures."""
    rows = []
    for case in (1, 2, 3):
        table = read_results(OUT / f"sakai_case{case}", trajectories=False).sweep
        if table is None:
            msg = f"{OUT / f'sakai_case{case}'} holds no sweep"
            raise ValueError(msg)
        cells = table[table["controller"] == "approach_point"].set_index("indicator")
        pairs = cells.loc[list(SWEEP_INDICATORS), ["value", "published"]].to_numpy().ravel()
        rows.append([f"case {case}", *("-" if np.isnan(it) else f"{it:.1f}" for it in pairs)])
    labels = [label for label, _ in SWEEP_INDICATORS.values()]
    header = [text for label in labels for text in (f"{label} [s]", "published")]
    return markdown(["", *header], rows)


def headways_table() -> str:
    """Return the technical headways of the rush hour by station, by blocking times."""
    table = pd.read_csv(OUT / "rush_hour_capacity" / "headways.csv")
    wide = table.pivot_table(
        index=["station", "dwell_s"],
        columns="controller",
        values="blocking_time_headway_s",
        sort=False,
    )
    rows = [
        [place, f"{dwell_s:.0f}", *(f"{value:.1f}" for value in row)]
        for (place, dwell_s), row in zip(wide.index, wide.to_numpy(), strict=True)
    ]
    return markdown(["station", "dwell [s]", *(f"`{name}`" for name in wide)], rows)


def capacity_table() -> str:
    """Return what the line can carry."""
    table = pd.read_csv(OUT / "rush_hour_capacity" / "capacity.csv").set_index("controller")
    rows = [
        [label, *(f"{value:,.0f}" if value >= 1000.0 else f"{value:.1f}" for value in table[name])]
        for name, label in CAPACITY_ROWS.items()
    ]
    return markdown(["", *(f"`{name}`" for name in table.index)], rows)


def radio_table() -> str:
    """Return the radio load of the central system beside the published one."""
    table = pd.read_csv(OUT / "rush_hour_radio" / "radio_load.csv")
    table = table[table["system"] == "central"]
    header, columns = [""], []
    for case, own in table.groupby("case", sort=False):
        found = own.set_index("indicator")
        header.append(str(case) if " " in str(case) else f"`{case}`")
        columns.append(found["value"])
        if found["published"].notna().any():
            header.append("published")
            columns.append(found["published"])
    names = [name for name in RADIO_LABELS if name in columns[0].index]
    rows = [
        [RADIO_LABELS[name], *(_radio_cell(name, it[name]) for it in columns)] for name in names
    ]
    return markdown(header, rows)


def _radio_cell(name: str, value: float) -> str:
    if np.isnan(value):
        return "-"
    return f"{value:.2f}" if name.endswith("_s") else f"{value:.1f}"


def availability_table() -> str:
    """Return failures, stopped time and availability beside the published ones."""
    folder = OUT / "control_map_availability"
    table = pd.read_csv(folder / "availability.csv").set_index("system")
    rows = [
        [
            label,
            *(
                f"{ours:.{decimals}f} ({told:.{decimals}f})"
                for ours, told in zip(table[name], table[f"published_{name}"], strict=True)
            ),
        ]
        for name, (label, decimals) in AVAILABILITY_ROWS.items()
    ]
    years = pd.read_csv(folder / "outages.csv").set_index(["indicator", "system"])
    for name, label in (
        ("failures_per_year", "failures per year, simulated"),
        ("whole_stops_per_year", "stops of the whole line per year, simulated"),
    ):
        cells = [years.loc[(name, system)] for system in table.index]
        rows.append([label, *(f"{it['mean']:.3f} ± {it['half_width']:.3f}" for it in cells)])
    return markdown(["", *(label_of(name) for name in table.index)], rows)


def doubted(name: str) -> str:
    """Return a table of the sensitivity study."""
    return (OUT / "sensitivity" / f"{name}.md").read_text("utf-8").strip()


def radio_speed() -> str:
    """Return how fast radio traffic is simulated."""
    figures = json.loads((OUT / "bench.json").read_text(encoding="utf-8"))
    taken_s = figures["radio_hour_s"]
    return (
        f"One hour of radio traffic of {TRAINS} trains takes {taken_s:.1f} s, "
        f"{3600.0 / taken_s:,.0f} times as fast as real time."
    )


def draw_rush_hour() -> None:
    """Draw some controllers of the rush hour."""
    results = read_results(OUT / "rush_hour")
    runs = [results.run(name) for name in DRAWN]
    title = "Keihin-Tohoku line, Omiya to Nishi-Nippori, weekday morning peak"
    figure = time_distance_figure(runs, results.stations, title=title)
    write_figure(figure, OUT / "time_distance")


def _replace(file: Path, name: str, make: Callable[[], str]) -> None:
    text = file.read_text(encoding="utf-8")
    pattern = rf"(<!-- {name} -->\n).*?(<!-- end -->)"
    changed, places = re.subn(
        pattern, lambda found: f"{found[1]}{make()}\n{found[2]}", text, flags=re.DOTALL
    )
    if places != 1:
        msg = f"{file}: <!-- {name} --> stands there {places} times; allowed: once"
        raise ValueError(msg)
    file.write_text(changed, encoding="utf-8")


def main() -> None:
    """Replace the tables and the figures."""
    results, model = PROJECT / "docs" / "results.md", PROJECT / "docs" / "model.md"
    readme = PROJECT / "README.md"
    _replace(readme, "printed", lambda: comparison_table(OUT / "rush_hour", SHORT, PRINTED))
    _replace(results, "own-seed", lambda: comparison_table(OUT / "rush_hour", PLAIN))
    for line in ("rush_hour", "yizhuang"):
        seeds = OUT / "seeds" / line
        _replace(results, f"seeds-{line}", partial(comparison_table, seeds, SATO))
        planned = OUT / "approach" / line
        _replace(results, f"approach-{line}", partial(comparison_table, planned, (), WEIGHED))
    own = OUT / "rush_hour"
    _replace(results, "exclusive", lambda: comparison_table(own, EXCLUSIVE))
    _replace(results, "protections", lambda: comparison_table(own, PROTECTED))
    _replace(results, "own-seed-yizhuang", lambda: comparison_table(OUT / "yizhuang", CARRIED))
    _replace(results, "headways", headways_table)
    _replace(results, "capacity", capacity_table)
    _replace(results, "interval", lambda: (OUT / "station_interval.md").read_text("utf-8").strip())
    _replace(results, "driving", lambda: (OUT / "driving.md").read_text("utf-8").strip())
    _replace(results, "radio", radio_table)
    _replace(results, "availability", availability_table)
    _replace(results, "radio-speed", radio_speed)
    _replace(results, "eco", lambda: comparison_table(OUT / "eco_driving", (), ECO))
    _replace(results, "limits", limits_table)
    _replace(results, "map", lambda: comparison_table(OUT / "map" / "rush_hour", MAPPED))
    _replace(results, "reserve", reserve_table)
    _replace(results, "stress", lambda: (OUT / "stress" / "stress.md").read_text("utf-8").strip())
    _replace(results, "losses", losses_table)
    _replace(results, "faults", faults_table)
    _replace(results, "sakai", sakai_table)
    _replace(results, "bench", bench_table)
    _replace(model, "steps", steps_table)
    for name in ("assumptions", "effects", "conclusion"):
        _replace(PROJECT / "docs" / "sensitivity.md", f"doubted-{name}", partial(doubted, name))
    ensembles = PROJECT / "docs" / "guide" / "ensembles.md"
    _replace(ensembles, "variance", lambda: (OUT / "variance.md").read_text("utf-8").strip())
    papers = PROJECT / "docs" / "papers.md"
    _replace(papers, "sakai", sakai_table)
    _replace(papers, "sato", sato_table)
    _replace(papers, "sugiyama", sugiyama_table)
    _replace(papers, "takaoka", takaoka_table)
    draw_rush_hour()
    for place, figure in FIGURES.items():
        shutil.copyfile(OUT / f"{place}.png", PROJECT / "docs" / f"{figure}.png")


if __name__ == "__main__":
    main()
