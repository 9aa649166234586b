"""
Times that lie apart as they must, and as nearly as they can as they usually do.

In units of five seconds all constraints are differences of two times with whole bounds, so their
matrix is totally unimodular and the linear programme has a whole-numbered solution.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_array

UNIT_S = 5
"""Working timetables of Japanese metropolitan lines are written in steps of 5 s. [s]"""
PENALTY_STEPS_S = (0, 10, 25)
"""Each deviation counts once more beyond each of these. [s]"""


@dataclass
class DifferenceProgramme:
    """A linear programme over differences of unknown times, in whole units."""

    unknowns: int
    rows: list[tuple[int, int, int, int]] = field(default_factory=list)
    """Later, earlier, slack (or -1), greatest difference."""
    weights: list[float] = field(default_factory=list)

    def at_least(self, later: int, earlier: int, units: int) -> None:
        """
        Let one time lie after another one.

        Parameters
        ----------
        later, earlier
            Numbers of the unknowns.
        units
            Least difference. [units]
        """
        self.rows.append((earlier, later, -1, -units))

    def prefer(
        self,
        later: int,
        earlier: int,
        units: int,
        *,
        only_short: bool = False,
        weight: float = 1.0,
    ) -> None:
        """
        Let one time lie after another one, if it can.

        Parameters
        ----------
        later, earlier
            Numbers of the unknowns.
        units
            Difference. [units]
        only_short
            Whether a greater difference is as good.
        weight
            What a unit of deviation costs, again beyond each of ``PENALTY_STEPS_S``. [-]
        """
        for step_s in PENALTY_STEPS_S:
            room = step_s // UNIT_S
            self._penalise(earlier, later, room - units, weight)
            if not only_short:
                self._penalise(later, earlier, room + units, weight)

    def _penalise(self, later: int, earlier: int, units: int, weight: float) -> None:
        self.rows.append((later, earlier, self.unknowns + len(self.weights), units))
        self.weights.append(weight)

    def solve(self, bounds: Sequence[tuple[float, float]], refusal: str) -> list[int]:
        """
        Return the unknown times.

        Parameters
        ----------
        bounds
            Least and greatest time of each unknown. [units]
        refusal
            What to say if there is no solution.

        Returns
        -------
        list[int]
            One by unknown. [units]

        Raises
        ------
        ValueError
            If no times obey, with that and the solver's word.
        """
        count = len(self.rows)
        later, earlier, slack, most = (np.array(part) for part in zip(*self.rows, strict=True))
        slack_rows = np.flatnonzero(slack >= 0)
        entries = np.concatenate([np.ones(count), -np.ones(count), -np.ones(slack_rows.size)])
        where = (
            np.concatenate([np.arange(count), np.arange(count), slack_rows]),
            np.concatenate([later, earlier, slack[slack_rows]]),
        )
        shape = (count, self.unknowns + len(self.weights))
        # The stubs of linprog do not know that it takes sparse matrices.
        matrix: Any = coo_array((entries, where), shape=shape).tocsr()
        # Uneven little costs leave one best solution, whatever the solver's path.
        tie_break = 1e-4 * ((np.arange(1, self.unknowns + 1) * 0.618033988749895) % 1.0 - 0.5)
        result = linprog(
            np.concatenate([tie_break, self.weights]),
            A_ub=matrix,
            b_ub=most,
            bounds=[*bounds, *((0.0, None) for _ in self.weights)],
            method="highs-ds",
        )
        if result.x is None:
            message = f"{refusal}: {result.message}"
            raise ValueError(message)
        times = result.x[: self.unknowns]
        if np.max(np.abs(times - np.round(times))) > 1e-6:
            message = "the solver returned a solution between whole units"
            raise ValueError(message)
        return [int(time) for time in np.round(times)]
