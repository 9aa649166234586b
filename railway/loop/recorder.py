"""Records every step cheaply, and hands whole blocks of steps to those who examine them."""

from collections.abc import Sequence
from typing import Protocol, TypeAlias

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import formula
from kankaku.railway.loop.compiled_loop import BlockRows, Sampling
from kankaku.railway.loop.sampled_reasons import SampledReasons
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Command, Controller
from kankaku.railway.step.reasons import Reasons
from kankaku.railway.step.records import Trajectory
from kankaku.railway.step.state import NO_VERSION, Advice, Authority, LineState
from kankaku.railway.step.step_block import BLOCK_STEPS, Examiner, StepBlock

_Lasting: TypeAlias = tuple[IntArray, BoolArray, BoolArray]
"""Of every train the next call, whether a sudden obstruction surprises it, and whether it runs."""


class Listener(Protocol):
    """Whoever wants to hear of steps before a block of them is full."""

    @property
    def wants_blocks(self) -> bool:
        """It wants to hear of more than reasons."""
        ...

    def hear(self, block: StepBlock | None, reasons: Sequence[IntArray]) -> None:
        """
        Hear of the steps since the last time.

        Parameters
        ----------
        block
            The steps; its first row is the last one of the block before. None if nobody wants them.
        reasons
            Why trains were as fast as they were, a sample a second, as from
            :meth:`~kankaku.railway.step.reasons.Reasons.of`. shape (3, n_trains) each
        """
        ...


