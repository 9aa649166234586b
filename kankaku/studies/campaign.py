"""
UnitFailure campaign: the failure modes of a control map, one by one and a thousand times.

Every run has one failure of one unit; it is compared with a run of the same seed without any.
``kankaku campaign`` gives this a command line.
"""

import json
import os
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from kankaku import interrupts
from kankaku.analysis.publish.campaign_publishing import FaultTables, publish_faults
from kankaku.analysis.results import refuse_foreign
from kankaku.analysis.tables.columns import write_whole
from kankaku.analysis.tables.delay import delay_s
from kankaku.asking import CAMPAIGN_PROTECTION
from kankaku.controllers import registry
from kankaku.controllers.control_map.map_protection import ControlMapOptions, Memory
from kankaku.controllers.control_map.measuring import CENTRE_ROW, Notice
from kankaku.controllers.control_map.wrong_maps import WrongMaps
from kankaku.railway.failures.random_failures import draw_failure
from kankaku.railway.failures.unit_failures import FailureMode, UnitFailure, Variant
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Authority, LineState, Reason
from kankaku.store import failed_runs
from kankaku.store.fingerprint import sources_sha256
from kankaku.store.holding import held
from kankaku.store.run_store import VERSIONED
from kankaku.studies.provenance import provenance_of
from kankaku.studies.study import Study, StudyError, StudyResult, run_once, world_of
from kankaku.workers import Failure, performed

VERSION = 3
"""Of what a run of the campaign is; runs of another one are not continued."""
SEEDS = 20
"""Days that the failures are spread over. [-]"""
STOP_S = 1.0
"""Shorter standstills do not count, as elsewhere. [s]"""
AFTER_S = 30.0
"""A brake this long after a failure may still be a reaction to it. [s]"""
BASELINE = -1
JOURNAL = "journal.jsonl"

Finding: TypeAlias = dict[str, Any]
"""What is found out in a run, as the journal keeps it."""
Progress: TypeAlias = Callable[[int, int], None]
"""Called with the number of finished runs, and of all."""

FINDERS: Mapping[Variant, frozenset[Notice]] = {
    Variant.SLIDE: frozenset({Notice.WHEELS, Notice.BALISE}),
    Variant.SLIP: frozenset({Notice.WHEELS, Notice.BALISE}),
    Variant.WHEEL: frozenset({Notice.WHEELS, Notice.BALISE}),
    Variant.JUMP: frozenset({Notice.TRAIN_STAMP, Notice.REPORT_STAMP, Notice.NO_COMMANDS}),
    Variant.DRIFT: frozenset({Notice.TRAIN_STAMP, Notice.REPORT_STAMP, Notice.NO_COMMANDS}),
    Variant.UP: frozenset({Notice.NO_REPORT}),
    Variant.DOWN: frozenset({Notice.NO_COMMANDS}),
    Variant.BOTH: frozenset({Notice.NO_REPORT, Notice.NO_COMMANDS}),
    Variant.BAND: frozenset({Notice.EXCLUSION}),
    Variant.LEFT_OUT: frozenset({Notice.EXCLUSION, Notice.NO_COMMANDS}),
    Variant.RUN: frozenset({Notice.EXCLUSION}),
    Variant.IGNORED: frozenset({Notice.EXCLUSION}),
    Variant.CENTRE_JUMP: frozenset({Notice.CENTRE_CLOCK}),
    Variant.CENTRE_SILENT: frozenset({Notice.NO_COMMANDS}),
}
"""Whose alarms find a failure; equipment finds its own at once."""


class CampaignTask(NamedTuple):
    """One run of the campaign."""

    number: int
    """:data:`BASELINE` for the run of a seed without failure."""
    seed: int

    def __str__(self) -> str:
        if self.number == BASELINE:
            return f"run without failure (seed {self.seed})"
        return f"run {self.number} (seed {self.seed})"

    @property
    def file_name(self) -> str:
        """The same for a file, without an ending."""
        number = "baseline" if self.number == BASELINE else f"run_{self.number}"
        return f"{number}_seed_{self.seed}"


