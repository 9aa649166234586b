"""Why trains were as fast as they were, a sample a second, for a block of steps."""

from collections.abc import Sequence

import numpy as np

from kankaku.railway.arrays import BoolArray, IntArray
from kankaku.railway.loop.compiled_loop import Sampling
from kankaku.railway.step.reasons import Reasons, nothing_found
from kankaku.railway.step.state import NO_REASON
from kankaku.railway.step.step_block import BLOCK_STEPS


class SampledReasons:
    """
    Keeps the samples of a block, whether a step was made in Python or in a bundle.

    Parameters
    ----------
    reasons
        Finds them, and refuses what no layer may say.
    size
        Number of trains. [-]
    every
        Steps from one sample to the next. [-]
    """

    def __init__(self, reasons: Reasons, size: int, every: int) -> None:
        most = BLOCK_STEPS // every + 2
        self._reasons, self._every = reasons, every
        self._found = nothing_found(most, size)
        self._asked = np.zeros((most, 2, size), dtype=np.intp)
        self._asked[:, 0] = NO_REASON
        self.until = 0
        """Steps from the next one to the next one that is sampled. [-]"""
        self.at: list[int] = []
        """The steps of the block that were sampled."""

    def stepped(self) -> None:
        """Take note of a step, after its sample if there was one."""
        self.until = (self.until or self._every) - 1

    def take(self, at: int, found: IntArray) -> None:
        """
        Keep the sample of a step.

        Parameters
        ----------
        at
            The step of the block.
        found
            From :meth:`~kankaku.railway.step.reasons.Reasons.of`. shape (3, n_trains)
        """
        self._found[len(self.at)] = found
        self.at.append(at)

    def space(self) -> Sampling:
        """
        Return where a bundle writes its samples.

        Returns
        -------
        Sampling
            Of trains that are not on the line nothing is written.
        """
        taken = len(self.at)
        return Sampling(self.until, self._every, self._found[taken:], self._asked[taken:])

    def wrote(self, at: int, samples: int, until: int) -> None:
        """
        Take note of samples that a bundle wrote.

        Parameters
        ----------
        at
            The first step of the bundle in the block.
        samples
            How many. [-]
        until
            Steps from the next one to the next sample. [-]

        Raises
        ------
        ReasonError
            If a speed is lowered for no reason, or for what is neither a train nor a place.
        """
        if samples:
            written = slice(len(self.at), len(self.at) + samples)
            self._reasons.check_sampled(self._found[written], self._asked[written])
            first = at + self.until
            self.at.extend(range(first, first + samples * self._every, self._every))
        self.until = until

    def since(self, sample: int) -> Sequence[IntArray]:
        """
        Return samples of the block.

        Parameters
        ----------
        sample
            Number of the first one. [-]

        Returns
        -------
        Sequence[IntArray]
            Each of shape (3, n_trains); they stay as they are.
        """
        return list(self._found[sample : len(self.at)].copy())

    def told(self, present: BoolArray) -> IntArray:
        """
        Return what the samples tell of the trains that are on the line, and begin a block anew.

        Parameters
        ----------
        present
            Who is there. shape (n_samples, n_trains)

        Returns
        -------
        IntArray
            Sample by sample, then train by train. shape (3, n_told)
        """
        found, asked = self._found[: len(self.at)], self._asked[: len(self.at)]
        told: IntArray = found.transpose(1, 0, 2)[:, present]
        rows = np.flatnonzero(present.any(axis=0))
        found[:, :, rows] = nothing_found(1, rows.size)
        asked[:, 0, rows], asked[:, 1, rows] = NO_REASON, 0
        self.at.clear()
        return told
