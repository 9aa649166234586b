"""
Runs of least energy over a leg, from stop to stop, as ceilings by metre.

A ceiling says nothing where a train speeds up but how fast it may get, and nothing where the run is
as fast as line and brake allow: whoever is slower than the run, for whatever reason, may speed up
until it meets the ceiling. So of two trains on a leg the one under the ceiling loses no more than
the run itself loses on the fastest one, wherever they are hindered.
"""

from functools import lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np

from kankaku.controllers.operation.close_up import NO_CEILING_MPS
from kankaku.railway.arrays import FloatArray
from kankaku.railway.motion.eco_run import EcoRun, eco, shortest_s
from kankaku.railway.motion.extremal import SPEEDING_UP
from kankaku.railway.motion.run_curve import RunCurve, RunTimeError, StallError, driven_along
from kankaku.railway.motion.way import Way, way_on
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight

Leg: TypeAlias = tuple[int, float, float]
"""Row of the profile, and both stops. [-], [m], [m]"""
TENTHS = 10
"""Run times that are alike to a tenth of a second are planned once. [1/s]"""
EXACTNESS = 0.05
"""How exactly a margin is met, as a part of it. [-]"""
BOUND = 1e-9
"""A run whose energy is nearer to the greatest than this part is bound by it. [-]"""
KEPT = 512
"""Runs that are remembered."""


class LegRun(NamedTuple):
    """A run over a leg."""

    leg: Leg
    hurries: bool
    """Driven as late trains are."""
    tenths: int
    """Run time in tenths of a second; 0 for the quickest one."""
    table: FloatArray
    """Ceiling [m/s] and time since the start [s] by metres from there. shape (2, n_metres)"""


class LegRuns:
    """
    Runs over the legs of a timetable.

    Parameters
    ----------
    world
        The trains, in the style in which they are driven.
    usual
        The same in the style whose run times count as usual.
    foresight
        What the protection says beforehand.
    margin_s
        By how much the quickest run planned is slower than the fastest one. [s]
    """

    def __init__(self, world: World, usual: World, foresight: Foresight, margin_s: float) -> None:
        self._world, self._usual = world, usual
        self._profile = foresight.profile
        self._margin_s = margin_s
        self._made = lru_cache(maxsize=KEPT)(self._make)
        self._shortest = lru_cache(maxsize=KEPT)(self._work_out_shortest_s)
        self._usually = lru_cache(maxsize=KEPT)(self._work_out_usual_s)

    def quickest(self, row: int, call: int, hurries: bool) -> LegRun | None:
        """
        Return the run that is slower than the fastest one by the margin.

        Parameters
        ----------
        row
            The train.
        call
            The call that it runs to, from the one before.
        hurries
            Whether it is driven as late trains are.

        Returns
        -------
        LegRun | None
            None for a train that cannot climb the leg.
        """
        return self._made(self._leg(row, call), hurries, 0)

    def in_time(self, row: int, call: int, run_time_s: float) -> LegRun | None:
        """
        Return the run that takes a given time, or the slowest one.

        Parameters
        ----------
        row
            The train.
        call
            The call that it runs to, from the one before.
        run_time_s
            The time. [s]

        Returns
        -------
        LegRun | None
            None where the quickest run takes as long.
        """
        leg, tenths = self._leg(row, call), int(TENTHS * run_time_s)
        least_s = self._shortest(leg, True) + self._margin_s
        return self._made(leg, True, tenths) if tenths > TENTHS * least_s else None

    def usual_s(self, row: int, call: int) -> float:
        """
        Return how long a train that is not late usually runs.

        Parameters
        ----------
        row
            The train.
        call
            The call that it runs to, from the one before.

        Returns
        -------
        float
            From full traction to its stop. [s]
        """
        return self._usually(self._leg(row, call))

    def _leg(self, row: int, call: int) -> Leg:
        start_m, stop_m = self._world.stop_m[row, call - 1 : call + 1].tolist()
        return int(self._world.type_index[row]), start_m, stop_m

    def _way(self, leg: Leg, hurries: bool) -> Way:
        kind, *ends_m = leg
        world, slower = self._world, None
        if not hurries:
            unhurried = world.unhurried_profile
            slower = unhurried.ceiling_at_m2ps2(kind, unhurried.grid_m)
        ends = ends_m[0], ends_m[1]
        return way_on(self._profile, kind, world.driven_types[kind], ends, ceiling_m2ps2=slower)

    def _work_out_shortest_s(self, leg: Leg, hurries: bool) -> float:
        try:
            return shortest_s(self._way(leg, hurries))
        except StallError:
            return np.inf

    def _work_out_usual_s(self, leg: Leg) -> float:
        kind, *ends_m = leg
        usual = self._usual.unhurried_profile
        way = way_on(usual, kind, self._usual.driven_types[kind], (ends_m[0], ends_m[1]))
        try:
            return driven_along(way, usual.coasting_band_mps).run_time_s
        except StallError:
            return 0.0

    def _make(self, leg: Leg, hurries: bool, tenths: int) -> LegRun | None:
        way, fastest_s = self._way(leg, hurries), self._shortest(leg, hurries)
        run_time_s = tenths / TENTHS if tenths else fastest_s + self._margin_s
        tolerance_s = EXACTNESS * min(run_time_s - fastest_s, 1.0)
        try:
            run = eco(way, run_time_s, tolerance_s=tolerance_s)
        except (RunTimeError, StallError):
            return None
        return LegRun(leg, hurries, tenths, table_of(way, run, self._world.step_s))


def table_of(way: Way, run: EcoRun, step_s: float) -> FloatArray:
    """
    Tabulate a run by metres.

    Parameters
    ----------
    way
        Its way.
    run
        The run.
    step_s
        Length of a step: a ceiling holds at its end. [s]

    Returns
    -------
    FloatArray
        As :attr:`LegRun.table`.
    """
    curve, speeds_up = run.curve, run.phase == SPEEDING_UP
    bound = 0.5 * np.square(curve.speed_mps) >= (1.0 - BOUND) * way.cap_m2ps2
    ceiling = np.where(bound, NO_CEILING_MPS, _eased_mps(curve, way.train_type.brake_rise_s))
    ceiling[:-1][speeds_up] = curve.speed_mps[:-1][speeds_up]
    for cell in np.flatnonzero(speeds_up)[::-1].tolist():
        ceiling[cell] = max(ceiling[cell], ceiling[cell + 1])
    after = np.interp(curve.time_s + step_s, curve.time_s, np.arange(ceiling.size))
    shifted = np.interp(after, np.arange(ceiling.size), ceiling)
    ceiling[:-1] = np.where(speeds_up, np.maximum(ceiling[:-1], shifted[:-1]), shifted[:-1])
    along_m = curve.chainage_m - curve.chainage_m[0]
    metres = np.arange(np.floor(along_m[-1]) + 1.0)
    return np.array([np.interp(metres, along_m, values) for values in (ceiling, curve.time_s)])


def _eased_mps(curve: RunCurve, rise_s: float) -> FloatArray:
    """Return speeds whose deceleration takes as long to rise as that of the train does."""
    if rise_s <= 0.0:
        return curve.speed_mps
    places_m = [
        np.interp(curve.time_s + 0.5 * sign * rise_s, curve.time_s, curve.chainage_m)
        for sign in (1.0, -1.0)
    ]
    return np.minimum((places_m[0] - places_m[1]) / rise_s, curve.speed_mps)
