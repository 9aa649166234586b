"""
How hard trains brake: what gradients add to a rate, and what a climb alone takes.

A brake's rate is one on the level, to which gravity adds, or a *net* one that is reached on any
gradient. Whoever has a net brake may still lose more speed than that: on a climb that its traction
does not hold against.
"""

import numpy as np

from kankaku.railway.arrays import GRAVITY_MPS2, FloatArray, IntArray
from kankaku.railway.plan.world import World


class Brakes:
    """The brakes of all trains."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._gravity_mps2 = GRAVITY_MPS2 * world.of_type("brake_gravity_ratio")
        self._net = world.of_type("net_brake") > 0.0
        sharpest_m = min((curve.radius_m for curve in world.line.curves), default=np.inf)
        weight = GRAVITY_MPS2 * world.of_type("gravity_ratio")
        self._curves_mps2 = weight * world.of_type("curve_resistance_m") / sharpest_m

    def gravity_mps2(self, rows: IntArray) -> FloatArray:
        """
        Return what a gradient adds to the brakes of trains.

        Parameters
        ----------
        rows
            The trains. shape (n_columns,)

        Returns
        -------
        FloatArray
            For a gradient of 1; 0 for net brakes. [m/s2], shape (n_columns,)
        """
        return self._gravity_mps2[rows]

    def strongest_mps2(
        self, rate_mps2: FloatArray, slope: FloatArray, speed_mps: FloatArray, rows: IntArray
    ) -> FloatArray:
        """
        Return how much speed trains may lose that brake at a rate at most.

        Parameters
        ----------
        rate_mps2
            Rates of their brakes. [m/s2], shape (n_columns,)
        slope
            Mean gradients under them, rising positive. [-], shape (n_steps, n_columns)
        speed_mps
            How fast they are at most. [m/s], same shape
        rows
            The trains. shape (n_columns,)

        Returns
        -------
        FloatArray
            Deceleration. [m/s2], same shape
        """
        most_mps2 = rate_mps2 + self._gravity_mps2[rows] * slope
        net = np.flatnonzero(self._net[rows])
        if net.size:
            climbing_mps2 = self._climbing_mps2(slope[:, net], speed_mps[:, net], rows[net])
            most_mps2[:, net] = np.maximum(most_mps2[:, net], climbing_mps2)
        return most_mps2

    def _climbing_mps2(
        self, slope: FloatArray, speed_mps: FloatArray, rows: IntArray
    ) -> FloatArray:
        """Return what trains lose at most with all their traction. [m/s2]"""
        world, kinds = self._world, self._world.type_index[rows]
        weight = GRAVITY_MPS2 * world.of_type("gravity_ratio")[rows]
        lost_mps2 = weight * slope + self._curves_mps2[rows]
        for index, kind in enumerate(world.train_types):
            columns = np.flatnonzero(kinds == index)
            lost_mps2[:, columns] -= kind.level_acceleration_mps2(speed_mps[:, columns])
        return lost_mps2
