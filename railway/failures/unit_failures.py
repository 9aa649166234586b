"""
Failures of a control map: what trains, equipment and the centre do wrong (Sugiyama 2018, table 3).

What units measure is nature's, as the radio is: protections see :class:`UnitState` and have to
find out for themselves what of it is wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.disruptions import Cause, Closure, Disruptions
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.radio_spec import Outage, RadioSpec
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import UnitState


class FailureMode(Enum):
    """Failure modes of the source's FMEA."""

    POSITION = "unit: wrong position"
    STATE = "unit: wrong state"
    CLOCK = "unit: wrong clock"
    SILENCE = "unit: no output"
    MAP = "centre: wrong map"
    CENTRE_CLOCK = "centre: wrong clock"
    CENTRE_SILENCE = "centre: no output"


class Variant(Enum):
    """What exactly goes wrong, and what the size of the failure then is."""

    SLIDE = "slide"
    """A train's wheels turn too slowly by up to so much. [m/s]"""
    SLIP = "slip"
    """They turn too fast by up to so much. [m/s]"""
    WHEEL = "wheel diameter"
    """The wheels turn so much too fast, by share of the speed. [-]"""
    STATE = "contradictory state"
    """Points or a level crossing cannot be told to be in any state; no size."""
    JUMP = "clock jumps"
    """A train's clock is ahead by so much. [s]"""
    DRIFT = "clock drifts"
    """A train's clock is ahead by so much in the end. [s]"""
    UP = "train not heard"
    """Its reports are lost; no size."""
    DOWN = "train hears nothing"
    """Its telegrams are lost; no size."""
    BOTH = "train cut off"
    """Both are lost; no size."""
    EQUIPMENT = "equipment silent"
    """Points or a level crossing say nothing; no size."""
    BAND = "band shifted"
    """The centre takes a train as so much further on. [m]"""
    LEFT_OUT = "band left out"
    """The centre takes a train as gone; no size."""
    RUN = "run curve shifted"
    """A train's run curve is so much further on. [m]"""
    IGNORED = "obstruction ignored"
    """The centre ignores what is not granted to a train; no size."""
    CENTRE_JUMP = "centre's clock jumps"
    """It is ahead by so much. [s]"""
    CENTRE_SILENT = "centre silent"
    """It sends nothing; no size."""


VARIANTS: dict[FailureMode, tuple[Variant, ...]] = {
    FailureMode.POSITION: (Variant.SLIDE, Variant.SLIP, Variant.WHEEL),
    FailureMode.STATE: (Variant.STATE,),
    FailureMode.CLOCK: (Variant.JUMP, Variant.DRIFT),
    FailureMode.SILENCE: (Variant.UP, Variant.DOWN, Variant.BOTH, Variant.EQUIPMENT),
    FailureMode.MAP: (Variant.BAND, Variant.LEFT_OUT, Variant.RUN, Variant.IGNORED),
    FailureMode.CENTRE_CLOCK: (Variant.CENTRE_JUMP,),
    FailureMode.CENTRE_SILENCE: (Variant.CENTRE_SILENT,),
}
KIND_OF = {variant: kind for kind, variants in VARIANTS.items() for variant in variants}
CENTRE = "centre"


@dataclass(frozen=True, slots=True)
class UnitFailure:
    """One unit does one thing wrong for a time."""

    variant: Variant
    unit: str
    """Train, turnout, level crossing or :data:`CENTRE`; of a wrong map, the train it is about."""
    from_s: float
    until_s: float
    size: float = 0.0
    """See :class:`Variant`."""

    @property
    def kind(self) -> FailureMode:
        """The failure mode."""
        return KIND_OF[self.variant]

    @property
    def duration_s(self) -> float:
        """How long it lasts. [s]"""
        return self.until_s - self.from_s

    def during(self, time_s: float) -> bool:
        """
        Return whether it lasts at a time.

        Parameters
        ----------
        time_s
            The time. [s]

        Returns
        -------
        bool
            From its onset on, up to its end.
        """
        return self.from_s <= time_s < self.until_s


