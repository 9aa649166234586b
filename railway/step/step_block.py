"""Blocks of consecutive steps, and whoever examines them."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray

BLOCK_STEPS = 1000


class StepBlock(NamedTuple):
    """
    Consecutive steps of the trains that were on the line in any of them.

    Arrays have shape (n_steps + 1, n_columns): the last row is the first of the next block,
    so that every step has its state before and after.
    """

    rows: IntArray
    """Train of each column. shape (n_columns,)"""
    time_s: FloatArray
    """Shape (n_steps + 1,). [s]"""
    front_m: FloatArray
    speed_mps: FloatArray
    eoa_m: FloatArray
    """End of authority. [m]"""
    delay_s: FloatArray
    """By how much running the front counts as further ahead of it. [s]"""
    next_call: IntArray
    surprised: BoolArray
    """A sudden obstruction may have come too near. shape (n_steps + 1, n_columns)"""
    present: BoolArray
    """The train is on the line before and after the step. shape (n_steps, n_columns)"""
    moving: BoolArray
    """Present and not held by a stop during the step. shape (n_steps, n_columns)"""
    halting: BoolArray
    """Moving, and held by a stop after the step. shape (n_steps, n_columns)"""
    heard_s: FloatArray = np.zeros(0)
    """When the commands were sent that the train has by radio; inf without a radio. [s]"""
    emergency: BoolArray = np.zeros(0, dtype=np.bool_)
    """Protection lets the train brake in emergency. shape (n_steps + 1, n_columns)"""


class Examiner(Protocol):
    """Whoever looks at every step."""

    def add(self, block: StepBlock) -> None:
        """Examine a block of steps."""
        ...


class Meter(Examiner, Protocol):
    """Whoever looks at every step and has measured something in the end."""

    def measured(self) -> Mapping[str, Any]:
        """Return what was measured, by field of ``RunRecord``."""
        ...
