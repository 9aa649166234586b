"""What SUMO sees of trains that have met, and whether it has them where we have them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.step.engine_contract import Observation

AGREEMENT_M = 1e-3
"""SUMO and the integration of our commands may differ by rounding only. [m]"""


class EngineDisagreementError(RuntimeError):
    """SUMO did something else than it was told, or when it was not expected to."""


class Agreement:
    """
    Compares places, and takes note of collisions; what SUMO does after one is its own affair.

    Parameters
    ----------
    row_of
        Rows of the timetable by vehicle.
    """

    def __init__(self, row_of: Mapping[str, int]) -> None:
        self._row_of = row_of
        self.colliding: frozenset[int] = frozenset()
        """Trains that collide in SUMO's last step."""
        self.met: set[int] = set()
        """Trains that have collided at any time."""
        self._untold: set[int] = set()

    def ask(self, collisions: Callable[[], Sequence[Any]]) -> None:
        """
        Take what SUMO is asked by.

        Parameters
        ----------
        collisions
            Returns the collisions of its last step.
        """
        self._collisions = collisions

    def look(self) -> None:
        """Take note of who has collided in SUMO's last step."""
        found = self._collisions()
        if not found and not self.colliding:
            return
        colliding = frozenset(
            self._row_of[train] for one in found for train in (one.collider, one.victim)
        )
        fresh = colliding - self.colliding
        self.colliding = colliding
        self.met |= fresh
        self._untold |= fresh

    def told_in(self, seen: Observation) -> Observation:
        """
        Return an observation with the collisions that no earlier one has told.

        Parameters
        ----------
        seen
            What else is to be told.

        Returns
        -------
        Observation
            The same, or with ``collided``.
        """
        if not self._untold:
            return seen
        told, self._untold = tuple(sorted(self._untold)), set()
        return seen._replace(collided=told)

    def refuse_apart(
        self,
        rows: IntArray | Sequence[int],
        vehicles: Sequence[str],
        apart_m: FloatArray,
        now_s: float,
    ) -> None:
        """
        Refuse trains that are elsewhere in SUMO.

        Parameters
        ----------
        rows, vehicles
            The trains. shape (n,)
        apart_m
            How far their places differ. [m], shape (n,)
        now_s
            The moment. [s]

        Raises
        ------
        EngineDisagreementError
            If one is, and has not collided.
        """
        if self.met:
            apart_m = np.where(np.isin(rows, list(self.met)), 0.0, apart_m)
        if apart_m.max(initial=0.0) > AGREEMENT_M:
            train = vehicles[int(apart_m.argmax())]
            msg = f"{train} is {apart_m.max():.3f} m off its commands at {now_s:.1f} s"
            raise EngineDisagreementError(msg)
