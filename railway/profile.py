"""
The line as one type of train meets it, tabulated once so that a step only interpolates.

A train of length L feels the height of the track averaged over its length,
``h(x) = mean of height over [x - L, x]``. With that, braking under gravity is energy
conservation, and the *brake potential* ``P(x) = b x + g h(x)`` turns every brake curve
towards any target into ``v^2 / 2 = P(target) - P(x)``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from railway.arrays import GRAVITY_MPS2, FloatArray, IntArray
from railway.buffers import Buffers
from railway.compiled import compiled
from railway.line import Line
from railway.rolling_stock import TrainType

SPACING_M = 1.0
"""One metre, so that a chainage is an index. [m]"""
NO_BUFFERS = Buffers()
RUN_OUT_M = 2500.0
"""Level track assumed beyond both ends, longer than any brake curve. [m]"""


@dataclass(frozen=True)
class Profile:
    """Tables over a uniform chainage grid, one row per train type, shape (n_types, n_grid)."""

    origin_m: float
    potential_m2ps2: FloatArray
    """Brake potential of the service brake. [m2/s2]"""
    ceiling_m2ps2: FloatArray
    """Half the square of the line ceiling, its braking curves included. [m2/s2]"""
    limit_mps: FloatArray
    """The limit in force, without braking curves to lower ones ahead. [m/s]"""
    drag_mps2: FloatArray
    """Deceleration by gradient and curves, mean over the train. [m/s2]"""
    curve_drag_mps2: FloatArray
    """The curves' part of it. [m/s2]"""

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

    def row_starts(self, type_index: IntArray) -> FloatArray:
        """
        Return what turns a chainage into a place in the flattened tables.

        Parameters
        ----------
        type_index
            Row of each train's type. [-], shape (n_trains,)

        Returns
        -------
        FloatArray
            Offset into the flattened tables, origin included. [-], shape (n_trains,)
        """
        columns = self.potential_m2ps2.shape[1]
        starts: FloatArray = type_index.astype(np.float64) * columns - self.origin_m
        return starts


@compiled
def at(table: FloatArray, place: float) -> float:
    """
    Interpolate in a flattened table.

    Parameters
    ----------
    table
        Ravelled table of a profile. shape (n_types * n_grid,)
    place
        Chainage plus the train's :meth:`Profile.row_starts`. [m]

    Returns
    -------
    float
        The value there.
    """
    cell = int(place)
    part = place - cell
    value: float = table[cell] + part * (table[cell + 1] - table[cell])
    return value


@compiled
def braking_loss_mps(square: FloatArray, place: float, speed_mps: float, step_s: float) -> float:
    """
    Return the speed that the service brake takes in a step under gravity.

    Parameters
    ----------
    square
        Ravelled table of twice the brake potential. [m2/s2], shape (n_types * n_grid,)
    place
        Chainage plus the train's :meth:`Profile.row_starts`. [m]
    speed_mps
        Speed at the start of the step. [m/s]
    step_s
        Length of the step. [s]

    Returns
    -------
    float
        Speed lost. [m/s]
    """
    # Half the rise of the squares over a metre is the brake rate; that of mid-step keeps
    # the train on its curve where the gradient changes.
    middle = place + 0.5 * speed_mps * step_s
    rise = at(square, middle + 0.5 * SPACING_M) - at(square, middle - 0.5 * SPACING_M)
    return 0.5 * step_s / SPACING_M * rise


@compiled
def at_each(table: FloatArray, chainage_m: FloatArray, row_start: FloatArray) -> FloatArray:
    """
    Interpolate in a flattened table for every train.

    Parameters
    ----------
    table
        Ravelled table of a profile. shape (n_types * n_grid,)
    chainage_m
        Where, within the tables. [m], shape (..., n_trains)
    row_start
        From :meth:`Profile.row_starts`. shape (n_trains,)

    Returns
    -------
    FloatArray
        The values, same shape as ``chainage_m``.
    """
    places = chainage_m + row_start
    values = np.empty_like(places)
    flat_places, flat_values = places.ravel(), values.ravel()
    for index in range(flat_places.size):
        flat_values[index] = at(table, flat_places[index])
    return flat_values.reshape(places.shape)


def _train_ceiling_mps(
    line: Line, train: TrainType, grid_m: FloatArray, step_s: float, buffers: Buffers
) -> FloatArray:
    ceiling = np.full(grid_m.shape, train.maximum_speed_mps)
    travel_m = train.maximum_speed_mps * step_s
    for limit in line.limits:
        start_m = float(buffers.front_limit_m(np.array(limit.start_m), limit.limit_mps))
        end_m = buffers.rear_limit_m(limit.end_m, train.length_m)
        first = np.floor((start_m - grid_m[0]) / SPACING_M)
        last = np.ceil((end_m + travel_m - grid_m[0]) / SPACING_M)
        inside = slice(max(int(first), 0), min(int(last) + 1, grid_m.size))
        ceiling[inside] = np.minimum(ceiling[inside], limit.limit_mps)
    return ceiling


def _mean_over_train(values: FloatArray, cells: float) -> FloatArray:
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))])
    columns = np.arange(values.size, dtype=np.float64)
    behind = np.interp(columns - cells, columns, integral, left=np.nan)
    # Level run-out before the line: the integral continues with the first value.
    before = integral[0] + (columns - cells) * values[0]
    mean: FloatArray = (integral - np.where(np.isnan(behind), before, behind)) / cells
    return mean


def build_profile(
    line: Line,
    train_types: Sequence[TrainType],
    step_s: float,
    buffers: Buffers = NO_BUFFERS,
) -> Profile:
    """
    Tabulate a line for some train types.

    Parameters
    ----------
    line
        The line.
    train_types
        One row of the tables each.
    step_s
        Length of a step: a limit that ends is kept until a whole step begins past it. [s]
    buffers
        By how much the train counts as longer than it is where limits start and end.

    Returns
    -------
    Profile
        The tables.
    """
    origin_m = np.floor(line.start_m - RUN_OUT_M)
    columns = int(np.ceil((line.end_m + RUN_OUT_M - origin_m) / SPACING_M)) + 2
    grid_m = origin_m + SPACING_M * np.arange(columns)
    height_m = line.height_m(grid_m)
    curves_mps2 = line.curve_resistance_mps2(grid_m)
    potentials, ceilings, limits, drags, curve_drags = [], [], [], [], []
    for train in train_types:
        cells = train.length_m / SPACING_M
        gravity = GRAVITY_MPS2 * train.gravity_ratio
        mean_height_m = _mean_over_train(height_m, cells)
        potential = train.service_brake_mps2 * (grid_m - origin_m) + gravity * mean_height_m
        limit = _train_ceiling_mps(line, train, grid_m, step_s, buffers)
        # The lowest of all brake curves that start at the limits ahead.
        lowest = np.minimum.accumulate((0.5 * np.square(limit) + potential)[::-1])[::-1]
        curve_drag = train.gravity_ratio * _mean_over_train(curves_mps2, cells)
        potentials.append(potential)
        ceilings.append(lowest - potential)
        limits.append(limit)
        curve_drags.append(curve_drag)
        drags.append(gravity * np.gradient(mean_height_m, SPACING_M) + curve_drag)
    tables = map(np.array, (potentials, ceilings, limits, drags, curve_drags))
    return Profile(float(origin_m), *tables)
