"""The result file of the benchmark: what it holds, and whether that hangs together."""

import hashlib
import json
import random
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from kankaku.analysis.tables.columns import json_text
from kankaku.railway.errors import KankakuError
from kankaku.studies.benchmark_score import scores
from kankaku.studies.benchmark_suites import (
    REFERENCE,
    STEP_S,
    VERSION,
    BenchmarkPlan,
    BenchmarkTask,
    tasks_of,
)

SEAL = "sha256"
KIND = "kankaku benchmark"
FIGURES: Mapping[str, type] = {
    "trains": int,
    "trains_completed": int,
    "interstation_stop_time_s": float,
    "mean_arrival_lateness_s": float,
    "energy_net_kwh": float,
    "violations": int,
    "train_steps": int,
    "tables_sha256": str,
    "failure": str,
}
"""What of a run everybody who repeats it finds again."""
TASK: Mapping[str, type] = {"controller": str, "suite": str, "world": str, "seed": int}
RUN: Mapping[str, type] = {**TASK, **FIGURES, "processor_s": float}
PARTS: Mapping[str, type] = {
    "benchmark": str,
    "version": int,
    "plan": dict,
    "provenance": dict,
    "contract": dict,
    "runs": list,
    "scores": dict,
    SEAL: str,
}


class BenchmarkFileError(KankakuError):
    """A result file that cannot be believed."""

    verdict = "is not verified"

    def __init__(self, file: Path, mistakes: Sequence[str]) -> None:
        super().__init__(str(file), "; ".join(mistakes))
        self._sentences = tuple(f"{file}: {mistake}" for mistake in mistakes)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Everything that is wrong, a sentence each."""
        return self._sentences


def seal_of(told: Mapping[str, Any]) -> str:
    """
    Return the digest of all that a result file holds but the digest itself.

    Parameters
    ----------
    told
        What it holds.

    Returns
    -------
    str
        Whoever changes a figure with an editor changes it.
    """
    others = {key: value for key, value in told.items() if key != SEAL}
    return hashlib.sha256(json.dumps(others, sort_keys=True).encode()).hexdigest()


def result_told(
    plan: BenchmarkPlan,
    provenance: Mapping[str, Any],
    contract: Mapping[str, Sequence[str]],
    runs: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """
    Return what a result file holds.

    Parameters
    ----------
    plan
        What was run of the benchmark.
    provenance
        Versions and digests.
    contract
        What of the contract each controller breaks.
    runs
        All runs.

    Returns
    -------
    dict[str, Any]
        With scores and seal.
    """
    found = scores(runs, contract)
    told = {
        "benchmark": KIND,
        "version": VERSION,
        "plan": {
            "suites": list(plan.suites),
            "worlds": list(plan.worlds),
            "seeds": list(plan.seeds),
            "step_s": STEP_S,
            "whole": plan.is_whole,
        },
        "provenance": dict(provenance),
        "contract": {name: list(problems) for name, problems in contract.items()},
        "runs": [dict(run) for run in runs],
        "scores": {name: score.told() for name, score in found.items()},
    }
    # As a reader of the file has it.
    told = json.loads(json.dumps(told))
    return {**told, SEAL: seal_of(told)}


def read_result(file: Path) -> dict[str, Any]:
    """
    Read a result file that hangs together.

    Parameters
    ----------
    file
        The file.

    Returns
    -------
    dict[str, Any]
        What it holds.

    Raises
    ------
    BenchmarkFileError
        With all that is wrong: it is no such file, was changed after it was written, lacks runs,
        or has other scores than its runs give.
    """
    try:
        told = json.loads(file.read_text("utf-8"))
    except OSError as error:
        raise BenchmarkFileError(file, [f"cannot be read: {error.strerror or error}"]) from error
    except (ValueError, RecursionError) as error:
        raise BenchmarkFileError(file, [f"is no JSON: {error}"]) from error
    mistakes = _malformed(told)
    if not mistakes:
        mistakes = _inconsistent(told)
    if mistakes:
        raise BenchmarkFileError(file, mistakes)
    found: dict[str, Any] = told
    return found


def write_result(file: Path, told: Mapping[str, Any]) -> None:
    """
    Write a result file.

    Parameters
    ----------
    file
        Where.
    told
        What :func:`result_told` returned.
    """
    file.write_text(json_text(told), encoding="utf-8")


def _malformed(told: object) -> list[str]:
    if not isinstance(told, dict) or told.get("benchmark") != KIND:
        return [f"is no result of {KIND}"]
    mistakes = _wrong_types(told, PARTS, "")
    if mistakes:
        return mistakes
    if told["version"] != VERSION:
        return [f"version {told['version']} of the benchmark; allowed: {VERSION}"]
    mistakes += [
        f"plan.{key} is no list of {kind.__name__}"
        for key, kind in (("suites", str), ("worlds", str), ("seeds", int))
        if not _is_list_of(told["plan"].get(key), kind)
    ]
    for number, run in enumerate(told["runs"]):
        if not isinstance(run, dict):
            mistakes.append(f"runs[{number}] is no run")
        else:
            mistakes += _wrong_types(run, RUN, f"runs[{number}].")
    mistakes += [
        f"contract.{name} is no list of texts"
        for name, problems in told["contract"].items()
        if not _is_list_of(problems, str) and problems != []
    ]
    return mistakes


def _is_list_of(value: object, kind: type) -> bool:
    return isinstance(value, list) and bool(value) and all(type(part) is kind for part in value)


def _wrong_types(told: Mapping[str, Any], wanted: Mapping[str, type], where: str) -> list[str]:
    mistakes = []
    for key, kind in wanted.items():
        value = told.get(key)
        kinds = (int, float) if kind is float else kind
        if not isinstance(value, kinds) or (isinstance(value, bool) and kind is not bool):
            mistakes.append(f"{where}{key} is missing or is no {kind.__name__}")
        elif isinstance(value, float) and not abs(value) < float("inf"):
            mistakes.append(f"{where}{key} is not finite")
        elif key in {"trains", "train_steps"} and isinstance(value, int) and value < 0:
            mistakes.append(f"{where}{key} is negative")
    return mistakes


def plan_of(told: Mapping[str, Any]) -> BenchmarkPlan:
    """
    Return what was run of the benchmark.

    Parameters
    ----------
    told
        What a result file holds.

    Returns
    -------
    BenchmarkPlan
        Its suites, worlds and seeds.
    """
    plan = told["plan"]
    return BenchmarkPlan(*(tuple(plan.get(key, ())) for key in BenchmarkPlan._fields))


def _inconsistent(told: Mapping[str, Any]) -> list[str]:
    mistakes = []
    if told[SEAL] != seal_of(told):
        mistakes.append("was changed after it was written: its seal is of other contents")
    plan = plan_of(told)
    known = BenchmarkPlan()
    unknown = [
        str(part) for parts, of in zip(plan, known, strict=True) for part in parts if part not in of
    ]
    if unknown or told["plan"].get("step_s") != STEP_S:
        said = ", ".join(unknown) or "step_s"
        return [*mistakes, f"plan: {said} is not of version {VERSION} of the benchmark"]
    if told["plan"].get("whole") != plan.is_whole:
        mistakes.append("plan: says that it is the whole benchmark, and is not, or the reverse")
    names = tuple(dict.fromkeys(run["controller"] for run in told["runs"]))
    wanted = tasks_of(names, plan)
    there = [BenchmarkTask(*(run[key] for key in TASK)) for run in told["runs"]]
    if REFERENCE not in names or sorted(wanted) != sorted(there):
        return [*mistakes, "runs: some of the plan are missing, or there twice"]
    unchecked = [name for name in names if name not in told["contract"]]
    mistakes += [f"contract: nothing is said of {name}" for name in unchecked]
    try:
        found = scores(told["runs"], told["contract"])
    except (ArithmeticError, ValueError):
        return [*mistakes, "runs: figures that no run can have"]
    again = json.loads(json.dumps({name: score.told() for name, score in found.items()}))
    mistakes += [
        f"scores: that of {name} is not what its runs give"
        for name in {**again, **told["scores"]}
        if again.get(name) != told["scores"].get(name)
    ]
    return mistakes


def sample_of(told: Mapping[str, Any], size: int, drawn_by: int) -> list[Mapping[str, Any]]:
    """
    Return some of the runs of a result file, all alike likely.

    Parameters
    ----------
    told
        What it holds.
    size
        How many; all if there are no more.
    drawn_by
        Seed of the draw: nobody who makes a file knows it.

    Returns
    -------
    list[Mapping[str, Any]]
        Runs as the file tells them.
    """
    runs: list[Mapping[str, Any]] = list(told["runs"])
    chosen = random.Random(drawn_by)  # noqa: S311 - can be repeated by who is told the seed
    return chosen.sample(runs, min(size, len(runs)))


def differences(said: Mapping[str, Any], found: Mapping[str, Any]) -> list[str]:
    """
    Return where a repeated run has other figures than the file says.

    Parameters
    ----------
    said
        The run of the file.
    found
        The same run, repeated.

    Returns
    -------
    list[str]
        A sentence for each; computing time is another one on every machine.
    """
    return [
        f"{key} is {said[key]} in the file, and {found[key]} when it is repeated"
        for key in FIGURES
        if said[key] != found[key]
    ]
