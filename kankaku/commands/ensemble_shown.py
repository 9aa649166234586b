"""What the commands ``study`` and ``merge`` show: how it comes along, and what the runs show."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.markup import escape

from kankaku.analysis.publish.results_folder import EVERY_FORMAT, FORMATS
from kankaku.analysis.tables.across_tables import across_frame
from kankaku.analysis.tables.indicators import COMPARED
from kankaku.analysis.texts.across_texts import across_lines, across_note
from kankaku.commands.run_shown import tell_interrupted
from kankaku.commands.screen import (
    Log,
    answers,
    bars,
    console,
    counted_text,
    exit_status,
    refusals,
    show_doubts,
    show_group,
    show_warnings,
)
from kankaku.railway.errors import suggesting
from kankaku.railway.plan.design_names import INDEPENDENT, REPLICATE_SIZES
from kankaku.store.ensemble_plan import EnsembleError
from kankaku.studies.ensemble import Ensemble, choose_ensemble
from kankaku.studies.ensemble_findings import Drawing, EnsembleFindings
from kankaku.studies.ensemble_merging import merge
from kankaku.studies.ensemble_running import EnsembleResult, Tell, crew_of, run_ensemble

LOG_RUNS_EVERY_S = 30.0
"""A log file is told of the runs at most so often. [s]"""


def run_many(
    scenarios: Sequence[Path],
    out: Path,
    choices: Mapping[str, Any],
    wanted: Mapping[str, Any],
    scheduler: str | None,
    drawn: tuple[Sequence[str], Sequence[str]],
) -> int:
    """
    Run controllers on very many seeds and show what comes of it.

    Parameters
    ----------
    scenarios
        Their folders or names.
    out
        Results folder.
    choices
        As of :func:`kankaku.studies.study.choose`.
    wanted
        The other arguments of :func:`kankaku.studies.ensemble.choose_ensemble`.
    scheduler
        As of :func:`kankaku.studies.ensemble_running.crew_of`.
    drawn
        Indicators and formats of the figures; the usual ones where there are none.

    Returns
    -------
    int
        How the command ends.
    """
    with refusals(", ".join(map(str, scenarios)), out):
        drawing, crew = drawing_of(*drawn), crew_of(scheduler)
        ensemble = choose_ensemble(scenarios, choices, **wanted)
        for study in ensemble.studies:
            show_warnings(study.scenario.warnings)
            show_doubts(study)
        with _shown(len(ensemble.tasks)) as tell:
            result = run_ensemble(ensemble, out, drawing, crew=crew, say=_say, tell=tell)
    return _report(result, ensemble)


def put_together(
    out: Path, parts: Sequence[Path], drawn: tuple[Sequence[str], Sequence[str]]
) -> int:
    """
    Put parts of a study together and show what comes of it.

    Parameters
    ----------
    out
        Results folder of the whole.
    parts
        Those of the parts.
    drawn
        As of :func:`run_many`.

    Returns
    -------
    int
        How the command ends.
    """
    with refusals(out, out):
        findings = merge(out, parts, drawing_of(*drawn))
    _show_findings(findings, out)
    missing = counted_text(len(findings.missing), "run is missing", "runs are missing")
    show_group(missing, [str(task) for task in findings.missing])
    return exit_status(
        violations=bool(findings.violations),
        failures=bool(findings.missing or findings.ended),
        interrupted=False,
    )


def drawing_of(indicators: Sequence[str], formats: Sequence[str]) -> Drawing:
    """
    Return what is to be drawn.

    Parameters
    ----------
    indicators
        Their names; the usual ones if empty.
    formats
        Of the figures; the usual ones if empty.

    Returns
    -------
    Drawing
        The same.

    Raises
    ------
    EnsembleError
        If there is no such indicator or format.
    """
    for option, names, known in (
        ("--indicator", indicators, tuple(COMPARED)),
        ("--figures", formats, EVERY_FORMAT),
    ):
        for name in names:
            if name not in known:
                allowed = suggesting(name, known, ", ".join(known))
                raise EnsembleError(option, f"there is no {name!r}", allowed)
    return Drawing(tuple(indicators), tuple(dict.fromkeys(formats)) or FORMATS)


class RunRate:
    """How fast runs are finished, and how long the others will take."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._begun_s = clock()
        self._first: int | None = None

    def told(self, done: int, total: int) -> str:
        """
        Return both in words.

        Parameters
        ----------
        done
            Runs that have ended, the one that has just ended among them.
        total
            Runs there are at most.

        Returns
        -------
        str
            For example ``12 of 2,000 runs, 1.9 runs/s, 0 h 17 min left``.
        """
        if self._first is None:
            self._first = done - 1
        elapsed_s = max(self._clock() - self._begun_s, 1e-3)
        rate = (done - self._first) / elapsed_s
        minutes = round((total - done) / rate / 60.0)
        left = f"{minutes // 60} h {minutes % 60:02d} min left"
        return f"{done:,} of {total:,} runs, {rate:.2g} runs/s, {left}"