@dataclass(frozen=True, slots=True)
class Campaign:
    """What to run."""

    study: Study
    runs: int
    fresh: bool = False
    """Forget what is in the journal."""

    @property
    def spec(self) -> ControllerSpec:
        """The controller."""
        return self.study.specs[0]

    @property
    def tasks(self) -> tuple[CampaignTask, ...]:
        """Runs without failure first."""
        first = self.study.seeds[0]
        days = range(first, first + min(SEEDS, self.runs))
        return tuple(CampaignTask(BASELINE, seed) for seed in days) + tuple(
            CampaignTask(number, first + number % SEEDS) for number in range(self.runs)
        )

    @property
    def settings(self) -> dict[str, Any]:
        """What a journal must agree in to be continued."""
        scenario, spec = self.study.scenario, self.spec
        return {
            "version": VERSION,
            "scenario": scenario.name,
            "scenario_sha256": scenario.digest,
            "seed": self.study.seeds[0],
            "controller": spec.name,
            "options": registry.options_of(spec),
            "step_s": self.study.step_s,
            "versions": {name: version(name) for name in VERSIONED},
            "sources_sha256": sources_sha256(),
        }


class CampaignResult(NamedTuple):
    """What is finished."""

    tables: FaultTables
    unsafe: list[str]
    """Sentences about what was unsafe, run by run."""
    interrupted: bool
    failures: list[str]
    """Sentences about runs that failed; the same command tries them again."""


def run_campaign(
    campaign: Campaign, out: Path, progress: Progress = lambda *_: None
) -> CampaignResult:
    """
    Run a campaign, or what is missing of it, and write its tables.

    Parameters
    ----------
    campaign
        What to run.
    out
        Folder that will hold the results folder, named as the scenario with ``_faults``.
    progress
        Called when a run is finished.

    Returns
    -------
    CampaignResult
        What is finished, even if the user interrupts.

    Raises
    ------
    StudyError
        If there is not exactly one controller, it is no control map, or there is a journal of
        another campaign.
    FileExistsError
        If something else stands where the results would go.
    HeldError
        If another command writes there.
    """
    if len(campaign.study.specs) != 1 or campaign.spec.protection != CAMPAIGN_PROTECTION:
        chosen = ", ".join(spec.name for spec in campaign.study.specs)
        msg = f"--controller: {chosen}; allowed: one with the protection {CAMPAIGN_PROTECTION}"
        raise StudyError(msg)
    folder = out / f"{campaign.study.scenario.name}_faults"
    refuse_foreign(folder, (JOURNAL,))
    with held(folder) as work:
        return _run(campaign, folder, work, progress)


def _run(campaign: Campaign, folder: Path, work: Path, progress: Progress) -> CampaignResult:
    started = time.perf_counter()
    journal = Journal(folder / JOURNAL, campaign)
    failed: dict[CampaignTask, Failure] = {}
    interrupted = False
    missing = journal.missing(campaign.tasks)
    answers = performed(partial(_perform, campaign), missing, campaign.study.jobs, folder=work)
    try:
        with closing(answers):
            for done in answers:
                if done.result is not None:
                    with interrupts.undisturbed():
                        journal.add(done.result)
                elif done.failure is not None:
                    failed[done.task] = done.failure
                progress(len(journal.done) + len(failed), len(campaign.tasks))
    except KeyboardInterrupt:
        interrupts.answered()
        interrupted = True
        if not journal.done:
            # Earlier results, if there are any, stay as they are.
            raise
    failed_runs.clear(folder)
    sentences = [
        failed_runs.noted_sentence(folder, task.file_name, f"{task}: {failure.sentence}", failure)
        for task, failure in failed.items()
    ]
    rows = journal.rows(campaign.tasks)
    result = StudyResult(folder, interrupted=interrupted)
    told = provenance_of(campaign.study, result, time.perf_counter() - started)
    told = {**told, "finished_runs": len(rows), "failed": sentences}
    tables = publish_faults(folder, rows, told)
    unsafe = [
        f"run {row['run']} ({row['variant']} of {row['unit']}): {row['first_event']}"
        for row in rows
        if row["unsafe_events"]
    ]
    return CampaignResult(tables, unsafe, interrupted, sentences)