class Units:
    """The units of all trains and the centre: exact, but for their failures."""

    def __init__(self, world: World, unit_failures: Sequence[UnitFailure]) -> None:
        row_of = {name: row for row, name in enumerate(world.timetable.trains)}
        self._wheels = [
            (row_of[f.unit], f) for f in unit_failures if f.kind is FailureMode.POSITION
        ]
        self._clocks = [(row_of[f.unit], f) for f in unit_failures if f.kind is FailureMode.CLOCK]
        self._centre = [f for f in unit_failures if f.variant is Variant.CENTRE_JUMP]
        self._balises_m = np.array(sorted(world.line.balises_m))
        self._step_s = world.step_s
        self._error_m = np.zeros(world.size)
        self._off_mps = np.zeros(world.size)
        self._balise_m = world.stop_m[:, 0].copy()
        self._counted_m = self._balise_m.copy()
        self._passed = np.searchsorted(self._balises_m, self._balise_m, side="right")

    def update(self, time_s: float, front_m: FloatArray, speed_mps: FloatArray) -> UnitState:
        """
        Return what units measure; called once per step.

        Parameters
        ----------
        time_s
            Now. [s]
        front_m, speed_mps
            Where trains are, and how fast. [m] and [m/s], shape (n_trains,)

        Returns
        -------
        UnitState
            A snapshot.
        """
        off_mps = np.zeros_like(speed_mps)
        for row, failure in self._wheels:
            if failure.during(time_s):
                off_mps[row] = _off_mps(failure, time_s, float(speed_mps[row]))
        self._error_m = self._error_m + 0.5 * self._step_s * (off_mps + self._off_mps)
        self._off_mps = off_mps
        passed = np.searchsorted(self._balises_m, front_m, side="right")
        if np.any(passed > self._passed):
            found = passed > self._passed
            self._passed = passed
            self._balise_m = np.where(found, self._balises_m[passed - 1], self._balise_m)
            read_m = self._balise_m + self._error_m
            self._counted_m = np.where(found, read_m, self._counted_m)
        clock_error_s = np.zeros_like(speed_mps)
        for row, failure in self._clocks:
            if failure.during(time_s):
                gone = (time_s - failure.from_s) / failure.duration_s
                clock_error_s[row] = failure.size * (
                    gone if failure.variant is Variant.DRIFT else 1.0
                )
        centre_s = sum(failure.size for failure in self._centre if failure.during(time_s))
        return UnitState(
            front_m + self._error_m,
            speed_mps + off_mps,
            self._balise_m,
            self._counted_m,
            clock_error_s,
            centre_s,
        )


def _off_mps(failure: UnitFailure, time_s: float, speed_mps: float) -> float:
    """Return by how much wheels turn too fast; those of a standing train do not turn. [m/s]"""
    if speed_mps == 0.0:
        return 0.0
    if failure.variant is Variant.WHEEL:
        return failure.size * speed_mps
    # It grows for half of its time.
    grown = min(2.0 * (time_s - failure.from_s) / failure.duration_s, 1.0)
    if failure.variant is Variant.SLIP:
        return failure.size * grown
    return -min(failure.size * grown, speed_mps)


def silenced(radio: RadioSpec, unit_failures: Sequence[UnitFailure]) -> RadioSpec:
    """
    Return a radio that loses what silent units do not say, and deaf ones do not hear.

    Parameters
    ----------
    radio
        The radio.
    unit_failures
        Any failures.

    Returns
    -------
    RadioSpec
        With outages.
    """
    outages = tuple(
        Outage(
            () if failure.variant is Variant.CENTRE_SILENT else (failure.unit,),
            up=failure.variant in {Variant.UP, Variant.BOTH},
            down=failure.variant in {Variant.DOWN, Variant.BOTH, Variant.CENTRE_SILENT},
            from_s=failure.from_s,
            until_s=failure.until_s,
        )
        for failure in unit_failures
        if failure.variant in {Variant.UP, Variant.DOWN, Variant.BOTH, Variant.CENTRE_SILENT}
    )
    return replace(radio, outages=radio.outages + outages) if outages else radio


def disturbed(
    disruptions: Disruptions, line: Line, unit_failures: Sequence[UnitFailure]
) -> Disruptions:
    """
    Return disruptions with the obstructions that failed equipment sets.

    Points and level crossings are fail-safe: when they cannot tell their state, or say nothing,
    they count as obstructed at once.

    Parameters
    ----------
    disruptions
        What goes wrong anyhow.
    line
        The line.
    unit_failures
        Any failures.

    Returns
    -------
    Disruptions
        With closures over the detector-locked section or the level crossing.
    """
    places_m = {item.id: (item.fouling_start_m, item.fouling_end_m) for item in line.turnouts}
    places_m |= {item.id: (item.start_m, item.end_m) for item in line.crossings}
    closures = tuple(
        Closure(
            f"{failure.unit}: {failure.variant.value}",
            Cause.FAILURE,
            line.tracks_between(*places_m[failure.unit]),
            *places_m[failure.unit],
            failure.from_s,
            np.inf,
            failure.until_s,
        )
        for failure in unit_failures
        if failure.variant in {Variant.STATE, Variant.EQUIPMENT}
    )
    return replace(disruptions, closures=disruptions.closures + closures)


def failing(run: Run, unit_failures: Sequence[UnitFailure]) -> tuple[Run, Units]:
    """
    Return a run with what units and the centre do wrong.

    Parameters
    ----------
    run
        The run without.
    unit_failures
        Any failures, even none.

    Returns
    -------
    tuple[Run, Units]
        The run, and what its units measure.
    """
    radio = silenced(run.radio, unit_failures)
    disruptions = disturbed(run.disruptions, run.world.line, unit_failures)
    units = Units(run.world, unit_failures)
    return replace(run, radio=radio, disruptions=disruptions), units
