"""What a page tells, from saved tables: verdict, comparison, and every run's tables."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.page.citing import citation
from kankaku.analysis.page.packing import Packed, Packer
from kankaku.analysis.results import Results
from kankaku.analysis.tables.across_tables import across_frame
from kankaku.analysis.tables.causes import Seen
from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.compare import comparison
from kankaku.analysis.tables.delay_tree import delay_tree
from kankaku.analysis.tables.indicators import INDICATOR_OF, Topic
from kankaku.analysis.tables.line_told import finite
from kankaku.analysis.tables.pareto import best_controllers
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.analysis.tables.summary import SUMMARY
from kankaku.analysis.tables.verdict import competing_controllers, marked, verdict
from kankaku.analysis.texts.comparison_texts import change_text, mean_text
from kankaku.analysis.texts.verdict_texts import LANGUAGES, safety_text, verdict_text

SCHEMA = 1
"""Which form the data has; the browser's part refuses another one. [-]"""
MOST_RUNS = 720
"""Of so many runs the page holds all calls, of more those of the first seeds. [-]"""
MOST_ROWS = 24_000
"""So many rows of the summary the page holds. [-]"""
MOST_SAMPLES = 4_000_000
"""So many samples of trajectories the page holds, of the first controllers. [-]"""
PASSING = frozenset({"interrupted", "wall_s", "processors", "runs"})
"""What provenance says of one time only: the page is the same bytes for the same results."""
SMALL_TABLES = (
    "interstation_stops",
    "remaining_stops",
    "energy",
    "obstructions",
    "violations",
    "unfinished",
)
CALLS = (
    "train",
    "sequence",
    "station",
    "track",
    "stop_m",
    "booked_arrival_s",
    "booked_departure_s",
    "arrival_s",
    "departure_s",
    "arrival_delay_s",
    "departure_delay_s",
    "dwell_delay_s",
    "primary_delay_s",
    "secondary_delay_s",
)
"""Columns of ``calls`` that the page shows: of forty seeds the others would be half of it."""
TRAJECTORY = ("time_s", "front_m", "speed_mps", "limit_m", "track", "reason", "plan", "cause")


class Note(NamedTuple):
    """What a reader has to know of the results."""

    en: str
    ja: str


class PageSource(NamedTuple):
    """Results that a page shows together."""

    name: str
    """What they are called: the scenario, or the folder."""
    results: Results
    line: Mapping[str, Any] = {}
    """What :func:`~kankaku.analysis.tables.line_told.line_told` returned; empty if not kept."""
    notes: tuple[Note, ...] = ()

    @property
    def knows_future(self) -> tuple[str, ...]:
        """Controllers that are told the drawn dwell delays."""
        return tuple(self.line.get("knows_future", ()))

    @property
    def peers(self) -> tuple[str, ...]:
        """Controllers under which another program drives the trains."""
        return tuple(name for name, layers in _layers_of(self).items() if "peer" in layers)


def page_data(sources: Sequence[PageSource]) -> Packed:
    """
    Return everything that a page tells.

    Parameters
    ----------
    sources
        Results, those first that the page opens with.

    Returns
    -------
    Packed
        For :func:`kankaku.analysis.page.packing.compressed`.

    Raises
    ------
    ValueError
        If there are none, or one has no run.
    """
    if not sources:
        msg = "a page needs results: there are none"
        raise ValueError(msg)
    packer = Packer()
    told = {
        "schema": SCHEMA,
        "indicators": [
            {
                "name": name,
                "topic": Topic(one.topic).name.lower(),
                "label": one.label,
                "unit": one.column.unit,
                "meaning": one.column.meaning,
                "sense": one.sense,
            }
            for name, one in INDICATOR_OF.items()
        ],
        "results": [_told(packer, source) for source in sources],
        "cite": citation(one for source in sources for one in _layers_of(source).values()),
    }
    return Packed(finite(told), packer.content())