class Journal:
    """What is finished of a campaign: a line of JSON each, the first one its settings."""

    def __init__(self, file: Path, campaign: Campaign) -> None:
        self._file = file
        self.done: dict[CampaignTask, Finding] = {}
        settings = campaign.settings
        lines = [] if campaign.fresh or not file.exists() else file.read_bytes().splitlines(True)
        # Who was killed while writing has left half a line.
        whole = [line for line in lines if line.endswith(b"\n")]
        if whole:
            told = [self._read(line, number) for number, line in enumerate(whole, start=1)]
            self._check(told[0], settings)
            tasks = set(campaign.tasks)
            known = {
                CampaignTask(finding["number"], finding["seed"]): finding for finding in told[1:]
            }
            self.done = {task: finding for task, finding in known.items() if task in tasks}
        else:
            whole = [_line(settings)]
        self._begun = b"".join(whole)
        """What the file must hold before anything is added; earlier runs stay until then."""

    def _read(self, line: bytes, number: int) -> Finding:
        with suppress(ValueError):
            found = json.loads(line)
            if isinstance(found, dict) and (number == 1 or {"number", "seed"} <= found.keys()):
                return found
        msg = f"{self._file}, line {number}: damaged; allowed: --fresh, to start anew"
        raise StudyError(msg)

    def _check(self, found: Mapping[str, Any], settings: Mapping[str, Any]) -> None:
        if found == settings:
            return
        other = ", ".join(key for key in settings if found.get(key) != settings[key])
        msg = f"{self._file}: of another campaign ({other}); allowed: --fresh, to start anew"
        raise StudyError(msg)

    def missing(self, tasks: Sequence[CampaignTask]) -> tuple[CampaignTask, ...]:
        """
        Return what is not finished.

        Parameters
        ----------
        tasks
            What is to be.

        Returns
        -------
        tuple[CampaignTask, ...]
            In the same order.
        """
        return tuple(task for task in tasks if task not in self.done)

    def add(self, finding: Finding) -> None:
        """
        Take note of a finished run.

        Parameters
        ----------
        finding
            What was found out.
        """
        if self._begun:
            write_whole(self._file, self._begun)
            self._begun = b""
        with self._file.open("ab") as file:
            file.write(_line(finding))
            file.flush()
            os.fsync(file.fileno())
        self.done[CampaignTask(finding["number"], finding["seed"])] = finding

    def rows(self, tasks: Sequence[CampaignTask]) -> list[dict[str, Any]]:
        """
        Return the finished runs with a failure, against those without.

        Parameters
        ----------
        tasks
            What is to be run.

        Returns
        -------
        list[dict[str, Any]]
            Rows of the table ``fault_runs``.
        """
        return [
            _row(self.done[task], self.done[baseline])
            for task in tasks
            if task.number != BASELINE
            and task in self.done
            and (baseline := CampaignTask(BASELINE, task.seed)) in self.done
        ]


def _line(values: Mapping[str, Any]) -> bytes:
    return json.dumps(values).encode() + b"\n"


def _row(finding: Finding, usual: Finding) -> dict[str, Any]:
    after_s = finding["detected_after_s"]
    return {
        **{key: finding[key] for key in ("kind", "variant", "unit", "onset_s", "duration_s")},
        "run": finding["number"],
        "seed": finding["seed"],
        "size": finding["size"],
        "detection": finding["detection"],
        "detected_after_s": np.nan if after_s is None else after_s,
        "reaction": ", ".join(finding["reactions"]) or "none",
        "trains_braked": len(set(finding["braked"]) - set(usual["braked"])),
        "trains_stopped": len(set(finding["stopped"]) - set(usual["stopped"])),
        "delay_caused_s": finding["delay_s"] - usual["delay_s"],
        "unsafe_events": finding["unsafe_events"],
        "first_event": finding["first_event"],
    }


def _perform(campaign: Campaign, task: CampaignTask, _: Callable[[float], None]) -> Finding:
    study, spec = campaign.study, campaign.spec
    world = world_of(study.scenario, study.step_s)
    failure = None
    if task.number != BASELINE:
        failure = draw_failure(world, study.seeds[0], task.number)
    witness = Witness(failure)

    def wrap(name: str, layer: Any) -> Any:  # noqa: ANN401 - any layer
        if name != "protection":
            return layer
        if failure is not None and failure.kind is FailureMode.MAP:
            options: dict[str, Any] = dict(spec.protection_options)
            layer = WrongMaps(world, ControlMapOptions(**options), study.scenario.radio, failure)
        return witness.watching(layer)

    unit_failures = () if failure is None else (failure,)
    record = run_once(
        study.scenario, spec, task.seed, study.step_s, wrap=wrap, unit_failures=unit_failures
    )
    return {**task._asdict(), **_measured(record), **(_about(failure, record, witness))}


