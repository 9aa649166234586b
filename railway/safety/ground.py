"""
What is under each train: heights and limits, looked up by chainage.

Protection looks at a line along the routes of its trains. The monitor does not believe what it
makes of that: it works out where a train lies on the line, and reads the line itself.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.plan.line import Direction, Gradient, Line, SpeedLimit
from kankaku.railway.plan.timetable import Service
from kankaku.railway.plan.world import World
from kankaku.railway.safety.heights import Heights, heights_of, mean_height_m
from kankaku.railway.safety.positions import lower_on


class Lie(NamedTuple):
    """Trains that lie on the same line in the same way."""

    line: Line
    """With the gradients of their tracks and the limits that they keep."""
    heights: Heights
    falling: bool


class Ground:
    """The line under the trains."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._lies: list[Lie] = []
        self._lie_of = np.zeros(world.size, dtype=np.intp)
        known: dict[tuple[object, ...], int] = {}
        for row, service in enumerate(world.timetable.services):
            key = _lies_on(world.line, service)
            if key not in known:
                falling, gradients, limits = key
                line = replace(world.line, gradients=gradients, limits=limits)
                known[key] = len(self._lies)
                self._lies.append(Lie(line, heights_of(line), falling))
            self._lie_of[row] = known[key]
        low_m, high_m = world.line.start_m, world.line.end_m
        self._turned_m = low_m + high_m

    def _by_lie(self, rows: IntArray) -> Iterator[tuple[Lie, IntArray | slice]]:
        if len(self._lies) == 1:
            yield self._lies[0], slice(None)
            return
        lies = self._lie_of[rows]
        for number in np.unique(lies).tolist():
            yield self._lies[number], np.flatnonzero(lies == number)

    def _upper_m(self, lie: Lie, front_m: FloatArray, length_m: FloatArray) -> FloatArray:
        """Return the end of each train that lies at the higher chainage. [m]"""
        return self._turned_m - front_m + length_m if lie.falling else front_m

    def mean_height_m(self, front_m: FloatArray, rows: IntArray) -> FloatArray:
        """
        Return the height of the track averaged over trains.

        Parameters
        ----------
        front_m
            Fronts. [m], shape (n_steps, n_columns)
        rows
            The trains. shape (n_columns,)

        Returns
        -------
        FloatArray
            [m], same shape
        """
        lengths_m, mean_m = self._world.length_m[rows], np.empty_like(front_m)
        for lie, columns in self._by_lie(rows):
            length_m = lengths_m[columns]
            upper_m = self._upper_m(lie, front_m[:, columns], length_m)
            mean_m[:, columns] = mean_height_m(upper_m, length_m, *lie.heights)
        return mean_m

    def rises_m(self, front_m: FloatArray, rows: IntArray) -> FloatArray:
        """
        Return by how much the fronts of trains are higher than their tails.

        Parameters
        ----------
        front_m
            Fronts. [m], shape (..., n_columns)
        rows
            The trains. shape (n_columns,)

        Returns
        -------
        FloatArray
            [m], same shape
        """
        lengths_m, rise_m = self._world.length_m[rows], np.empty_like(front_m)
        for lie, columns in self._by_lie(rows):
            length_m = lengths_m[columns]
            upper_m = self._upper_m(lie, front_m[..., columns], length_m)
            rise = lie.line.height_m(upper_m) - lie.line.height_m(upper_m - length_m)
            rise_m[..., columns] = -rise if lie.falling else rise
        return rise_m

    def lower_to_limits(self, lowest_mps: FloatArray, front_m: FloatArray, rows: IntArray) -> None:
        """
        Lower speeds to the limits that any part of each train is on.

        Parameters
        ----------
        lowest_mps
            Written. [m/s], shape (n_steps, n_columns)
        front_m
            Fronts. [m], same shape
        rows
            The trains. shape (n_columns,)
        """
        lengths_m = self._world.length_m[rows]
        for lie, columns in self._by_lie(rows):
            length_m, lowest = lengths_m[columns], lowest_mps[:, columns].copy()
            upper_m = self._upper_m(lie, front_m[:, columns], length_m)
            for limit in lie.line.limits:
                ends_m = limit.start_m, limit.end_m
                lower_on(upper_m, upper_m - length_m, ends_m, limit.limit_mps, lowest)
            lowest_mps[:, columns] = lowest


def _lies_on(
    line: Line, service: Service
) -> tuple[bool, tuple[Gradient, ...], tuple[SpeedLimit, ...]]:
    """Return whether a train falls, the gradients of its tracks, and the limits it has to keep."""
    limits = tuple(one for one in line.limits if one.train_type in {"", service.train_type})
    if not line.network:
        return False, line.gradients, limits
    tracks = [line.track_by_id[track] for track in service.route]
    names = {"", *(track.place for track in tracks)}
    gradients = sorted(
        (one for one in line.gradients if one.track in names), key=lambda one: one.start_m
    )
    limits = tuple(one for one in limits if one.track in names)
    return tracks[0].direction is Direction.FALLING, tuple(gradients), limits
