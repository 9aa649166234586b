"""
What trains and centre make of measurements that may be wrong.

A train counts its wheels' turns from the last balise, and compares their speed with what it feels
by its acceleration. As long as both agree within ``RATIO``, the counted distance is off by no more
than that share of it; where they do not, the wheels slip or slide, and what they count too much or
too little is uncertain until the next balise. :attr:`Aboard.uncertain_m` bounds the error at any
time. Half of the margin of the bands is for it; by what is beyond, the band is widened at both
ends.

Time stamps that cannot be true are not believed: neither by trains nor by the centre.
"""

from enum import Enum
from typing import NamedTuple

import numpy as np

from kankaku.controllers.centre.reports import radio_of
from kankaku.controllers.control_map.located import Located, located
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.plan.radio_spec import NEVER, TOLERANCE_S, RadioSpec
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NO_VERSION, LineState, RadioState, UnitState

EARLY_S = 0.5
"""A message from further in the future is not believed, nor a clock that is so far off. [s]"""
LATE_S = 2.0
"""Longest delay of a message (Sugiyama 2018, section 3.1.3). [s]"""


class Notice(Enum):
    """What a unit has found to be wrong."""

    WHEELS = "slip and slide detection"
    BALISE = "balise"
    TRAIN_STAMP = "time stamp, by the train"
    REPORT_STAMP = "time stamp, by the centre"
    NO_REPORT = "no report"
    NO_COMMANDS = "no commands"
    CENTRE_CLOCK = "satellite time"
    EXCLUSION = "exclusion test"


CENTRE_ROW = -1


class Alarm(NamedTuple):
    """A unit finds something to be wrong, that was not just before."""

    time_s: float
    notice: Notice
    row: int
    """The train that it is about; :data:`CENTRE_ROW` for none."""


class Said(NamedTuple):
    """What trains added to the reports of one cycle; arrays of shape (n_trains,)."""

    cycle: int
    longer_m: FloatArray
    taken: IntArray
    clock_error_s: FloatArray


class Aboard(NamedTuple):
    """What trains and centre know of their measurements; arrays of shape (n_trains,)."""

    uncertain_m: FloatArray
    """The measured position is off by no more. [m]"""
    widened_m: FloatArray
    """By so much each band is longer at either end. [m]"""
    shift_m: FloatArray
    """So far the front that counts is ahead of the true one. [m]"""
    retreat_m: FloatArray
    """So much further on it is since the last step, without having run. [m]"""
    off_mps: FloatArray
    """Difference of the two speeds. [m/s]"""
    disagrees: BoolArray
    """It is too great."""
    balise_m: FloatArray
    counted_m: FloatArray
    """What the odometer said there. [m]"""
    clock_error_s: FloatArray
    judged: IntArray
    """Cycle of the last telegram that each train has believed or not."""
    refuses: BoolArray
    """The train has not believed the last telegram."""
    slow: BoolArray
    """Because it seemed to come from the future: nobody knows how old its commands are."""
    stamp_error_s: float
    """Error of the centre's clock when it sent the last telegram. [s]"""
    stamped_s: FloatArray
    """Time stamps of the reports that the centre believes, less the true ones. [s]"""
    longer_m: FloatArray
    """By so much these bands are longer. [m]"""
    misses: BoolArray
    """The centre has not believed the last report of a train."""
    in_time: bool
    """The centre's clock agrees with satellite time."""
    unheard: BoolArray
    """The centre has not heard from a train for too long."""
    said: tuple[Said, ...]
    """What may still arrive, oldest first."""
    arrived: RadioState
    """What has arrived."""
    believed: RadioState
    """What of it is believed."""
    leaving: BoolArray
    """Who brakes in emergency because it might leave its band."""
    alarms: tuple[Alarm, ...]

    def alarm(self, time_s: float, notice: Notice, rows: BoolArray) -> "Aboard":
        """
        Return the same with an alarm about some trains.

        Parameters
        ----------
        time_s
            Now. [s]
        notice
            What is wrong.
        rows
            About whom. shape (n_trains,)

        Returns
        -------
        Aboard
            The same if about none.
        """
        if not rows.any():
            return self
        found = tuple(Alarm(time_s, notice, row) for row in np.flatnonzero(rows).tolist())
        return self._replace(alarms=self.alarms + found)


