"""Records every step cheaply, and hands whole blocks of steps to those who examine them."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from railway.arrays import BoolArray, FloatArray, IntArray
from railway.control import Command, Drive
from railway.records import Trajectory
from railway.state import Advice, Authority, LineState
from railway.world import World

Element = TypeVar("Element", bound=np.generic)
BLOCK_STEPS = 300
DWELLING = -1


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
    limit_m: FloatArray
    """End of authority. [m]"""
    next_call: IntArray
    present: BoolArray
    """The train is on the line before and after the step. shape (n_steps, n_columns)"""
    moving: BoolArray
    """Present and not held by a stop during the step. shape (n_steps, n_columns)"""
    halting: BoolArray
    """Moving, and held by a stop after the step. shape (n_steps, n_columns)"""


class Examiner(Protocol):
    """Whoever looks at every step."""

    def add(self, block: StepBlock) -> None:
        """Examine a block of steps."""
        ...


class Recorder:
    """Keeps a block of states, and a sample of the trajectory every second."""

    def __init__(self, world: World, drive: Drive, examiners: Sequence[Examiner]) -> None:
        self._drive = drive
        self._examiners = examiners
        self._states: list[LineState] = []
        self._limits_m: list[FloatArray] = []
        self._until_sample = 0
        self._sample_every = max(1, round(1.0 / world.step_s))
        self._samples: list[tuple[float, IntArray, FloatArray, FloatArray, IntArray]] = []
        self.train_steps = 0

    def write(
        self, state: LineState, authority: Authority, advice: Advice, command: Command
    ) -> None:
        """
        Record the start of a step.

        Parameters
        ----------
        state
            The line.
        authority
            What protection permits.
        advice
            What operation asks for.
        command
            What the drive makes of it.
        """
        self._states.append(state)
        self._limits_m.append(authority.limit_m)
        if self._until_sample == 0:
            self._sample(state, advice, command)
            self._until_sample = self._sample_every
        self._until_sample -= 1
        if len(self._states) > BLOCK_STEPS:
            self.flush()

    def flush(self) -> None:
        """Hand the steps so far to the examiners."""
        block = _block(self._states, self._limits_m)
        # The last state is the first of the next block.
        del self._states[:-1], self._limits_m[:-1]
        self.train_steps += int(np.count_nonzero(block.present))
        if block.rows.size:
            for examiner in self._examiners:
                examiner.add(block)

    def trajectory(self) -> Trajectory:
        """
        Return the samples.

        Returns
        -------
        Trajectory
            Ordered by time, then train.
        """
        times = [np.full(sample[1].size, sample[0]) for sample in self._samples]
        columns = [np.concatenate(part) for part in list(zip(*self._samples, strict=True))[1:]]
        return Trajectory(np.concatenate(times), *columns)

    def _sample(self, state: LineState, advice: Advice, command: Command) -> None:
        rows = np.flatnonzero(state.present)
        if rows.size:
            reason = np.where(state.running, self._drive.reason(command, advice), DWELLING)
            self._samples.append(
                (state.time_s, rows, state.front_m[rows], state.speed_mps[rows], reason[rows])
            )


def _block(states: Sequence[LineState], limits_m: Sequence[FloatArray]) -> StepBlock:
    present = _rows([state.present for state in states])
    rows = np.flatnonzero(present.any(axis=0))
    present = present[:, rows]
    running = _rows([state.running for state in states])[:, rows]
    stays = present[:-1] & present[1:]
    moving = stays & running[:-1]
    return StepBlock(
        rows,
        np.array([state.time_s for state in states]),
        _rows([state.front_m for state in states])[:, rows],
        _rows([state.speed_mps for state in states])[:, rows],
        _rows(limits_m)[:, rows],
        _rows([state.next_call for state in states])[:, rows],
        stays,
        moving,
        moving & ~running[1:],
    )


def _rows(arrays: Sequence[npt.NDArray[Element]]) -> npt.NDArray[Element]:
    # Several times faster than np.array of the list.
    return np.concatenate(arrays).reshape(len(arrays), -1)
