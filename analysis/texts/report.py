"""A short report in Markdown: what was run, what came out, and why trains were slow."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.compare import comparison, told_indicators
from kankaku.analysis.tables.indicators import COMPARED
from kankaku.analysis.tables.run_tables import DWELLING, PLAN, REASONS, RunTables
from kankaku.analysis.tables.sweep import SWEEP_INDICATORS, SweepTables
from kankaku.analysis.texts.comparison_texts import comparison_note, comparison_texts
from kankaku.analysis.texts.sweep_texts import sweep_texts
from kankaku.analysis.words import FORETOLD, label_of

REASON_TEXTS: Mapping[str, str] = {
    "traction": "accelerating",
    "line_limit": "line speed",
    "train_ahead": "a train ahead",
    "obstruction_ahead": "points, a level crossing or a closure ahead",
    "station_stop": "braking for its own stop",
    "plan": "plan of the operation",
    "emergency": "emergency brake",
    "peer": "driven by the peer",
    "held": "held at its platform, doors closed",
}
MOST_UNFINISHED = 30
"""Trains that the report names; all of them are in the tables."""
_OWN_TO_MARKDOWN = re.compile(r"[\\`*\[\]<>|$~@&#!]|(?<![^\W_])_|_(?![^\W_])")
# Wall times stay in provenance.json, so that the report can be reproduced.
FACTS: Mapping[str, str] = {
    "scenario": "scenario",
    "scenario_sha256": "SHA-256 of its files",
    "step_s": "step [s]",
}


class Shortfalls(NamedTuple):
    """What of a study did not come to its end."""

    failures: Sequence[str] = ()
    """Sentences about runs that failed and are in no table."""
    unfinished: Sequence[str] = ()
    """A heading and a sentence for each train that had not finished; empty if there are none."""


NO_SHORTFALLS = Shortfalls()


class Notes(NamedTuple):
    """What is told of controllers beside their numbers."""

    knows_future: Collection[str] = ()
    """Names of those that are told the drawn dwell delays."""
    remaining: Sequence[str] = ()
    """A sentence for each controller about the stops that remain; none in a sweep."""


NO_NOTES = Notes()


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
        Shares by reason and the operation's own word, in the order of ``REASONS`` without
        dwelling, words by name; they add up to 1 (all 0 if nothing ran). [-]
    """
    counts = _samples_by_reason(trajectory[trajectory["reason"] != DWELLING])
    return counts / max(int(counts.sum()), 1)


def waits_s(trajectory: pd.DataFrame) -> pd.Series:
    """
    Return for how long trains stood that no stop held, by reason.

    Parameters
    ----------
    trajectory
        The table ``trajectory`` of one run; its samples are evenly spaced.

    Returns
    -------
    pd.Series
        Times of all trains together, indexed as :func:`reason_shares`. [s]
    """
    stands = trajectory["speed_mps"] == 0.0
    # Who moves at the next sample was only starting.
    stays = stands.groupby(trajectory["train"], sort=False).shift(-1, fill_value=False)
    waits = (trajectory["reason"] != DWELLING) & stands & stays
    moments_s = np.unique(trajectory["time_s"])
    spacing_s = float(np.median(np.diff(moments_s))) if moments_s.size > 1 else 0.0
    return _samples_by_reason(trajectory[waits]) * spacing_s


def _samples_by_reason(samples: pd.DataFrame) -> pd.Series:
    """Count samples by reason and the operation's own word."""
    counts = samples.groupby(["reason", "plan"]).size()
    words = sorted(word for _, word in counts.index if word)
    reasons = [
        (reason, word)
        for reason in REASONS
        if reason != DWELLING
        for word in (words if reason == PLAN else [""])
    ]
    index = pd.MultiIndex.from_tuples(reasons, names=["reason", "plan"])
    return counts.reindex(index, fill_value=0)


def unfinished_heading(trains: int, patience_s: float) -> str:
    """
    Return how it is told that trains had not finished.

    Parameters
    ----------
    trains
        How many, in all runs together. [-]
    patience_s
        How long after the last booked call runs end. [s]

    Returns
    -------
    str
        One line.
    """
    told = f"{trains} train{'s' if trains > 1 else ''} had not finished"
    return f"{told} when patience_min = {patience_s / 60.0:g} ended the run"


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