def all_right(world: World) -> Aboard:
    """
    Return what is known before the first step.

    Parameters
    ----------
    world
        The trains.

    Returns
    -------
    Aboard
        Every train is exactly at its origin.
    """
    zero, never = np.zeros(world.size), np.full(world.size, NEVER)
    never_s = np.full(world.size, -np.inf)
    versions = NO_VERSION, NO_VERSION
    nothing = RadioState(never, never, never, never_s, never_s, never_s, *versions)
    nobody, origin_m = np.zeros(world.size, dtype=np.bool_), world.stop_m[:, 0]
    return Aboard(
        uncertain_m=zero,
        widened_m=zero,
        shift_m=zero,
        retreat_m=zero,
        off_mps=zero,
        disagrees=nobody,
        balise_m=origin_m,
        counted_m=origin_m,
        clock_error_s=zero,
        judged=never,
        refuses=nobody,
        slow=nobody,
        stamp_error_s=0.0,
        stamped_s=zero,
        longer_m=zero,
        misses=nobody,
        in_time=True,
        unheard=nobody,
        said=(),
        arrived=nothing,
        believed=nothing,
        leaving=nobody,
        alarms=(),
    )


def measure(
    state: LineState,
    aboard: Aboard,
    cycles: IntArray,
    world: World,
    radio: RadioSpec,
    allowance_m: float,
) -> tuple[LineState, Aboard]:
    """
    Return the line as it is measured; called in every step.

    Parameters
    ----------
    state
        The line, with what its units measure.
    aboard
        From the step before.
    cycles
        Of the telegrams that there are. shape (n_slots,)
    world
        The trains.
    radio
        The radio.
    allowance_m
        So wrong a position may be before the band is widened. [m]

    Returns
    -------
    tuple[LineState, Aboard]
        Fronts are where they are at the furthest, tails at the least; and of the radio only what
        is believed.
    """
    units = state.units
    if units is None:
        return state, aboard
    aboard = _locate(state, units, aboard, world.step_s, allowance_m)
    front_m = state.front_m + aboard.shift_m
    tail_m = front_m - world.length_m - 2.0 * aboard.widened_m
    aboard = _listen(state, units, aboard, cycles, world.step_s)
    aboard = _report(state, aboard, radio)
    speed_mps = np.maximum(state.speed_mps, units.wheels_mps)
    seen = state._replace(
        front_m=front_m, tail_m=tail_m, speed_mps=speed_mps, radio=aboard.believed
    )
    return seen, aboard


def _locate(
    state: LineState, units: UnitState, aboard: Aboard, step_s: float, allowance_m: float
) -> Aboard:
    """Count wheels, and bound by how much they may be wrong."""
    measured = units.odometer_m, units.wheels_mps, units.balise_m, units.counted_m
    before = (
        aboard.uncertain_m,
        aboard.widened_m,
        aboard.off_mps,
        aboard.balise_m,
        aboard.counted_m,
        aboard.disagrees,
    )
    felt = state.front_m, state.speed_mps
    found = Located(*located(felt, measured, before, step_s, allowance_m))
    if found.news:
        aboard = aboard.alarm(state.time_s, Notice.WHEELS, found.disagrees & ~aboard.disagrees)
        aboard = aboard.alarm(state.time_s, Notice.BALISE, found.wrong)
    return aboard._replace(
        uncertain_m=found.uncertain_m,
        widened_m=found.widened_m,
        shift_m=found.shift_m,
        retreat_m=found.retreat_m,
        off_mps=found.off_mps,
        disagrees=found.disagrees,
        balise_m=units.balise_m,
        counted_m=units.counted_m,
        clock_error_s=units.clock_error_s,
    )


