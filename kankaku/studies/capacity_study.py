"""
Capacity: how close trains can follow each other under each controller of a scenario.

Headways and blocking times follow from what a protection foresees; two trains on SUMO check
them. ``run.py capacity`` gives this a command line.
"""

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

from kankaku.analysis.publish.capacity_publishing import (
    CAPACITY_RESULTS,
    CapacityTables,
    publish_capacity,
)
from kankaku.analysis.results import refuse_foreign
from kankaku.analysis.tables.capacity_tables import (
    CapacityAssessment,
    Occupation,
    Stretches,
    percent_of,
)
from kankaku.asking import Check
from kankaku.controllers import registry
from kankaku.railway.arrays import FloatArray
from kankaku.railway.capacity.blocking_time import Headway, blocking_times_s, technical_headways
from kankaku.railway.capacity.compression import least_shifts_s, occupation_s
from kankaku.railway.capacity.permitted import permitted_profile
from kankaku.railway.motion.journey import Journey, booked_journey, technical_journey
from kankaku.railway.plan.pattern import PeakPattern, busiest_hour, peak_pattern
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.railway.plan.timetable import Service, Timetable
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Controller, Foresight, exclusive_pieces
from kankaku.store import failed_runs
from kankaku.store.holding import held
from kankaku.studies.provenance import provenance_of
from kankaku.studies.registered_layers import Registered, registered
from kankaku.studies.study import Study, StudyError, StudyResult, foresight_of, world_of
from kankaku.studies.two_trains import simulated_headway_s
from kankaku.workers import Done, Failure, attempt, performed

GRID_M = 50.0
"""Length of a stretch of line where there are no blocks. [m]"""


class ByTheory(NamedTuple):
    """Task: blocking times and compression under one controller."""

    controller: str


class TwoTrains(NamedTuple):
    """Task: headways under one controller by simulation."""

    controller: str
    by_theory_s: tuple[float, ...]
    """Headways by blocking times. [s]"""
    call: int | None
    """The headway into this call; without one, into the most critical calls of all."""


Task: TypeAlias = ByTheory | TwoTrains
Progress: TypeAlias = Callable[[int, int], None]
"""Called with the number of finished tasks, and of all."""
Failures: TypeAlias = dict[str, Failure]
"""Why something is missing, by controller."""


class Assessed(NamedTuple):
    """What is found out about the controllers of a study, and about which of them nothing is."""

    assessments: tuple[CapacityAssessment, ...]
    failures: Failures


class CapacityResult(NamedTuple):
    """What is written."""

    folder: Path
    tables: CapacityTables | None
    """None if every controller failed."""
    failures: list[str]
    """A sentence each."""


def assess_capacity(
    study: Study,
    check: Check = Check.CRITICAL,
    progress: Progress = lambda *_: None,
    work: Path | None = None,
) -> Assessed:
    """
    Return what is found out about every controller of a study but peers.

    Parameters
    ----------
    study
        Scenario, controllers, step and processes; its seeds play no part.
    check
        Which headways to check by simulation.
    progress
        Called when a task is finished.
    work
        Where temporary files are kept; the system's place if None.

    Returns
    -------
    Assessed
        In the order of the controllers. One that fails takes no other with it; whose simulation
        fails is assessed by theory alone.

    Raises
    ------
    StudyError
        If the line is a network, there are only peers, or no train calls twice.
    ControllerError
        If a controller cannot be built.
    """
    if study.scenario.line.network:
        msg = f"{study.scenario.name}: a network; allowed: a chain, a line without nodes.csv"
        raise StudyError(msg)
    row = pattern_of_peak(study.scenario.timetable).row
    # A peer does not say beforehand what it will permit.
    specs = [spec for spec in study.specs if spec.peer is None]
    if not specs:
        msg = "--controller: nothing but peers; allowed: controllers with a protection"
        raise StudyError(msg)
    foreseen = {spec.name: _foreseen(study, spec) for spec in specs}
    first_alike = _first_alike(specs)
    kinds = {name: foreseen[name] for name in dict.fromkeys(first_alike.values())}
    headways, failed = _headways(kinds, row)
    by_theory_s = {
        name: tuple(headway.headway_s for headway in headways[alike])
        for name, alike in first_alike.items()
        if alike in headways
    }
    tasks: list[Task] = [*map(ByTheory, headways), *_checks(check, by_theory_s)]
    simulated_s = {name: np.full(len(known_s), np.nan) for name, known_s in by_theory_s.items()}
    answers = performed(
        partial(_perform, study, registered(study.specs)), tasks, study.jobs, folder=work
    )
    theory = _gathered(answers, simulated_s, failed, lambda done: progress(done, len(tasks)))
    for name, alike in first_alike.items():
        if alike in failed and alike not in theory:
            failed[name] = failed[alike]
    assessments = (
        replace(theory[alike], controller=name, simulated_s=simulated_s[name])
        for name, alike in first_alike.items()
        if alike in theory
    )
    return Assessed(tuple(assessments), failed)


