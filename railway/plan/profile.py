"""
The line as one type of train meets it, tabulated once so that a step only interpolates.

A train of length L feels the height of the track averaged over its length,
``h(x) = mean of height over [x - L, x]``. With that, braking under gravity is energy
conservation, and the *brake potential* ``P(x) = b x + g h(x)`` turns every brake curve
towards any target into ``v^2 / 2 = P(target) - P(x)``. Of a *net* brake, which reaches its rate
on any gradient, it is ``P(x) = b x``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import GRAVITY_MPS2, FloatArray, IntArray
from kankaku.railway.plan.brake_table import SPACING_M, BrakeTable
from kankaku.railway.plan.buffers import Buffers
from kankaku.railway.plan.limit_table import LimitTable
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.rolling_stock import TrainType

NO_BUFFERS = Buffers()
RUN_OUT_M = 2500.0
"""Level track assumed beyond both ends at least. [m]"""
BEYOND_BRAKING_M = 500.0
"""It is this much longer than the longest brake curve. [m]"""
CLEAR_M = 1e-3
"""A limit is left so far past its end: an engine's places are rounded. [m]"""


class Limits(NamedTuple):
    """
    The limits that hold for a front, exactly where they change.

    Arrays of shape (n_pieces,). The last piece is the end of the tables, where nothing holds.
    """

    start_m: FloatArray
    """Where each piece begins; it ends where the next one begins. [m]"""
    limit_mps: FloatArray
    """The lowest limit under any part of the train. [m/s]"""
    lowest_m2ps2: FloatArray
    """Lowest energy, brake potential included, of the pieces from this one on. [m2/s2]"""
    lowest_mps: FloatArray
    """The limit of the piece that has it. [m/s]"""


