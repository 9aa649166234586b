"""The journal of a campaign: every finished run, so that a campaign can go on."""

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kankaku.analysis.tables.columns import write_whole
from kankaku.controllers import registry
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.store.fingerprint import sources_sha256
from kankaku.store.json_lines import append_line, json_line, whole_lines
from kankaku.store.run_store import VERSIONED
from kankaku.studies.failure_findings import Finding
from kankaku.studies.study import Study, StudyError

VERSION = 3
"""Of what a run of the campaign is; runs of another one are not continued."""


SEEDS = 20
"""Days that the failures are spread over. [-]"""


BASELINE = -1


JOURNAL = "journal.jsonl"


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


class Journal:
    """What is finished of a campaign: a line of JSON each, the first one its settings."""

    def __init__(self, file: Path, campaign: Campaign) -> None:
        self._file = file
        self.done: dict[CampaignTask, Finding] = {}
        settings = campaign.settings
        whole = [] if campaign.fresh else whole_lines(file)
        if whole:
            told = [self._read(line, number) for number, line in enumerate(whole, start=1)]
            self._check(told[0], settings)
            tasks = set(campaign.tasks)
            known = {
                CampaignTask(finding["number"], finding["seed"]): finding for finding in told[1:]
            }
            self.done = {task: finding for task, finding in known.items() if task in tasks}
        else:
            whole = [json_line(settings)]
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
        append_line(self._file, finding)
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
