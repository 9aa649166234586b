"""Blocks of steps train by train, as they are examined."""

from typing import Any, NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.step.step_block import StepBlock


class TrainSteps(NamedTuple):
    """A block of steps, train by train: (n_columns, n_steps + 1), as ``StepBlock`` otherwise."""

    rows: IntArray
    time_s: FloatArray
    front_m: FloatArray
    speed_mps: FloatArray
    eoa_m: FloatArray
    delay_s: FloatArray
    next_call: IntArray
    surprised: BoolArray
    present: BoolArray
    moving: BoolArray
    halting: BoolArray
    heard_s: FloatArray
    emergency: BoolArray


class Moves(NamedTuple):
    """How far trains come in a block of steps; arrays of shape (n_columns,)."""

    tail_m: FloatArray
    """The hindmost place of each tail. [m]"""
    front_m: FloatArray
    """The foremost place of each front. [m]"""

    def outside(self, ends_m: tuple[float, float]) -> tuple[BoolArray, BoolArray]:
        """
        Return who is outside of a stretch in all steps.

        Parameters
        ----------
        ends_m
            Its start and end. [m]

        Returns
        -------
        tuple[BoolArray, BoolArray]
            Who is before it, and who beyond it. shapes (n_columns,)
        """
        return self.front_m <= ends_m[0], self.tail_m >= ends_m[1]


def by_train(block: StepBlock) -> TrainSteps:
    """
    Return a block of steps train by train.

    Parameters
    ----------
    block
        The steps.

    Returns
    -------
    TrainSteps
        Views, where the block was written train by train.
    """
    turned: list[Any] = [np.ascontiguousarray(values.T) for values in block]
    return TrainSteps(*turned)


def moves_of(steps: TrainSteps, length_m: FloatArray) -> Moves:
    """
    Return how far trains come in a block of steps.

    Parameters
    ----------
    steps
        The steps.
    length_m
        Lengths of the trains. [m], shape (n_columns,)

    Returns
    -------
    Moves
        Not-a-number for trains that are in no place.
    """
    front_m = steps.front_m
    return Moves(front_m.min(axis=1) - length_m, front_m.max(axis=1))