def _gathered(
    answers: Iterable[Done[Task, CapacityAssessment | FloatArray]],
    simulated_s: dict[str, FloatArray],
    failed: dict[str, Failure],
    tell: Callable[[int], None],
) -> dict[str, CapacityAssessment]:
    """Return what theory says; put beside it what was simulated, and what failed."""
    theory: dict[str, CapacityAssessment] = {}
    for finished, done in enumerate(answers, start=1):
        name, answer = done.task.controller, done.result
        if isinstance(answer, CapacityAssessment):
            theory[name] = answer
        elif answer is not None:
            simulated_s[name] = np.where(np.isnan(answer), simulated_s[name], answer)
        elif done.failure is not None:
            failed[name] = done.failure
        tell(finished)
    return theory


def _foreseen(study: Study, spec: ControllerSpec) -> tuple[World, Foresight]:
    """Return a controller's own world, and what its protection says in it beforehand."""
    world = world_of(study.scenario, study.step_s).driven_as(spec.driving)
    return world, foresight_of(registry.build(spec, world, study.scenario.radio))


def _headways(
    kinds: Mapping[str, tuple[World, Foresight]], row: int
) -> tuple[dict[str, tuple[Headway, ...]], Failures]:
    found: dict[str, tuple[Headway, ...]] = {}
    failed: Failures = {}
    for name, (world, foresight) in kinds.items():
        technical, failure = attempt(partial(_technical, world, foresight, row))
        if technical is not None:
            found[name] = technical[1]
        elif failure is not None:
            failed[name] = failure
    return found, failed


def _checks(check: Check, by_theory_s: Mapping[str, tuple[float, ...]]) -> Iterator[TwoTrains]:
    for name, known_s in by_theory_s.items():
        if check is Check.CRITICAL:
            yield TwoTrains(name, known_s, None)
        if check is Check.ALL:
            yield from (TwoTrains(name, known_s, call) for call in range(1, len(known_s) + 1))


def pattern_of_peak(timetable: Timetable) -> PeakPattern:
    """
    Return the pattern that both trains of a headway have.

    Parameters
    ----------
    timetable
        The timetable.

    Returns
    -------
    PeakPattern
        The most frequent one of the busiest hour.

    Raises
    ------
    StudyError
        If no train calls twice.
    """
    found = peak_pattern(timetable)
    if found is None:
        msg = "calls.csv: no train calls at two stations; allowed: a train that does"
        raise StudyError(msg)
    return found


def _first_alike(specs: Sequence[ControllerSpec]) -> dict[str, str]:
    """Return for each controller the first one with the same protection and driving."""
    kinds = {spec.name: registry.options_of(spec)["protection"] for spec in specs}
    by_name = {
        spec.name: (spec.protection, spec.radio, spec.driving, kinds[spec.name]) for spec in specs
    }
    names = list(by_name)
    return {
        name: next(other for other in names if by_name[other] == by_name[name]) for name in names
    }


def _technical(world: World, foresight: Foresight, row: int) -> tuple[Journey, tuple[Headway, ...]]:
    journey = technical_journey(world, permitted_profile(world, foresight, row), row)
    return journey, technical_headways(world, foresight, journey)


def _perform(
    study: Study, layers: Registered, task: Task, _: Callable[[float], None]
) -> CapacityAssessment | FloatArray:
    layers.restore()
    spec = next(spec for spec in study.specs if spec.name == task.controller)
    if isinstance(task, TwoTrains):
        return _simulated_s(study, spec, task)
    return assess_by_theory(study, spec)