def _listen(
    state: LineState, units: UnitState, aboard: Aboard, cycles: IntArray, step_s: float
) -> Aboard:
    """Let trains believe the telegrams whose time stamps may be true."""
    believed, radio = aboard.believed, radio_of(state)
    heard, heard_s = radio.heard, radio.heard_s
    fresh = heard > aboard.judged
    if not fresh.any():
        return aboard
    # What takes no time at all is heard in the step in which the centre sends it.
    fresh &= (heard[:, np.newaxis] == cycles).any(axis=1)
    age_s = state.time_s + units.clock_error_s - heard_s - aboard.stamp_error_s
    early = fresh & (age_s < -EARLY_S - TOLERANCE_S)
    late = fresh & (age_s > LATE_S + step_s + TOLERANCE_S)
    taken = fresh & ~early & ~late
    refuses = (aboard.refuses & ~fresh) | early | late
    aboard = aboard.alarm(state.time_s, Notice.TRAIN_STAMP, refuses & ~aboard.refuses)
    return aboard._replace(
        judged=np.where(fresh, heard, aboard.judged),
        believed=believed._replace(
            heard=np.where(taken, heard, believed.heard),
            heard_s=np.where(taken, heard_s, believed.heard_s),
            telegrams_version=believed.telegrams_version + 1,
        ),
        refuses=refuses,
        slow=(aboard.slow & ~taken) | early,
    )


def _report(state: LineState, aboard: Aboard, spec: RadioSpec) -> Aboard:
    """Let trains report, and the centre believe the reports whose time stamps may be true."""
    radio, before = radio_of(state), aboard.arrived
    cycle = spec.report_cycle(state.time_s)
    if not aboard.said or cycle > aboard.said[-1].cycle:
        oldest_s = spec.report_s(cycle) - spec.cycle_s - spec.delay_most_s
        kept = tuple(said for said in aboard.said if spec.report_s(said.cycle) >= oldest_s)
        said = Said(cycle, 2.0 * aboard.widened_m, aboard.believed.heard, aboard.clock_error_s)
        aboard = aboard._replace(said=(*kept, said))
    if radio.reports_version != before.reports_version:
        fresh = (radio.reported != before.reported) & (radio.reported != NEVER)
        aboard = _take(state.time_s, np.where(fresh, radio.reported, NEVER), aboard, spec)
    return aboard._replace(arrived=radio)


def _take(time_s: float, reported: IntArray, aboard: Aboard, spec: RadioSpec) -> Aboard:
    """Let the centre believe reports that have arrived now, by their cycles."""
    believed = aboard.believed
    longer_m, stamped_s = aboard.longer_m.copy(), aboard.stamped_s.copy()
    accepted, acknowledged = believed.reported.copy(), believed.acknowledged.copy()
    misses = aboard.misses.copy()
    for said in aboard.said:
        arrived = reported == said.cycle
        age_s = time_s - spec.report_s(said.cycle) - said.clock_error_s
        true = (age_s >= -EARLY_S - TOLERANCE_S) & (age_s <= LATE_S + TOLERANCE_S)
        misses = np.where(arrived, ~true, misses)
        taken = arrived & true
        accepted[taken] = said.cycle
        acknowledged[taken] = said.taken[taken]
        longer_m[taken], stamped_s[taken] = said.longer_m[taken], said.clock_error_s[taken]
    aboard = aboard.alarm(time_s, Notice.REPORT_STAMP, misses & ~aboard.misses)
    if np.array_equal(accepted, believed.reported):
        return aboard._replace(misses=misses)
    return aboard._replace(
        misses=misses,
        longer_m=longer_m,
        stamped_s=stamped_s,
        believed=believed._replace(
            reported=accepted,
            acknowledged=acknowledged,
            reported_s=spec.reports_s(accepted),
            acknowledged_s=spec.telegrams_s(acknowledged),
            reports_version=believed.reports_version + 1,
        ),
    )
