"""The contract of protections, operations and supervisions: what is checked, and of whom."""

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from kankaku.controllers import registry
from kankaku.controllers.choosing import by_layers
from kankaku.railway.errors import sentence_of
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Separation
from kankaku.testing.alike import same
from kankaku.testing.asked_twice import TIMELY, Answered
from kankaku.testing.example_lines import world_of
from kankaku.testing.trials import (
    LINES,
    OVERSTAYS_S,
    WORLD,
    Candidate,
    Trial,
    overstays,
    trial_of,
    trials_of,
)

CLOSE_M = 1e-9


class Finding(NamedTuple):
    """What came of a check."""

    check: str
    problem: str = ""
    """Empty if the check is passed."""


def _noted(check: str) -> Callable[[Trial], str]:
    return lambda trial: trial.asked.problems.get(check, "")


def runs_through(trial: Trial) -> str:
    """Return why a run did not come to its end with every train where it was to go."""
    if trial.record is None or trial.record.failure:
        return trial.error or (trial.record.failure if trial.record else "")
    if not trial.record.completed.all():
        return f"{int((~trial.record.completed).sum())} trains never arrive"
    return ""


def is_safe(trial: Trial) -> str:
    """Return which rule of safety a run broke."""
    if trial.record is not None and trial.record.violations:
        return str(trial.record.violations[0].message)
    for said in trial.asked.said:
        beyond = _beyond_the_train_ahead(trial, said)
        if beyond:
            return beyond
    return ""


def _beyond_the_train_ahead(trial: Trial, said: Answered) -> str:
    """Any train further on, on a track of the route, bounds the authority by its rear."""
    line, services = trial.scenario.line, trial.scenario.timetable.services
    state, eoa_m = said.state, said.authority.eoa_m
    if not isinstance(eoa_m, np.ndarray) or eoa_m.shape != state.front_m.shape:
        return ""
    kinds = [trial.scenario.train_types[service.train_type] for service in services]
    emergency_mps2 = np.array([kind.emergency_brake_mps2 for kind in kinds])
    braking_m = 0.5 * np.square(state.speed_mps) / emergency_mps2
    counts = trial.controller.separation is Separation.BRAKING
    rear_m = state.tail_m + (braking_m if counts else 0.0)
    present = np.flatnonzero(state.present).tolist()
    for row, other in product(present, present):
        if state.front_m[other] <= state.front_m[row]:
            continue
        for track in set(services[row].route) & set(services[other].route):
            place = line.track_by_id[track]
            if place.start_m < state.front_m[other] and state.tail_m[other] < place.end_m:
                # Who stands further on already stays there.
                most_m = max(rear_m[other], place.start_m, state.front_m[row])
                if eoa_m[row] > most_m + CLOSE_M:
                    over_m = eoa_m[row] - most_m
                    ahead = services[other].train
                    return f"{services[row].train} may go {over_m:.1f} m beyond the rear of {ahead}"
    return ""


def keeps_its_word(trial: Trial) -> str:
    """Return where a protection permits something else than it says beforehand."""
    compared = comparisons(trial)
    if not compared:
        return "no train came behind another one: nothing could be compared"
    return next((problem for problem in compared if problem), "")


def comparisons(trial: Trial) -> list[str]:
    """
    Compare what a protection permits with what it says beforehand.

    Parameters
    ----------
    trial
        A run.

    Returns
    -------
    list[str]
        For each train behind a leader in each step what is wrong; empty where nothing is.
    """
    foresight: Any = trial.controller.protection
    # By the time that detection takes, an authority may count on an older place of the leader.
    old = round(foresight.release_delay_s / trial.world.step_s) + 1
    found = []
    for step, said in enumerate(trial.asked.said):
        if (said.authority.delay_s != foresight.delay_s).any():
            found.append("delay_s of an authority is not the one that is told beforehand")
        before = trial.asked.said[max(step - old, 0)].state
        for row in _unhindered_rows(trial.world, said):
            problem = _other_than_foreseen(foresight, said, before, row, trial.world.far_m)
            train = trial.scenario.timetable.trains[row]
            found.append(f"{problem} ({train})" if problem else "")
    return found