def _simulated_s(study: Study, spec: ControllerSpec, task: TwoTrains) -> FloatArray:
    """Return headways as simulated; not a number where they need not be known. [s]"""
    row = pattern_of_peak(study.scenario.timetable).row
    by_theory_s = np.array(task.by_theory_s)
    simulated_s = np.full(by_theory_s.size, np.nan)
    call = task.call or 1 + int(by_theory_s.argmax())
    while np.isnan(simulated_s[call - 1]):
        guess_s = task.by_theory_s[call - 1]
        simulated_s[call - 1] = simulated_headway_s(study, spec, (row, call), guess_s)
        if task.call is None:
            # What is simulated may be shorter, and another station be the critical one.
            known_s = np.where(np.isnan(simulated_s), by_theory_s, simulated_s)
            call = 1 + int(known_s.argmax())
    return simulated_s


def assess_by_theory(study: Study, spec: ControllerSpec) -> CapacityAssessment:
    """
    Return what blocking-time theory says about a controller.

    Parameters
    ----------
    study
        Scenario and step.
    spec
        The controller, no peer.

    Returns
    -------
    CapacityAssessment
        Nothing in it is simulated.
    """
    world = world_of(study.scenario, study.step_s).driven_as(spec.driving)
    controller = registry.build(spec, world, study.scenario.radio)
    pattern = pattern_of_peak(study.scenario.timetable)
    row, service = pattern.row, study.scenario.timetable.services[pattern.row]
    foresight = foresight_of(controller)
    journey, headways = _technical(world, foresight, row)
    stretches = _stretches(controller, world, service)
    begin_s, end_s = blocking_times_s(world, foresight, journey, stretches.edges_m)
    return CapacityAssessment(
        controller=spec.name,
        protection=spec.protection,
        service=service,
        pattern=pattern,
        journey=journey,
        headways=headways,
        stretches=stretches,
        begin_s=begin_s,
        end_s=end_s,
        occupation=_occupation(world, foresight),
        simulated_s=np.full(len(headways), np.nan),
    )


def _stretches(controller: Controller, world: World, service: Service) -> Stretches:
    """Return what a train keeps: blocks, circuits, or with a moving block an even grid."""
    line = world.line
    pieces = exclusive_pieces(line, controller.separation)
    own = [piece for track in service.route for piece in pieces if piece.track == track]
    if own:
        edges_m = [*(piece.start_m for piece in own), own[-1].end_m]
        return Stretches(tuple(piece.id for piece in own), np.array(edges_m))
    places_m = np.append(np.arange(line.start_m, line.end_m, GRID_M), line.end_m)
    names = [f"km {place_m / 1000.0:.3f}" for place_m in places_m[:-1].tolist()]
    return Stretches(tuple(names), places_m)


def _occupation(world: World, foresight: Foresight) -> Occupation | None:
    rows = range(world.size)
    journeys = [
        booked_journey(world, permitted_profile(world, foresight, row), row) for row in rows
    ]
    if len(rows) < 2:
        return None
    least_s = least_shifts_s(world, foresight, journeys)
    compressed_s, booked_s = occupation_s(journeys, rows, least_s)
    hour = busiest_hour(world.timetable)
    peak = hour.rows if hour else ()
    if len(peak) < 2:
        return Occupation(booked_s, compressed_s, np.nan)
    peak_compressed_s, peak_booked_s = occupation_s(journeys, peak, least_s)
    return Occupation(booked_s, compressed_s, percent_of(peak_compressed_s, peak_booked_s))


def run_capacity(
    study: Study, out: Path, check: Check = Check.CRITICAL, progress: Progress = lambda *_: None
) -> CapacityResult:
    """
    Assess the capacity of a scenario and write it.

    Parameters
    ----------
    study
        Scenario, controllers, step and processes.
    out
        Folder that will hold the results folder, named as the scenario with ``_capacity``.
    check
        Which headways to check by simulation.
    progress
        Called when a task is finished.

    Returns
    -------
    CapacityResult
        What was written, and where.

    Raises
    ------
    FileExistsError
        If something else stands where the results would go.
    HeldError
        If another command writes there.
    """
    folder = out / f"{study.scenario.name}_capacity"
    refuse_foreign(folder, CAPACITY_RESULTS.marks)
    started = time.perf_counter()
    with held(folder) as work:
        assessments, failed = assess_capacity(study, check, progress, work)
        told = provenance_of(study, StudyResult(folder), time.perf_counter() - started)
        failed_runs.clear(folder)
        sentences = [
            failed_runs.noted_sentence(folder, name, f"{name}: {failure.sentence}", failure)
            for name, failure in failed.items()
        ]
        if not assessments:
            return CapacityResult(folder, None, sentences)
        told = {**told, "check": check.value, "failed": sentences}
        tables = publish_capacity(folder, study.scenario, assessments, told)
        return CapacityResult(folder, tables, sentences)