@dataclass(frozen=True)
class Profile:
    """Tables over a uniform chainage grid, one row per train type, shape (n_types, n_grid)."""

    origin_m: float
    potential_m2ps2: FloatArray
    """Brake potential of the service brake. [m2/s2]"""
    lift_m2ps2: FloatArray
    """Potential energy by inertial mass, from any height on. [m2/s2]"""
    ceiling_m2ps2: FloatArray
    """Half the square of the line ceiling at the grid, braking curves included. [m2/s2]"""
    limits: tuple[Limits, ...]
    """The limits in force, without braking curves to lower ones ahead, by train type."""
    drag_mps2: FloatArray
    """Deceleration by gradient and curves, mean over the train. [m/s2]"""
    curve_drag_mps2: FloatArray
    """The curves' part of it. [m/s2]"""
    brakes_mps2: FloatArray
    """Service brake on the level. [m/s2], shape (n_types,)"""
    permitted_m2ps2: FloatArray | None = None
    """Half the square of what protection permits at the grid, if it is less. [m2/s2]"""
    coasting_band_mps: float = 0.0
    """From its ceiling a train coasts until it is slower by so much; 0 to hold it. [m/s]"""

    @property
    def end_m(self) -> float:
        """Last chainage of the tables. [m]"""
        return self.origin_m + SPACING_M * float(self.potential_m2ps2.shape[1] - 1)

    @cached_property
    def grid_m(self) -> FloatArray:
        """Chainage of the columns. [m], shape (n_grid,)"""
        columns = np.arange(self.potential_m2ps2.shape[1], dtype=np.float64)
        return self.origin_m + SPACING_M * columns

    @property
    def ceiling_mps(self) -> FloatArray:
        """Line ceiling, its braking curves included. [m/s], shape (n_types, n_grid)"""
        return np.sqrt(2.0 * self.ceiling_m2ps2)

    def ceiling_at_m2ps2(self, row: int, front_m: FloatArray) -> FloatArray:
        """
        Return half the square of the line ceiling, exact between the points of the grid, too.

        Parameters
        ----------
        row
            Row of the train type.
        front_m
            Fronts, within the tables. [m], any shape

        Returns
        -------
        FloatArray
            The lower one where a limit changes. [m2/s2], same shape
        """
        potential = np.interp(front_m, self.grid_m, self.potential_m2ps2[row])
        return _ceiling_m2ps2(self.limits[row], front_m, potential)

    def braking(self, type_index: IntArray) -> BrakeTable:
        """
        Return the brake potential for compiled functions.

        Parameters
        ----------
        type_index
            Row of each train's type. [-], shape (n_trains,)

        Returns
        -------
        BrakeTable
            For these trains.
        """
        service_mps2 = self.brakes_mps2[type_index]
        return BrakeTable(self._braking_v2_m2ps2, self.row_starts(type_index), service_mps2)

    @cached_property
    def limit_table(self) -> LimitTable:
        """The limits in force, for compiled functions."""
        columns, starts, firsts, pieces = self.grid_m.size, [], [], 0
        for row, limits in enumerate(self.limits):
            starts.append(limits.start_m - self.origin_m + float(row * columns))
            first = np.searchsorted(limits.start_m[:-1], self.grid_m, side="right") - 1
            firsts.append(first + pieces)
            pieces += limits.start_m.size
        return LimitTable(
            np.concatenate(starts),
            np.concatenate([limits.limit_mps for limits in self.limits]),
            2.0 * np.concatenate([limits.lowest_m2ps2 for limits in self.limits]),
            np.concatenate([limits.lowest_mps for limits in self.limits]),
            np.concatenate(firsts),
        )

    def row_starts(self, type_index: IntArray) -> FloatArray:
        """
        Return what turns a chainage into a place in a table of all types, one after the other.

        For the makers of such tables only; their readers hide it.

        Parameters
        ----------
        type_index
            Row of each train's type. [-], shape (n_trains,)

        Returns
        -------
        FloatArray
            Offset into the table, origin included. [-], shape (n_trains,)
        """
        columns = self.potential_m2ps2.shape[1]
        starts: FloatArray = type_index.astype(np.float64) * columns - self.origin_m
        return starts

    @cached_property
    def _braking_v2_m2ps2(self) -> FloatArray:
        return 2.0 * self.potential_m2ps2.ravel()

    @cached_property
    def drags_mps2(self) -> FloatArray:
        """:attr:`drag_mps2`, one train type after the other. [m/s2], shape (n_types * n_grid,)"""
        return self.drag_mps2.ravel()

    @cached_property
    def curve_drags_mps2(self) -> FloatArray:
        """:attr:`curve_drag_mps2`, one type after the other. [m/s2], shape (n_types * n_grid,)"""
        return self.curve_drag_mps2.ravel()

    @cached_property
    def lifts_m2ps2(self) -> FloatArray:
        """:attr:`lift_m2ps2`, one train type after the other. [m2/s2], shape (n_types * n_grid,)"""
        return self.lift_m2ps2.ravel()


def _limits_of(
    line: Line, train: TrainType, grid_m: FloatArray, potential: FloatArray, buffers: Buffers
) -> Limits:
    """Cut the line where the limit of a train changes."""
    first_m, last_m = float(grid_m[0]), float(grid_m[-1])
    held = [
        limit
        for limit in line.limits
        if limit.train_type in {"", train.id} and limit.limit_mps < train.maximum_speed_mps
    ]
    entered_m = np.array(
        [float(buffers.front_limit_m(np.array(one.start_m), one.limit_mps)) for one in held]
    ).clip(first_m, last_m)
    left_m = np.array(
        [buffers.rear_limit_m(one.end_m, train.length_m) + CLEAR_M for one in held]
    ).clip(first_m, last_m)
    start_m = np.unique(np.concatenate([[first_m, last_m], entered_m, left_m]))
    limit_mps = np.full(start_m.size, train.maximum_speed_mps)
    for limit, enters, leaves in zip(held, entered_m, left_m, strict=True):
        pieces = slice(*np.searchsorted(start_m, [enters, leaves]))
        limit_mps[pieces] = np.minimum(limit_mps[pieces], limit.limit_mps)
    changes = np.append(True, np.diff(limit_mps) != 0.0)
    changes[-1] = True
    start_m, limit_mps = start_m[changes], limit_mps[changes]
    energy = 0.5 * np.square(limit_mps) + np.interp(start_m, grid_m, potential)
    energy[-1] = np.inf
    lowest = np.minimum.accumulate(energy[::-1])[::-1]
    # The piece that has the lowest energy is the last one with it from which it falls no more.
    places = np.where(energy == lowest, np.arange(energy.size), energy.size - 1)
    has_it = np.minimum.accumulate(places[::-1])[::-1]
    return Limits(start_m, limit_mps, lowest, limit_mps[has_it])