def _unhindered_rows(world: World, said: Answered) -> Sequence[int]:
    """Return the trains that run behind a leader and have not come to its platform."""
    state = said.state
    platform_m = world.platform_m[0, np.arange(world.size), state.next_call]
    outside = state.running & state.follows & (state.front_m < platform_m)
    rows: list[int] = np.flatnonzero(outside).tolist()
    return rows


def _other_than_foreseen(
    foresight: Any,  # noqa: ANN401 - whatever is checked
    said: Answered,
    before: Any,  # noqa: ANN401
    row: int,
    far_m: float,
) -> str:
    state, authority = said.state, said.authority
    leader, call = int(state.leader[row]), int(state.next_call[row])
    latest, oldest = (
        foresight.eoa_behind_m(row, call, leader, seen.front_m[[leader]], seen.speed_mps[[leader]])[
            0
        ]
        for seen in (state, before)
    )
    # Who stands further on already stays there.
    if authority.eoa_m[row] > max(latest, state.front_m[row]) + CLOSE_M:
        return "it permits more than eoa_behind_m says"
    granted = min(state.granted_to_m[row], before.granted_to_m[row]) >= far_m
    if granted and before.leader[row] == leader and state.present[leader]:
        # Nothing but this leader is in the way, nor was then.
        permitted_m = max(authority.eoa_m[row], state.front_m[row])
        # A centre that plans a train's run permits no more than it has planned.
        planned = np.isfinite(authority.permission.commanded_mps[row])
        if not planned and min(oldest, latest) - 1e-6 > permitted_m:
            return "it permits less than eoa_behind_m says"
    return ""


CHECKS: Mapping[str, Callable[[Trial], str]] = {
    "runs to the end": runs_through,
    TIMELY: _noted(TIMELY),
    "same question, same answer": _noted("same question, same answer"),
    WORLD: _noted(WORLD),
    "state is left alone": _noted("state is left alone"),
    "authority is left alone": _noted("authority is left alone"),
    "memory is left alone": _noted("memory is left alone"),
    "memory is what it returns": _noted("memory is what it returns"),
    "authority is complete": _noted("authority is complete"),
    "advice is complete": _noted("advice is complete"),
    "orders are complete": _noted("orders are complete"),
    "reasons are declared": _noted("reasons are declared"),
    "causes are trains or places": _noted("causes are trains or places"),
    "trains are safe": is_safe,
    "says beforehand what it permits": keeps_its_word,
}
"""What is looked at in every run."""
FUTURE = "the future is not read"
AGAIN = "another run, same run"
ABOUT_RUNS = (AGAIN, FUTURE)
"""What is looked at by comparing runs."""


def check_candidate(candidate: Candidate) -> list[Finding]:
    """
    Check whoever builds a controller.

    Parameters
    ----------
    candidate
        Builds it for a world.

    Returns
    -------
    list[Finding]
        One for each check.
    """
    return findings_of(trials_of(candidate), candidate)


def findings_of(trials: Mapping[str, Trial], candidate: Candidate) -> list[Finding]:
    """
    Look at trials of a candidate, and compare runs of it.

    Parameters
    ----------
    trials
        From :func:`~kankaku.testing.trials.trials_of`.
    candidate
        Who ran.

    Returns
    -------
    list[Finding]
        One for each check.
    """
    findings = findings_in(trials)
    first = trials["one track"]
    # Who did not come to an end would not do so again.
    ran = first.record is not None and TIMELY not in first.asked.problems
    again = runs_another_way(first, candidate) if ran else ""
    future = reads_the_future(candidate) if ran else ""
    return [*findings, Finding(AGAIN, again), Finding(FUTURE, future)]


