"""A short report in Markdown: what was run, what came out, and why trains were slow."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import pandas as pd

from analysis.compare import INDICATORS, comparison, comparison_texts
from analysis.figures import label_of
from analysis.schema import rows_of
from analysis.summary import SUMMARY
from analysis.sweep import SWEEP_INDICATORS, SweepTables, sweep_texts
from analysis.tables import DWELLING, REASONS, RunTables

REASON_TEXTS: Mapping[str, str] = {
    "traction": "accelerating",
    "line_ceiling": "line speed",
    "authority": "protection: a train or a conflict ahead",
    "station_stop": "braking for its own stop",
    "peer": "driven by the peer",
}
_OWN_TO_MARKDOWN = re.compile(r"[\\`*\[\]<>|$~@&#!]|(?<![^\W_])_|_(?![^\W_])")
# Wall times stay in provenance.json, so that the report can be reproduced.
FACTS: Mapping[str, str] = {
    "scenario": "scenario",
    "scenario_sha256": "SHA-256 of its files",
    "step_s": "step [s]",
}


def reason_shares(trajectory: pd.DataFrame) -> pd.Series:
    """
    Return which share of the running time each reason bound the speed.

    Parameters
    ----------
    trajectory
        The table ``trajectory`` of one run; its samples are evenly spaced.

    Returns
    -------
    pd.Series
        Shares by reason, in the order of ``REASONS`` without dwelling; they add up to 1
        (all 0 if nothing ran). [-]
    """
    running = trajectory.loc[trajectory["reason"] != DWELLING, "reason"]
    counts = running.value_counts().reindex(
        [reason for reason in REASONS if reason != DWELLING], fill_value=0
    )
    return counts / max(int(counts.sum()), 1)


def markdown(text: str) -> str:
    """
    Return a text of the files as Markdown shows it unchanged.

    Parameters
    ----------
    text
        For example the title of a scenario.

    Returns
    -------
    str
        The same, with a backslash before what Markdown would take for its own.
    """
    return _OWN_TO_MARKDOWN.sub(r"\\\g<0>", text)


def report_text(
    title: str,
    runs: Sequence[RunTables],
    summary: pd.DataFrame,
    provenance: Mapping[str, Any],
    figures: Iterable[str],
    *,
    swept: SweepTables | None = None,
) -> str:
    """
    Return the report.

    Parameters
    ----------
    title
        Title of the scenario.
    runs
        One run per controller, baseline first, for the reasons.
    summary
        The table ``summary`` of all seeds and initial delays.
    provenance
        What was run, by key.
    figures
        File names of the figures beside the report.
    swept
        What a sweep shows, in place of the comparison; None without a sweep.

    Returns
    -------
    str
        Markdown.
    """
    sections = (
        [f"# {markdown(title)}"],
        _what_was_run(summary, provenance),
        [*_safety(summary, swept=swept is not None), *_peers(provenance)],
        _swept(swept) if swept else _compared(summary),
        _reasons(runs),
        [f"![{label_of(name.rpartition('.')[0])}]({name})" for name in figures],
        _meanings(swept=swept is not None),
    )
    return "\n".join(line for section in sections for line in [*section, ""]).rstrip() + "\n"


def _what_was_run(summary: pd.DataFrame, provenance: Mapping[str, Any]) -> list[str]:
    controllers = list(dict.fromkeys(summary["controller"]))
    seeds = sorted(set(summary["seed"]))
    trains = int(summary["trains"].max())
    told = (
        f"{trains} trains, {len(controllers)} controllers, "
        f"{'seed' if len(seeds) == 1 else 'seeds'} {', '.join(map(str, seeds))}. "
        "Every controller met the same line, timetable and dwell delays."
    )
    facts = [f"- {text}: {provenance[key]}" for key, text in FACTS.items() if key in provenance]
    return [told, *(["", *facts] if facts else [])]


def _safety(summary: pd.DataFrame, *, swept: bool) -> list[str]:
    bad = summary[(summary["violations"] > 0) | (summary["trains_completed"] < summary["trains"])]
    if bad.empty:
        return ["Every train reached the end of the line, and no safety invariant was violated."]
    return [
        f"**{_run_text(row, swept=swept)}: {row['violations']} violations of safety "
        f"invariants ({row['collisions']} collisions), {row['trains_completed']} of "
        f"{row['trains']} trains completed. Do not use its other figures.**\n"
        for row in rows_of(bad)
    ]


def _run_text(row: Mapping[str, Any], *, swept: bool) -> str:
    told = f"{row['controller']}, seed {row['seed']}"
    return f"{told}, initial delay {row['initial_delay_s']:.1f} s" if swept else told


def _peers(provenance: Mapping[str, Any]) -> list[str]:
    controllers = provenance.get("controllers", {})
    names = [name for name, told in controllers.items() if "peer" in told]
    if not names:
        return []
    told = (
        f"Under {', '.join(names)} another program drives the trains: only collisions and trains "
        "that never reach the end of the line count as violations there."
    )
    return ["", told]


def _swept(swept: SweepTables) -> list[str]:
    sweep, delays_s = swept.sweep, swept.intervals["initial_delay_s"]
    told = (
        f"Train {sweep.train} overstays at {sweep.station} by {delays_s.nunique()} initial delays "
        f"from {delays_s.min():g} s to {delays_s.max():g} s, one run each. The interval runs from "
        "its departure to the arrival of the next train at the same platform track."
    )
    source = ["", f"Published: {markdown(swept.published.source)}."] if swept.published else []
    return ["## Intervals", "", told, "", *_table(*sweep_texts(swept.indicators)), *source]


def _compared(summary: pd.DataFrame) -> list[str]:
    compared = comparison(summary)
    header, rows = comparison_texts(compared)
    several = len(set(summary["seed"])) > 1
    told = f"In brackets: change against {header[1]}"
    if several:
        told += "; means over seeds, ± half of the 95 % confidence interval of paired differences"
    named = header
    return ["## Comparison", "", *_table(named, rows), "", f"{told}."]


def _reasons(runs: Sequence[RunTables]) -> list[str]:
    shares = {run.controller: reason_shares(run.trajectory) for run in runs}
    delay_s = runs[0].initial_delay_s
    which = f" with an initial delay of {delay_s:g} s" if delay_s else ""
    table = pd.DataFrame(shares)
    used = table[(table > 0.0).any(axis=1)]
    rows = [
        [_reason_text(str(reason)), *(f"{100 * v:.1f} %" for v in row)]
        for reason, row in zip(used.index, used.to_numpy().tolist(), strict=True)
    ]
    return [
        "## What bound the speed",
        "",
        f"Share of the running time{which}, dwells left out:",
        "",
        *_table(["bound by", *shares], rows),
    ]


def _reason_text(reason: str) -> str:
    return REASON_TEXTS.get(reason, f"operation: {label_of(reason)}")


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(header)} |"
    yield f"|---|{'---:|' * (len(header) - 1)}"
    for row in rows:
        yield f"| {' | '.join(row)} |"


def _meanings(*, swept: bool) -> list[str]:
    explained = {column.name: column.meaning for column in SUMMARY}
    compared = [(label, explained[name]) for name, label in INDICATORS.items()]
    meanings = SWEEP_INDICATORS.values() if swept else compared
    return [
        "## What the indicators mean",
        "",
        *(f"- **{label}**: {meaning}" for label, meaning in meanings),
        "",
        "`columns.csv` explains every column of every table.",
    ]