def _told(packer: Packer, source: PageSource) -> dict[str, Any]:
    results, knows_future = source.results, source.knows_future
    summary = results.summary
    aside = {*knows_future, *source.peers}
    found = verdict(summary, aside)
    names = list(dict.fromkeys(summary["controller"].astype(str)))
    competing = competing_controllers(summary, aside)
    across = across_frame({source.name: summary}, names, knows_future)
    shown, notes = _shown_runs(results.runs)
    rows, more_notes = _shown_rows(summary)
    return {
        "name": source.name,
        "title": str(source.line.get("title", results.provenance.get("scenario", source.name))),
        "notes": [note._asdict() for note in (*source.notes, *notes, *more_notes)],
        "verdict": {language: verdict_text(found, language) for language in LANGUAGES},
        "safety": {language: safety_text(found, language) for language in LANGUAGES},
        "safe": not found.unsafe,
        "leaders": {
            topic: leader.controller if leader else None
            for topic, leader in zip(
                ("stops", "delay", "energy"), (found.stops, found.delay, found.energy), strict=True
            )
        },
        "controllers": [_controller(source, name, competes=name in competing) for name in names],
        "seeds": [int(seed) for seed in pd.unique(summary["seed"])],
        "delays_s": [float(delay_s) for delay_s in pd.unique(summary["initial_delay_s"])],
        "comparison": _compared(summary, competing),
        "across": rows_of(across),
        "undominated": best_controllers(across),
        "summary": packer.table(rows, _shown_columns()),
        "stations": rows_of(results.stations),
        "line": dict(source.line),
        "published": _published(source),
        "provenance": _provenance(results.provenance),
        "runs": [_run(packer, run) for run in shown],
        "network": {name: packer.table(frame) for name, frame in results.network.items()},
    }


def _compared(summary: pd.DataFrame, competing: Collection[str]) -> list[dict[str, Any]]:
    rows = marked(comparison(summary), competing)
    for row in rows:
        row |= {"mean_told": mean_text(row["mean"]), "change_told": change_text(row)}
    return rows


def _layers_of(source: PageSource) -> Mapping[str, Mapping[str, Any]]:
    """Return what each controller is made of, as far as the results say."""
    told = source.results.provenance.get("controllers", {})
    named = told.items() if isinstance(told, Mapping) else ()
    return {str(name): layers for name, layers in named if isinstance(layers, Mapping)}


def _controller(source: PageSource, name: str, *, competes: bool) -> dict[str, Any]:
    return {
        "name": name,
        "knows_future": name in source.knows_future,
        "peer": name in source.peers,
        "competes": competes,
        "layers": dict(_layers_of(source).get(name, {})),
    }


def _shown_columns() -> list[str]:
    return [column.name for column in SUMMARY]


