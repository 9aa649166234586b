"""The tables of all sites that a run has met, in one stack for compiled functions."""

import hashlib
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from kankaku.controllers.stochastic.approach_site import PlatformSite, PlatformWay
from kankaku.controllers.stochastic.belief import Belief
from kankaku.controllers.stochastic.run_in import Costs
from kankaku.controllers.stochastic.waiting import Tables, make_tables
from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import Plain, compiled, plain

NO_SITE = -1
MOST_MADE = 64
"""Sites whose tables a process keeps from run to run."""
_MADE: dict[bytes, Tables] = {}
ARRAYS = ("drag_mps2", "pull_mps2", "coast_mps2")
NUMBERS = tuple(name for name in PlatformWay._fields if name not in ARRAYS)


class Stack(NamedTuple):
    """Approaches and tables, one site after the other; see their classes."""

    numbers: FloatArray
    """The numbers of each approach. shape (n_sites, n_numbers)"""
    drag_mps2: FloatArray
    pull_mps2: FloatArray
    coast_mps2: FloatArray
    top_mps: FloatArray
    during: FloatArray
    hazards: FloatArray
    before: FloatArray
    excess_s: FloatArray


class SiteTables:
    """Sites by key, worked out when they are met first."""

    def __init__(self) -> None:
        self._numbers: dict[tuple[object, ...], int] = {}
        self.sites: list[PlatformSite] = []
        self.stack: Plain = ()
        """Of :class:`Stack`, plain; empty before the first site."""

    def number(
        self, key: tuple[object, ...], make: Callable[[], tuple[PlatformSite, Tables] | None]
    ) -> int:
        """
        Return the number of a site.

        Parameters
        ----------
        key
            What makes it another one.
        make
            Works it out; called once for each key.

        Returns
        -------
        int
            Its place in the stack; ``NO_SITE`` where there is nothing to plan.
        """
        if key not in self._numbers:
            made = make()
            self._numbers[key] = NO_SITE if made is None else len(self.sites)
            if made is not None:
                self._add(*made)
        return self._numbers[key]

    def _add(self, site: PlatformSite, tables: Tables) -> None:
        approach = site.approach
        numbers = np.array([getattr(approach, name) for name in NUMBERS])
        row = (numbers, *(getattr(approach, name) for name in ARRAYS), *tables)
        self.sites.append(site)
        new = [np.asarray(part)[None] for part in row]
        if self.stack:
            new = [np.concatenate(pair) for pair in zip(self.stack, new, strict=True)]
        self.stack = plain(Stack(*new))


def tables_of(
    site: PlatformSite, belief: Belief, scale: float, costs: Costs, sizes: tuple[FloatArray, int]
) -> Tables:
    """
    Return the tables of a site; see :func:`~kankaku.controllers.stochastic.waiting.make_tables`.

    They are made once for the same content: runs of many seeds in one process share them.

    Parameters
    ----------
    site
        The site.
    belief
        What is expected of the leader's delay.
    scale
        Factor on that. [-]
    costs
        What things cost.
    sizes
        Speed caps for running in [m/s], and from how many times of an overstay to plan.

    Returns
    -------
    Tables
        Not to be written to.
    """
    content = hashlib.sha256(repr((belief, scale, costs, sizes[1])).encode())
    for part in (*site.approach, site.stop_m, site.permitted_v2, sizes[0]):
        content.update(np.asarray(part, dtype=np.float64).tobytes())
    key = content.digest()
    if key not in _MADE:
        while len(_MADE) >= MOST_MADE:
            del _MADE[next(iter(_MADE))]
        _MADE[key] = make_tables(site, belief, scale, costs, sizes)
    return _MADE[key]


@compiled
def approach_of(stack: Stack, number: int) -> PlatformWay:
    """
    Return the approach of a site.

    Parameters
    ----------
    stack
        Of all sites.
    number
        Of the site.

    Returns
    -------
    PlatformWay
        With its names.
    """
    numbers = stack.numbers[number]
    return PlatformWay(
        numbers[0],
        numbers[1],
        numbers[2],
        stack.drag_mps2[number],
        stack.pull_mps2[number],
        stack.coast_mps2[number],
        numbers[3],
        numbers[4],
        numbers[5],
        numbers[6],
        numbers[7],
        numbers[8],
        numbers[9],
        numbers[10],
    )
