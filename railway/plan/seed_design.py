"""How seeds share what they draw: each for itself, in mirrored pairs, or in strata."""

from dataclasses import dataclass

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.plan.design_names import INDEPENDENT, LATIN_HYPERCUBE, REPLICATE_SIZES
from kankaku.railway.randomness import stream

_LEAST = 2.0**-53
"""So far u stays away from 0 and 1, where normal scores have no end. [-]"""


@dataclass(frozen=True, slots=True)
class SeedDesign:
    """
    How the seeds of a study share their draws.

    A single seed draws the same distribution in every design; designs differ in how the seeds of
    a replicate hang together. A mean over whole replicates is unbiased, and its spread is that of
    the means of replicates.

    References
    ----------
    .. [1] Hammersley and Morton, *A new Monte Carlo technique: antithetic variates*, Proc. Camb.
       Phil. Soc. 52, 1956.
    .. [2] McKay, Beckman and Conover, *A comparison of three methods for selecting values of input
       variables*, Technometrics 21, 1979.
    """

    name: str = INDEPENDENT
    """One of :data:`~kankaku.railway.plan.design_names.DESIGNS`."""
    phase: int = 0
    """Replicates begin at seeds that leave this rest when divided by their size. [-]"""

    @property
    def size(self) -> int:
        """Seeds of a replicate. [-]"""
        return REPLICATE_SIZES[self.name]

    def replicates(self, seeds: IntArray) -> IntArray:
        """
        Return in which replicates seeds are.

        Parameters
        ----------
        seeds
            Any seeds. [-], shape (n,)

        Returns
        -------
        IntArray
            The same number for seeds of one replicate. [-], shape (n,)
        """
        found: IntArray = (seeds - self.phase) // self.size
        return found

    def replicate_means(self, values: FloatArray, seeds: IntArray) -> FloatArray:
        """
        Return the means of whole replicates, which are independent.

        Parameters
        ----------
        values
            One for each seed. Any unit, shape (n,)
        seeds
            Different ones. [-], shape (n,)

        Returns
        -------
        FloatArray
            In order of the replicates; nan where one of the values is. Where every seed is a
            replicate of its own, the values as they stand. Same unit, shape (n_whole_replicates,)
        """
        if self.size == 1:
            return values
        _, replicate, members = np.unique(
            self.replicates(seeds), return_inverse=True, return_counts=True
        )
        sums = np.bincount(replicate, weights=values, minlength=members.size)
        means: FloatArray = sums[members == self.size] / self.size
        return means

    def told(self) -> dict[str, str | int]:
        """
        Return what results tell of it.

        Returns
        -------
        dict[str, str | int]
            Nothing where every seed draws for itself.
        """
        return {} if self.size == 1 else {"draws": self.name, "draws_phase": self.phase}

    def normal(self, seed: int, *key: str | int) -> float:
        """
        Draw a standard normal number.

        Parameters
        ----------
        seed
            Who draws. [-]
        *key
            What is drawn, as of :func:`~kankaku.railway.randomness.stream`.

        Returns
        -------
        float
            The same for the same seed and key, whatever else is drawn. [-]
        """
        place = (seed - self.phase) % self.size
        if self.name == LATIN_HYPERCUBE:
            return self._stratified(seed - place, place, key)
        score = float(stream(seed - place, *key).standard_normal())
        return -score if place else score

    def _stratified(self, first: int, place: int, key: tuple[str | int, ...]) -> float:
        from scipy.special import ndtri  # noqa: PLC0415 - takes long to import

        random = stream(first, LATIN_HYPERCUBE, *key)
        stratum, within = random.permutation(self.size)[place], random.random(self.size)[place]
        return float(ndtri(np.clip((stratum + within) / self.size, _LEAST, 1.0 - _LEAST)))


EACH_FOR_ITSELF = SeedDesign()
"""Independent seeds."""


def seed_design(name: str, first_seed: int) -> SeedDesign:
    """
    Return a design whose first replicate begins with a seed.

    Parameters
    ----------
    name
        One of :data:`~kankaku.railway.plan.design_names.DESIGNS`.
    first_seed
        That seed. [-]

    Returns
    -------
    SeedDesign
        Equal wherever the same replicates come of it.
    """
    return SeedDesign(name, first_seed % REPLICATE_SIZES[name])
