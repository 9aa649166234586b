"""
Campaign of failures: the failure modes of a control map, one by one and a thousand times.

Every run has one failure of one unit; it is compared with a run of the same seed without any.
``kankaku campaign`` gives this a command line.
"""

import time
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from kankaku import interrupts
from kankaku.analysis.publish.campaign_publishing import CampaignTables, publish_campaign
from kankaku.analysis.results import refuse_foreign
from kankaku.asking import CAMPAIGN_PROTECTION
from kankaku.controllers.control_map.map_protection import ControlMapOptions
from kankaku.controllers.control_map.wrong_maps import WrongMaps
from kankaku.railway.failures.random_failures import draw_failure
from kankaku.railway.failures.unit_failures import FailureMode
from kankaku.store import failed_runs
from kankaku.store.holding import held
from kankaku.studies.campaign_journal import BASELINE, JOURNAL, Campaign, CampaignTask, Journal
from kankaku.studies.failure_findings import Finding, Witness, finding_about, measured
from kankaku.studies.provenance import provenance_of
from kankaku.studies.study import StudyError, StudyResult, run_once, world_of
from kankaku.workers import Failure, performed

Progress: TypeAlias = Callable[[int, int], None]
"""Called with the number of finished runs, and of all."""


class CampaignResult(NamedTuple):
    """What is finished."""

    tables: CampaignTables
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
    tables = publish_campaign(folder, rows, told)
    unsafe = [
        f"run {row['run']} ({row['variant']} of {row['unit']}): {row['first_event']}"
        for row in rows
        if row["unsafe_events"]
    ]
    return CampaignResult(tables, unsafe, interrupted, sentences)


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
    return {**task._asdict(), **measured(record), **(finding_about(failure, record, witness))}