def _shown_rows(summary: pd.DataFrame) -> tuple[pd.DataFrame, list[Note]]:
    if len(summary) <= MOST_ROWS:
        return summary, []
    seeds = max(MOST_ROWS // summary["controller"].nunique(), 1)
    first = pd.unique(summary["seed"])[:seeds]
    kept = summary[summary["seed"].isin(first)]
    note = Note(
        f"Single seeds are shown of the first {seeds} only; means and intervals are of all.",
        f"個々のシードは最初の {seeds} 個だけを示す。平均と区間は全シードによる。",
    )
    return kept, [note]


def _shown_runs(runs: Sequence[RunTables]) -> tuple[list[RunTables], list[Note]]:
    if len(runs) <= MOST_RUNS:
        return list(runs), []
    each = max(MOST_RUNS // len({run.controller for run in runs}), 1)
    seeds = list(dict.fromkeys(run.seed for run in runs))[:each]
    kept = [run for run in runs if run.seed in seeds]
    note = Note(
        f"Trains are shown of the first {len(seeds)} seeds only.",
        f"列車ごとの結果は最初の {len(seeds)} シードだけを示す。",
    )
    return kept, [note]


def _run(packer: Packer, run: RunTables) -> dict[str, Any]:
    frames = {name: getattr(run, name) for name in SMALL_TABLES}
    told: dict[str, Any] = {
        "controller": run.controller,
        "seed": run.seed,
        "initial_delay_s": run.initial_delay_s,
        "calls": packer.table(run.calls, CALLS),
        **{name: packer.table(frame) for name, frame in frames.items() if len(frame)},
    }
    if len(run.trajectory) and packer.samples + len(run.trajectory) <= MOST_SAMPLES:
        packer.samples += len(run.trajectory)
        samples, trips = _by_trip(run.trajectory)
        told["trajectory"] = packer.table(samples, TRAJECTORY)
        told["trips"] = trips
        if (edges := _edges(run)) is not None:
            told["edges"] = packer.table(edges)
    return told


def _edges(run: RunTables) -> pd.DataFrame | None:
    """Return who delayed whom; None of tables that nobody can follow."""
    try:
        return delay_tree(Seen(run)).edges
    except (KeyError, IndexError, ValueError):
        return None


def _by_trip(trajectory: pd.DataFrame) -> tuple[pd.DataFrame, list[list[Any]]]:
    """Return the samples train by train, and where each one's begin and end."""
    codes, names = pd.factorize(trajectory["train"])
    order = np.lexsort((trajectory["time_s"].to_numpy(), codes))
    ends = np.searchsorted(codes[order], np.arange(len(names) + 1))
    trips = [
        [str(name), int(start), int(end)]
        for name, start, end in zip(names, ends[:-1], ends[1:], strict=True)
    ]
    return trajectory.iloc[order].reset_index(drop=True), trips


def _provenance(told: Mapping[str, Any]) -> dict[str, Any]:
    """Return how results were made, without what differs from one time to the next."""
    parts = {str(name): value for name, value in told.items() if name not in PASSING}
    if isinstance(parts.get("results"), Mapping):
        joined = parts["results"].items()
        parts["results"] = {
            str(name): _provenance(one) for name, one in joined if isinstance(one, Mapping)
        }
    return parts


def _published(source: PageSource) -> dict[str, Any] | None:
    results = source.results
    if results.sweep is None or results.intervals is None:
        return None
    published = source.line.get("published") or {}
    return {
        "source": str(published.get("source", "")),
        "rows": rows_of(results.sweep),
        "intervals": rows_of(results.intervals),
        "sweep": results.provenance.get("sweep"),
    }


def together(sources: Sequence[PageSource]) -> list[PageSource]:
    """
    Return results with those of the same line and trains made one, so that they can be compared.

    Parameters
    ----------
    sources
        Results.

    Returns
    -------
    list[PageSource]
        Controllers of several results are told by the name of the results before their own.
    """
    alike: dict[tuple[object, ...], list[PageSource]] = {}
    for source in sources:
        alike.setdefault(_kind_of(source.results), []).append(source)
    return [same[0] if len(same) == 1 else _joined(same) for same in alike.values()]


def _kind_of(results: Results) -> tuple[object, ...]:
    stations = tuple(results.stations["station"])
    trains = tuple(sorted(set(results.runs[0].calls["train"]))) if results.runs else ()
    return stations, trains, results.sweep is None


def _joined(sources: Sequence[PageSource]) -> PageSource:
    first = sources[0]
    names = [f"{source.name}: " for source in sources]
    runs = [
        replace(run, controller=name + run.controller)
        for name, source in zip(names, sources, strict=True)
        for run in source.results.runs
    ]
    summaries = [
        source.results.summary.assign(controller=name + source.results.summary["controller"])
        for name, source in zip(names, sources, strict=True)
    ]
    told = {
        **first.results.provenance,
        "controllers": dict(_layers(names, sources)),
        "results": {source.name: dict(source.results.provenance) for source in sources},
    }
    future = [
        name + controller
        for name, source in zip(names, sources, strict=True)
        for controller in source.knows_future
    ]
    results = replace(
        first.results,
        summary=pd.concat(summaries, ignore_index=True),
        runs=tuple(runs),
        provenance=told,
        intervals=None,
        sweep=None,
        network={},
    )
    notes = (*_digests(sources), *(note for source in sources for note in source.notes))
    line = {**first.line, "knows_future": future} if first.line else {"knows_future": future}
    return PageSource(" + ".join(s.name for s in sources), results, line, notes)


def _layers(names: Sequence[str], sources: Sequence[PageSource]) -> Iterator[tuple[str, Any]]:
    for name, source in zip(names, sources, strict=True):
        for controller, layers in _layers_of(source).items():
            yield name + controller, layers


def _digests(sources: Collection[PageSource]) -> list[Note]:
    found = {str(s.results.provenance.get("scenario_sha256", "")) for s in sources}
    if len(found) == 1:
        return []
    return [
        Note(
            "The results compared here were made from different scenario files.",
            "比較した結果は異なるシナリオファイルから作られた。",
        )
    ]