@contextmanager
def _shown(total: int) -> Iterator[Tell]:
    rate = RunRate()
    if console.is_terminal:
        with bars() as shown:
            bar = shown.add_task(f"{total:,} runs", total=total)
            yield lambda _, done, most: shown.update(
                bar, completed=done, total=most, description=rate.told(done, most)
            )
    else:
        log = Log(LOG_RUNS_EVERY_S)
        yield lambda ended, done, most: log.tell(
            f"{ended}; {rate.told(done, most)}", always=done == most or ended.endswith("failed")
        )


def _say(sentence: str) -> None:
    console.print(escape(sentence), soft_wrap=True, highlight=False)


def _report(result: EnsembleResult, ensemble: Ensemble) -> int:
    findings = result.findings
    if findings is not None:
        _show_findings(findings, result.folder)
    if ensemble.shard is not None and not result.interrupted:
        total = len(ensemble.tasks)
        _say(
            f"Part {ensemble.shard}: {result.finished} of {total} runs are in {result.folder}; "
            "kankaku merge puts the parts together."
        )
    failed = counted_text(len(result.failed), "failure", "failures")
    show_group(failed, result.failed)
    if result.interrupted:
        tell_interrupted(kept=result.finished > 0, fresh=ensemble.fresh)
    return exit_status(
        violations=findings is not None and bool(findings.violations),
        failures=bool(result.failed) or (findings is not None and bool(findings.ended)),
        interrupted=result.interrupted,
    )


def _show_findings(findings: EnsembleFindings, folder: Path) -> None:
    plan = findings.plan
    summaries = {
        scenario.name: findings.summary[findings.summary["scenario"] == scenario.name]
        for scenario in plan.scenarios
    }
    table = across_frame(summaries, plan.controllers, plan.knows_future, plan.designs)
    for line in (*across_lines(table), *across_note(table), *_notes(findings)):
        answers.print(line, soft_wrap=True, markup=False, highlight=False)
    answers.print(f"Results: {folder}", soft_wrap=True, markup=False)
    violations = counted_text(len(findings.violations), "safety violation", "safety violations")
    show_group(violations, findings.violations)
    ended = counted_text(len(findings.ended), "run ended early", "runs ended early")
    show_group(ended, findings.ended)
    left = findings.unfinished
    unfinished = counted_text(len(left), "train had not finished", "trains had not finished")
    show_group(unfinished, left, style="yellow")


def _notes(findings: EnsembleFindings) -> Iterator[str]:
    until, engines = findings.told["until"], findings.told["engines_compared"]
    seeds = counted_text(findings.told["seeds"], "seed", "seeds")
    if findings.missing:
        yield f"{len(findings.missing):,} runs of {seeds} are missing in what stands above."
    elif until is None:
        yield f"{seeds} of each scenario and controller."
    elif until["reached"]:
        yield f"{until['wanted']}: reached with {seeds} of each scenario and controller."
    else:
        known = [row["half_width"] for row in until["half_widths"]]
        worst = "unknown" if None in known else f"±{max(known):.3g} {until['unit']}"
        yield f"{until['wanted']}: not reached with {seeds}; the widest interval is {worst}."
    if findings.plan.draws != INDEPENDENT:
        draws = findings.plan.draws
        told = f"intervals are of means over {REPLICATE_SIZES[draws]} seeds"
        yield f"Seeds share their draws ({draws}): {told}."
    if engines is not None and engines["runs"]:
        worst = engines["largest_relative_difference"]
        rows = engines["runs"]
        found = next(row for row in rows if row["largest_relative_difference"] == worst)
        where = f"{found['scenario']}, {found['controller']}, {found['indicator']}"
        told = f" ({where})" if found["indicator"] else ""
        apart = "without bound" if worst is None else f"{worst:.2g}"
        yield f"Largest relative difference to {engines['with']}: {apart}{told}."
