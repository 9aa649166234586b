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