def report_text(  # noqa: PLR0913 - one argument per part of the report
    title: str,
    runs: Sequence[RunTables],
    summary: pd.DataFrame,
    provenance: Mapping[str, Any],
    figures: Iterable[str],
    *,
    swept: SweepTables | None = None,
    shortfalls: Shortfalls = NO_SHORTFALLS,
    by_direction: pd.DataFrame | None = None,
    notes: Notes = NO_NOTES,
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
    shortfalls
        What did not come to its end.
    by_direction
        The table of that name; None for a chain, whose trains all run one way.
    notes
        What is told of controllers beside their numbers.

    Returns
    -------
    str
        Markdown.
    """
    sections = (
        [f"# {markdown(title)}"],
        _what_was_run(summary, provenance),
        [
            *_safety(summary, swept=swept is not None),
            *_peers(provenance),
            *_failed(shortfalls.failures),
        ],
        *([_unfinished(shortfalls.unfinished)] if shortfalls.unfinished else []),
        _swept(swept) if swept else _compared(summary, notes.knows_future),
        *([_directions(by_direction)] if by_direction is not None else []),
        _reasons(runs),
        *([_remaining(notes.remaining)] if notes.remaining else []),
        [f"![{label_of(name.rpartition('.')[0])}]({name})" for name in figures],
        _meanings(summary, swept=swept is not None),
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
    bad = summary[summary["violations"] > 0]
    if bad.empty:
        every = bool((summary["trains_completed"] == summary["trains"]).all())
        trains = "Every train finished, and no" if every else "No"
        return [f"{trains} safety invariant was violated."]
    return [
        f"**{_run_text(row, swept=swept)}: {row['violations']} violations of safety "
        f"invariants ({row['collisions']} collisions). Do not use its other figures.**\n"
        for row in rows_of(bad)
    ]


def _failed(failures: Sequence[str]) -> list[str]:
    if not failures:
        return []
    return ["", "**Runs that failed are in no table:**", "", *(f"- {told}" for told in failures)]


def _unfinished(told: Sequence[str]) -> list[str]:
    heading, *sentences = told
    lines = [f"- {sentence}" for sentence in sentences[:MOST_UNFINISHED]]
    if len(sentences) > MOST_UNFINISHED:
        lines.append(f"- and {len(sentences) - MOST_UNFINISHED} more, in `unfinished.csv`")
    counted = "Calls that they had not reached count as late until the end of the run."
    return [f"## {heading}", "", *lines, "", counted]


def _run_text(row: Mapping[str, Any], *, swept: bool) -> str:
    told = f"{row['controller']}, seed {row['seed']}"
    return f"{told}, initial delay {row['initial_delay_s']:.1f} s" if swept else told


def _peers(provenance: Mapping[str, Any]) -> list[str]:
    controllers = provenance.get("controllers", {})
    names = [name for name, told in controllers.items() if "peer" in told]
    if not names:
        return []
    told = (
        f"Under {', '.join(names)} another program drives the trains: only collisions count as "
        "violations there."
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


def _compared(summary: pd.DataFrame, knows_future: Collection[str]) -> list[str]:
    compared = comparison(summary)
    header, rows = comparison_texts(compared, knows_future)
    several = len(set(summary["seed"])) > 1
    told = comparison_note(compared)
    if several:
        told += "; means over seeds, ± half of the 95 % confidence interval of paired differences"
    warned = [FORETOLD] if knows_future else []
    return ["## Comparison", "", *_table(header, rows), "", " ".join([f"{told}.", *warned])]


def _remaining(sentences: Sequence[str]) -> list[str]:
    last = "`remaining_stops.csv` of each run follows every stop back to its first cause."
    return ["## Why trains still stood", "", *(f"- {told}" for told in sentences), "", last]


def _directions(by_direction: pd.DataFrame) -> list[str]:
    runs = by_direction.groupby(["controller", "direction"], sort=False)
    measured = ["mean_arrival_delay_s", "interstation_stop_time_s", "passed_on_s"]
    rows = [
        [
            f"{name}, {way}",
            str(int(own["trains"].max())),
            *(f"{own[of].mean():.1f} s" for of in measured),
        ]
        for (name, way), own in runs
    ]
    header = [
        "direction of chainage",
        "trains",
        "mean arrival delay",
        "stop time between stations",
        "delay that came with stock",
    ]
    several = ", means over all runs" if len(by_direction) > len(rows) else ""
    told = (
        f"By direction{several}. Delay comes with stock where a train arrives too late for the "
        "booked time to turn back; the sum over trains. `by_hour.csv` has the same by the hour, "
        "`turn_backs.csv` every train, `node_use.csv` how much points and platforms are used."
    )
    return ["## Directions", "", *_table(header, rows), "", told]


def _reasons(runs: Sequence[RunTables]) -> list[str]:
    delay_s = runs[0].initial_delay_s
    which = f" with an initial delay of {delay_s:g} s" if delay_s else ""
    shares = {run.controller: 100.0 * reason_shares(run.trajectory) for run in runs}
    waits = {run.controller: waits_s(run.trajectory) for run in runs}
    return [
        "## What bound the speed",
        "",
        f"Share of the running time{which}, dwells left out:",
        "",
        *_by_reason(shares, " %"),
        "",
        f"Time at a stand{which} that no stop demanded, all trains together:",
        "",
        *_by_reason(waits, " s"),
    ]


def _by_reason(found: Mapping[str, pd.Series], unit: str) -> Iterator[str]:
    table = pd.DataFrame(found).fillna(0.0)
    # A word of one operation is a row for all controllers.
    table = table.sort_index(key=_ranks)
    used = table[(table > 0.0).any(axis=1)]
    rows = [
        [_reason_text(*map(str, reason)), *(f"{value:.1f}{unit}" for value in row)]
        for reason, row in zip(used.index, used.to_numpy().tolist(), strict=True)
    ]
    return _table(["bound by", *found], rows)


def _ranks(level: pd.Index) -> pd.Index:
    return level.map(REASONS.index) if level.name == "reason" else level


def _reason_text(reason: str, word: str) -> str:
    return f"{REASON_TEXTS[reason]}: {label_of(word)}" if word else REASON_TEXTS[reason]


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(header)} |"
    yield f"|---|{'---:|' * (len(header) - 1)}"
    for row in rows:
        yield f"| {' | '.join(row)} |"


def _meanings(summary: pd.DataFrame, *, swept: bool) -> list[str]:
    told = [COMPARED[name] for name in told_indicators(summary)]
    compared = [(one.label, one.column.meaning) for one in told]
    meanings = SWEEP_INDICATORS.values() if swept else compared
    return [
        "## What the indicators mean",
        "",
        *(f"- **{label}**: {meaning}" for label, meaning in meanings),
        "",
        "`columns.csv` explains every column of every table.",
    ]