class Recorder:
    """Keeps a block of states, and a sample of the trajectory every second."""

    def __init__(
        self,
        world: World,
        controller: Controller,
        examiners: Sequence[Examiner],
        places: tuple[str, ...] = (),
    ) -> None:
        self._reasons = Reasons(controller, world.size, len(places))
        self._places = places
        self._examiners = examiners
        shape = (BLOCK_STEPS + 1, world.size)
        self._time_s = np.empty(BLOCK_STEPS + 1)
        self._front_m, self._speed_mps, self._eoa_m, self._delay_s = np.zeros((4, *shape))
        # Before a train enters, whoever measures all steps of it needs a place on its way.
        self._front_m[:] = world.stop_m[:, 0]
        self._heard_s = np.full(shape, np.inf)
        self._next_call = np.zeros(shape, dtype=np.intp)
        self._present, self._running, self._surprised = np.zeros((3, *shape), dtype=np.bool_)
        self._emergency = np.zeros(shape, dtype=np.bool_)
        self._written = 0
        self._filled = 0
        self._versions = (NO_VERSION, NO_VERSION, NO_VERSION)
        self._present_now: BoolArray = np.zeros(world.size, dtype=np.bool_)
        self._lasting: _Lasting | None = None
        self._heard_now_s: FloatArray | None = None
        """When the commands were sent that each train has heard; None without a radio. [s]"""
        every = max(1, round(1.0 / world.step_s))
        self._sampled = SampledReasons(self._reasons, world.size, every)
        self._samples: list[tuple[FloatArray | IntArray, ...]] = []
        self.train_steps = 0
        self._listeners: list[Listener] = []
        self._heard_to = self._reasons_to = 0

    def let_hear(self, listener: "Listener") -> None:
        """
        Let somebody hear of all steps from now on, whenever :meth:`tell` is called.

        Parameters
        ----------
        listener
            It changes nothing of what is examined.
        """
        self._heard_to, self._reasons_to = max(self._written - 1, 0), len(self._sampled.at)
        self._listeners.append(listener)

    def tell(self) -> None:
        """Tell the listeners of the steps since they were told last."""
        if not self._listeners or self._written - self._heard_to < 2:
            return
        block, reasons = None, self._sampled.since(self._reasons_to)
        if any(listener.wants_blocks for listener in self._listeners):
            self._fill()
            block = self._rows(slice(self._heard_to, self._written))
        for listener in self._listeners:
            listener.hear(block, reasons)
        self._heard_to, self._reasons_to = self._written - 1, len(self._sampled.at)

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
        self._reasons.check(advice)
        at = self._written
        if self._sampled.until == 0:
            self._sampled.take(at, self._reasons.of(state, authority, advice, command))
        self._sampled.stepped()
        # Copied at once: arrays that are kept alive for a block cost more than their copies.
        self._time_s[at] = state.time_s
        self._front_m[at] = state.front_m
        self._speed_mps[at] = state.speed_mps
        self._eoa_m[at] = authority.eoa_m
        self._delay_s[at] = authority.delay_s
        self._emergency[at] = authority.permission.emergency
        radio = state.radio
        telegrams = NO_VERSION if radio is None else radio.telegrams_version
        versions = state.calls_version, state.wayside_version, telegrams
        if versions != self._versions:
            self._fill()
            self._versions = versions
            self._present_now = state.present
            self._lasting = (
                state.next_call,
                state.wayside.surprised,
                state.running,
            )
            self._heard_now_s = None if radio is None else radio.heard_s
        self._written += 1
        if self._written > BLOCK_STEPS:
            self.flush()

    def space(self, wanted: int) -> tuple[int, BlockRows, Sampling]:
        """
        Return how many steps may be written in one go, and where.

        Parameters
        ----------
        wanted
            No more are wanted. [-]

        Returns
        -------
        tuple[int, BlockRows, Sampling]
            At least one step, and where they and samples of them go.
        """
        at = self._written
        arrays = self._time_s, self._front_m, self._speed_mps, self._eoa_m, self._delay_s
        steps = min(BLOCK_STEPS + 1 - at, wanted)
        return steps, BlockRows(at, *arrays), self._sampled.space()

    def heard_rows(self) -> FloatArray:
        """
        Return where a bundle writes when the commands were sent that trains have.

        Returns
        -------
        FloatArray
            As :meth:`space` says; what lasts is written up to there. [s], (n_rows, n_trains)
        """
        self._fill()
        return self._heard_s

    def heard(self, steps: int) -> None:
        """
        Take note, before :meth:`wrote`, that a bundle has written what trains have heard.

        Parameters
        ----------
        steps
            How many it took. [-]
        """
        end = self._written + steps
        self._fill_to(end)
        self._heard_now_s = self._heard_s[end - 1].copy()

    def wrote(self, steps: int, samples: int, until_sample: int) -> None:
        """
        Take note of steps that were written in one go.

        Parameters
        ----------
        steps
            How many. [-]
        samples
            How many of them were sampled. [-]
        until_sample
            Steps from the next one to the next sample. [-]
        """
        at = self._written
        self._emergency[at : at + steps] = False
        self._sampled.wrote(at, samples, until_sample)
        self._written += steps
        if self._written > BLOCK_STEPS:
            self.flush()

    def _fill(self) -> None:
        """Write what lasts from event to event for the steps since it was written last."""
        if self._heard_now_s is not None:
            self._heard_s[self._filled : self._written] = self._heard_now_s
        self._fill_to(self._written)

    def _fill_to(self, end: int) -> None:
        """Write what lasts, but for what trains have heard, for the steps up to one."""
        if self._lasting and self._filled < end:
            steps = self._filled, end
            self._present[slice(*steps)] = self._present_now
            written = self._next_call, self._surprised, self._running
            _write_lasting(steps, np.flatnonzero(self._present_now), self._lasting, written)
        self._filled = end

    def flush(self) -> None:
        """Hand the steps so far to the examiners."""
        self._fill()
        self.tell()
        if self._sampled.at:
            self._samples.append(self._sample())
        block = self._block()
        self.train_steps += int(np.count_nonzero(block.present))
        # A run may end with the last step of a block.
        if block.present.size:
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
        time_s, row, front_m, speed_mps, eoa_m, reason, plan, cause = map(
            np.concatenate, zip(*self._samples, strict=True)
        )
        return Trajectory(
            time_s,
            row,
            front_m,
            speed_mps,
            eoa_m,
            reason,
            plan,
            cause,
            self._reasons.words,
            self._places,
        )

    def _sample(self) -> tuple[FloatArray | IntArray, ...]:
        """Return the samples among what was written."""
        at = list(self._sampled.at)
        present = self._present[at]
        sample, row = present.nonzero()
        return (
            self._time_s[at][sample],
            row,
            self._front_m[at][present],
            self._speed_mps[at][present],
            self._eoa_m[at][present],
            *self._sampled.told(present),
        )

    def _block(self) -> StepBlock:
        """Return what was written, and begin the next block with the last of it."""
        block = self._rows(slice(self._written))
        for written in (
            self._time_s,
            self._front_m,
            self._speed_mps,
            self._eoa_m,
            self._delay_s,
            self._next_call,
            self._surprised,
            self._present,
            self._running,
            self._heard_s,
            self._emergency,
        ):
            written[0] = written[self._written - 1]
        self._written = self._filled = 1
        self._heard_to = self._reasons_to = 0
        return block

    def _rows(self, steps: slice) -> StepBlock:
        """Return some of what was written."""
        rows = np.flatnonzero(self._present[steps].any(axis=0))
        present, running = self._present[steps, rows], self._running[steps, rows]
        stays = present[:-1] & present[1:]
        moving = stays & running[:-1]
        return StepBlock(
            rows,
            self._time_s[steps].copy(),
            self._front_m[steps, rows],
            self._speed_mps[steps, rows],
            self._eoa_m[steps, rows],
            self._delay_s[steps, rows],
            self._next_call[steps, rows],
            self._surprised[steps, rows],
            stays,
            moving,
            moving & ~running[1:],
            self._heard_s[steps, rows],
            self._emergency[steps, rows],
        )


@formula
def _write_lasting(
    steps: tuple[int, int],
    rows: IntArray,
    lasting: _Lasting,
    written: _Lasting,
) -> None:
    """
    Write what lasts into some steps of a block, for the trains on the line.

    Of shape (n_trains,) each, and of shape (n_steps, n_trains) where they are written to.
    """
    next_call, surprised, running = lasting
    calls, surprises, runs = written
    for step in range(steps[0], steps[1]):
        for row in rows:
            calls[step, row], surprises[step, row] = next_call[row], surprised[row]
            runs[step, row] = running[row]