def _ceiling_m2ps2(limits: Limits, front_m: FloatArray, potential: FloatArray) -> FloatArray:
    last = limits.start_m.size - 2
    after = np.searchsorted(limits.start_m, front_m, side="right") - 1
    before = np.searchsorted(limits.start_m, front_m, side="left") - 1
    after, before = np.clip(after, 0, last), np.clip(before, 0, last)
    limit_mps = np.minimum(limits.limit_mps[after], limits.limit_mps[before])
    braked: FloatArray = limits.lowest_m2ps2[after + 1] - potential
    return np.minimum(0.5 * np.square(limit_mps), braked)


def _mean_over_train(values: FloatArray, cells: float) -> FloatArray:
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))])
    columns = np.arange(values.size, dtype=np.float64)
    behind = np.interp(columns - cells, columns, integral, left=np.nan)
    # Level run-out before the line: the integral continues with the first value.
    before = integral[0] + (columns - cells) * values[0]
    mean: FloatArray = (integral - np.where(np.isnan(behind), before, behind)) / cells
    return mean


def _run_out_m(train_types: Sequence[TrainType]) -> float:
    braking_m = (0.5 * kind.maximum_speed_mps**2 / kind.service_brake_mps2 for kind in train_types)
    return max(RUN_OUT_M, float(np.ceil(max(braking_m))) + BEYOND_BRAKING_M)


def build_profile(
    line: Line | Sequence[Line], train_types: Sequence[TrainType], buffers: Buffers = NO_BUFFERS
) -> Profile:
    """
    Tabulate a line for some train types.

    Parameters
    ----------
    line
        The line; or the line as each of the types meets it, all of the same extent.
    train_types
        One row of the tables each.
    buffers
        By how much the train counts as longer than it is where limits start and end.

    Returns
    -------
    Profile
        The tables.
    """
    lines = [line] * len(train_types) if isinstance(line, Line) else line
    run_out_m = _run_out_m(train_types)
    origin_m = np.floor(lines[0].start_m - run_out_m)
    columns = int(np.ceil((lines[0].end_m + run_out_m - origin_m) / SPACING_M)) + 2
    grid_m = origin_m + SPACING_M * np.arange(columns)
    potentials, lifts, ceilings, limits, drags, curve_drags = [], [], [], [], [], []
    for train, met in zip(train_types, lines, strict=True):
        height_m = met.height_m(grid_m)
        curves_mps2 = met.curve_resistance_mps2(grid_m, curve_resistance_m=train.curve_resistance_m)
        cells = train.length_m / SPACING_M
        gravity = GRAVITY_MPS2 * train.gravity_ratio
        mean_height_m = _mean_over_train(height_m, cells)
        lift = gravity * mean_height_m
        braked = train.service_brake_mps2 * (grid_m - origin_m)
        potential = braked if train.net_brake else braked + lift
        held = _limits_of(met, train, grid_m, potential, buffers)
        curve_drag = train.gravity_ratio * _mean_over_train(curves_mps2, cells)
        potentials.append(potential)
        lifts.append(lift)
        ceilings.append(_ceiling_m2ps2(held, grid_m, potential))
        limits.append(held)
        curve_drags.append(curve_drag)
        drags.append(gravity * np.gradient(mean_height_m, SPACING_M) + curve_drag)
    return Profile(
        float(origin_m),
        np.array(potentials),
        np.array(lifts),
        np.array(ceilings),
        tuple(limits),
        np.array(drags),
        np.array(curve_drags),
        np.array([train.service_brake_mps2 for train in train_types]),
    )