class Witness:
    """Stands before a protection and remembers what it knew."""

    def __init__(self, failure: UnitFailure | None) -> None:
        self.last: Memory | None = None
        self.widened: set[int] = set()
        """Rows of the trains whose bands were longer than usual since the failure."""
        self._from_s = np.inf if failure is None else failure.from_s
        self._protection: Any = None

    def watching(self, protection: Any) -> "Witness":  # noqa: ANN401 - a control map
        """
        Return itself in front of a protection.

        Parameters
        ----------
        protection
            A control map.

        Returns
        -------
        Witness
            Can be asked in its stead.
        """
        self._protection = protection
        return self

    def initial(self) -> Memory:
        """Return the memory before the first step."""
        memory: Memory = self._protection.initial()
        return memory

    def authorise(self, state: LineState, memory: Memory) -> tuple[Authority, Memory]:
        """
        Return the authority of every train.

        Parameters
        ----------
        state
            The line.
        memory
            From the step before.

        Returns
        -------
        tuple[Authority, Memory]
            The protection's.
        """
        authority, self.last = self._protection.authorise(state, memory)
        widened_m = self.last.aboard.widened_m
        if state.time_s >= self._from_s and widened_m.any():
            self.widened.update(np.flatnonzero(widened_m).tolist())
        return authority, self.last


def _measured(record: RunRecord) -> Finding:
    """Return what is found out about any run."""
    world, trains = record.world, record.world.timetable.trains
    booked_s = world.booked_arrival_s[:, 1:-1]
    late_s = delay_s(record.arrival_s[:, 1:], booked_s, record.end_s)
    long = record.standstills.duration_s >= STOP_S
    samples = record.trajectory
    braked = (samples.reason == Reason.EMERGENCY) & (samples.speed_mps > 0.0)
    events = record.violations
    return {
        "delay_s": float(np.nanmean(late_s)),
        "stopped": sorted({trains[row] for row in record.standstills.row[long].tolist()}),
        "braked": sorted({trains[row] for row in samples.row[braked].tolist()}),
        "unsafe_events": len(events),
        "first_event": events[0].message if events else "",
    }


def _about(failure: UnitFailure | None, record: RunRecord, witness: Witness) -> Finding:
    """Return what became of a failure."""
    if failure is None or witness.last is None:
        return {}
    detection, found_s = _detected(failure, record, witness.last)
    return {
        "kind": failure.kind.value,
        "variant": failure.variant.value,
        "unit": failure.unit,
        "onset_s": failure.from_s,
        "duration_s": failure.duration_s,
        "size": failure.size,
        "detection": detection,
        "detected_after_s": None if found_s is None else found_s - failure.from_s,
        "reactions": _reactions(failure, record, witness),
    }


def _detected(failure: UnitFailure, record: RunRecord, memory: Memory) -> tuple[str, float | None]:
    """Return what found a failure, and when. [s]"""
    if failure.variant not in FINDERS:
        found_s = [
            item.established_s
            for item in record.obstructions
            if item.id == f"{failure.unit}: {failure.variant.value}"
        ]
        return ("the equipment itself", found_s[0]) if found_s else ("", None)
    rows = {CENTRE_ROW}
    trains = record.world.timetable.trains
    if failure.unit in trains:
        rows.add(trains.index(failure.unit))
    for alarm in memory.aboard.alarms:
        about = alarm.row in rows or failure.variant is Variant.CENTRE_SILENT
        if about and alarm.notice in FINDERS[failure.variant] and alarm.time_s >= failure.from_s:
            return alarm.notice.value, alarm.time_s
    return "", None


def _reactions(failure: UnitFailure, record: RunRecord, witness: Witness) -> list[str]:
    """Return what was done about a failure, in the words of the source's table 3."""
    memory, samples = witness.last, record.trajectory
    if memory is None:
        return []
    trains = record.world.timetable.trains
    about = {trains.index(failure.unit)} if failure.unit in trains else set(range(len(trains)))
    notices = {
        alarm.notice
        for alarm in memory.aboard.alarms
        if alarm.time_s >= failure.from_s and alarm.row in about | {CENTRE_ROW}
    }
    during = (samples.time_s >= failure.from_s) & (samples.time_s < failure.until_s + AFTER_S)
    braked = during & (samples.reason == Reason.EMERGENCY) & (samples.speed_mps > 0.0)
    braked &= np.isin(samples.row, list(about))
    done = {
        "obstruction set": failure.variant in {Variant.STATE, Variant.EQUIPMENT},
        "band widened": bool(witness.widened & about)
        or (failure.unit in trains and Notice.NO_REPORT in notices),
        "nothing sent": bool(notices & {Notice.EXCLUSION, Notice.CENTRE_CLOCK}),
        "emergency brake": bool(braked.any()),
        "position corrected": Notice.BALISE in notices,
    }
    return [name for name, was_done in done.items() if was_done]