def findings_in(trials: Mapping[str, Trial]) -> list[Finding]:
    """
    Look at trials.

    Parameters
    ----------
    trials
        By the names of the lines.

    Returns
    -------
    list[Finding]
        One for each of :data:`CHECKS`: the first trial where something is wrong.
    """
    return [_finding(check, look, trials) for check, look in CHECKS.items()]


def runs_another_way(trial: Trial, candidate: Candidate) -> str:
    """
    Return whether the same trains run otherwise once more.

    Whoever draws lots, looks at a clock, or keeps something beyond a run does that.

    Parameters
    ----------
    trial
        A run to its end; others may have come after it.
    candidate
        Who ran.

    Returns
    -------
    str
        Empty if they do not.
    """
    delay_s = overstays(trial.scenario, *OVERSTAYS_S)
    other = trial_of(trial.scenario, candidate, delay_s)
    if other.error:
        return f"the same run fails another time: {other.error}"
    for one, two in zip(trial.asked.said, other.asked.said, strict=False):
        if not (same(one.state, two.state) and same(one.advice, two.advice)):
            minutes, seconds = divmod(one.state.time_s, 60.0)
            clock = f"{int(minutes) // 60:02d}:{int(minutes) % 60:02d}:{seconds:04.1f}"
            return f"the same run goes another way from {clock} on"
    if len(trial.asked.said) != len(other.asked.said):
        return "the same run takes longer, or shorter, another time"
    return ""


def _finding(check: str, look: Callable[[Trial], str], trials: Mapping[str, Trial]) -> Finding:
    for name, trial in trials.items():
        try:
            problem = look(trial)
        except Exception as error:  # noqa: BLE001 - whatever a stranger's controller answers
            problem = sentence_of(error)
        if problem:
            return Finding(check, f"{problem} (line {name!r})")
    return Finding(check)


def reads_the_future(candidate: Candidate) -> str:
    """
    Return whether trains run differently before it can be known that a train overstays.

    Parameters
    ----------
    candidate
        Who is checked.

    Returns
    -------
    str
        Empty if they do not.
    """
    scenario = LINES["one track"]()
    seen = [
        trial_of(scenario, candidate, overstays(scenario, overstay_s))
        for overstay_s in (20.0, 150.0)
    ]
    first = seen[0].record
    if first is None or seen[1].record is None:
        return seen[0].error or seen[1].error
    until_s = float(first.arrival_s[0, 1]) + seen[0].world.minimum_dwell_s[0, 1] + 20.0
    for one, other in zip(seen[0].asked.said, seen[1].asked.said, strict=False):
        if one.state.time_s > until_s:
            break
        if not np.array_equal(one.state.front_m, other.state.front_m):
            return "trains run differently before the first one overstays"
    return ""


def check_controller(name: str) -> list[Finding]:
    """
    Check a protection, an operation, a supervision, or some of them, with default options.

    Parameters
    ----------
    name
        A protection (checked under ``close_up``), an operation (over ``moving_block``), a
        supervision (over both), ``protection+operation`` or ``protection+operation+supervision``;
        those of other packages, too.

    Returns
    -------
    list[Finding]
        One for each check.

    Raises
    ------
    KankakuError
        If there is none of that name, or it is another package's and cannot be imported.
    """
    spec = by_layers(name)
    world = world_of(LINES["one track"]())
    # Now, so that a name or option that is wrong is told as that.
    registry.build(spec, world)
    return check_candidate(lambda world: registry.build(spec, world))


def failures(findings: Sequence[Finding]) -> list[str]:
    """
    Return what was found to be wrong.

    Parameters
    ----------
    findings
        Of all checks.

    Returns
    -------
    list[str]
        A sentence for each check that is not passed.
    """
    return [f"{found.check}: {found.problem}" for found in findings if found.problem]
