"""The shortest interval of two trains on SUMO at which the second one is not hindered."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from kankaku.controllers import registry
from kankaku.railway.capacity.permitted import permitted_profile
from kankaku.railway.motion.journey import Journey, technical_journey
from kankaku.railway.plan.disruptions import UNDISTURBED
from kankaku.railway.plan.dwell import DwellDelays
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.timetable import Call, Timetable
from kankaku.railway.step.records import RunRecord
from kankaku.studies.study import Study, StudyError, foresight_of, run_once, world_of

RESOLUTION_S = 0.1
"""How exactly a headway is found. [s]"""
FIRST_DEPARTURE_S = 36_000.0
READY_S = 1.0
"""A train stands ready so long before it departs. [s]"""
LATE_S = 15.0
"""Trains may be so much slower on SUMO than in theory. [s]"""
FIRST_STRIDE = 4
"""How far from the guess the search looks next, in units of the resolution."""
MOST_S = 3600.0
"""No headway is looked for beyond. [s]"""


def simulated_headway_s(
    study: Study, spec: ControllerSpec, place: tuple[int, int], guess_s: float
) -> float:
    """
    Return the headway into a call by simulation.

    Parameters
    ----------
    study
        Scenario and step.
    spec
        The controller.
    place
        Row of the pattern, and the call where two trains of it arrive one after the other.
    guess_s
        Where to begin to search. [s]

    Returns
    -------
    float
        The least interval, in whole steps, at which the second train arrives there and departs
        as long after the first one. [s]

    Raises
    ------
    StudyError
        If there is none.
    """
    row, call = place
    steps = max(round(RESOLUTION_S / study.step_s), 1)
    unit_s = steps * study.step_s
    world = world_of(study.scenario, study.step_s).driven_as(spec.driving)
    foresight = foresight_of(registry.build(spec, world, study.scenario.radio))
    journey = technical_journey(world, permitted_profile(world, foresight, row), row)

    # Theory asks for trains as close as they can follow, which is how late ones are driven.
    hurried = replace(spec, driving=world.driving.hurried)

    def is_free(units: int) -> bool:
        headway_s = units * unit_s
        pair = two_trains(study.scenario, row, journey, call, headway_s)
        record = run_once(pair, hurried, pair.seed, study.step_s)
        return is_unhindered(record, headway_s)

    found = least_free(is_free, round(guess_s / unit_s), round(MOST_S / unit_s))
    if found is None:
        msg = f"{spec.name}: a second train is never on time to the step, however long after the "
        msg += "first (by radio none is); allowed: --simulate none, or other controllers"
        raise StudyError(msg)
    return unit_s * found


def least_free(is_free: Callable[[int], bool], guess: int, most: int) -> int | None:
    """
    Return the least number from which on something is free.

    Parameters
    ----------
    is_free
        Whether a number is; all above a free one are, and below 1 none.
    guess
        Where to begin. [-]
    most
        Where to give up. [-]

    Returns
    -------
    int | None
        The number; None if there seems to be none.
    """
    taken, free, stride = 0, guess, FIRST_STRIDE
    if is_free(guess):
        while guess - stride > 0 and is_free(guess - stride):
            free, stride = guess - stride, 2 * stride
        taken = max(guess - stride, 0)
    else:
        taken = guess
        while not is_free(guess + stride):
            taken, stride = guess + stride, 2 * stride
            if guess + stride > most:
                return None
        free = guess + stride
    while free - taken > 1:
        middle = (free + taken) // 2
        taken, free = (taken, middle) if is_free(middle) else (middle, free)
    return free


def two_trains(
    scenario: Scenario, row: int, journey: Journey, call: int, headway_s: float
) -> Scenario:
    """
    Return two trains of one pattern, from the call before a station to the call behind it.

    Parameters
    ----------
    scenario
        Where.
    row
        The pattern.
    journey
        Its fastest journey.
    call
        The call.
    headway_s
        How long the second train is behind the first. [s]

    Returns
    -------
    Scenario
        Without dwell delays and disruptions; it ends when the second train should have departed.
    """
    service = scenario.timetable.services[row]
    begin_s = FIRST_DEPARTURE_S - journey.departure_s[call - 1]
    booked = [
        replace(
            service.calls[number],
            arrival_s=float(begin_s + journey.arrival_s[number]),
            departure_s=float(begin_s + journey.departure_s[number]),
            minimum_dwell_s=float(journey.departure_s[number] - journey.arrival_s[number]),
        )
        for number in range(call - 1, min(call + 2, len(service.calls)))
    ]
    booked[0] = replace(booked[0], arrival_s=FIRST_DEPARTURE_S - READY_S, minimum_dwell_s=0.0)
    section = scenario.line.section_of_track
    pattern = replace(
        service,
        origin=booked[0].station,
        route=tuple(t for t in service.route if section[t] >= section[booked[0].track]),
        calls=tuple(booked),
    )
    behind = replace(pattern, calls=tuple(_later(one, headway_s) for one in booked))
    second = replace(behind, train=f"{pattern.train} behind")
    over_s = second.calls[1].departure_s + LATE_S
    return replace(
        scenario,
        timetable=Timetable((pattern, second)),
        dwell_delays=DwellDelays(),
        disruptions=UNDISTURBED,
        patience_s=over_s - second.calls[-1].departure_s,
    )


def _later(call: Call, by_s: float) -> Call:
    return replace(call, arrival_s=call.arrival_s + by_s, departure_s=call.departure_s + by_s)


def is_unhindered(record: RunRecord, headway_s: float) -> bool:
    """
    Return whether the second of two trains is on time at its second call.

    Parameters
    ----------
    record
        The run.
    headway_s
        How long the second train should be behind the first. [s]

    Returns
    -------
    bool
        It arrives there and departs so much later than the first one, to the step.
    """
    times_s = np.array([record.arrival_s[:, 1], record.departure_s[:, 1]])
    # A comparison with nan is false: who never arrives is hindered.
    return bool(np.all(np.diff(times_s) <= headway_s + 0.5 * record.world.step_s))
