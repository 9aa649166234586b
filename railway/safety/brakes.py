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
        self._service_mps2 = world.of_type("service_brake_mps2")
        self._build_up_s = world.of_type("brake_build_up_s")
        self._net = world.of_type("net_brake") > 0.0
        sharpest_m = min((curve.radius_m for curve in world.line.curves), default=np.inf)
        weight = GRAVITY_MPS2 * world.of_type("gravity_ratio")
        self._curves_mps2 = weight * world.of_type("curve_resistance_m") / sharpest_m

    @property
    def build_up(self) -> bool:
        """Whether any brake needs time until it is whole."""
        return bool(self._build_up_s.any())

    def rising_m(
        self, slope: FloatArray, speed_mps: FloatArray, gained_mps2: FloatArray, rows: IntArray
    ) -> FloatArray:
        """
        Return how much further trains run because their service brakes build up.

        What of a brake is not there yet comes evenly, in its share of the build-up.

        Parameters
        ----------
        slope
            Gradients under them, rising positive. [-], shape (n_steps, n_columns)
        speed_mps
            Their speeds. [m/s], same shape
        gained_mps2
            How much faster they are getting. [m/s2], same shape
        rows
            The trains. shape (n_columns,)

        Returns
        -------
        FloatArray
            Beyond the braking distance; 0 for who stands before the brake is whole.
            [m], same shape
        """
        build_up_s, rate_mps2 = self._build_up_s[rows], self._service_mps2[rows]
        whole_mps2 = rate_mps2 + self.gravity_mps2(rows) * slope
        rise_s = build_up_s * np.clip((whole_mps2 + gained_mps2) / rate_mps2, 0.0, None)
        rising_mps3 = np.divide(
            rate_mps2, build_up_s, out=np.zeros(rows.size), where=build_up_s > 0.0
        )
        first_mps2 = whole_mps2 - rising_mps3 * rise_s
        then_mps = speed_mps - first_mps2 * rise_s - 0.5 * rising_mps3 * rise_s**2
        risen_m = (speed_mps - 0.5 * first_mps2 * rise_s - rising_mps3 * rise_s**2 / 6.0) * rise_s
        further_m = risen_m + 0.5 * (np.square(then_mps) - np.square(speed_mps)) / whole_mps2
        return np.where(then_mps > 0.0, further_m, 0.0)

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
