"""What the recorder keeps: samples every second, and every step exactly once."""

from itertools import pairwise

import numpy as np
import pytest

from kankaku.railway.loop.recorder import Recorder
from kankaku.railway.loop.tracker import Tracker
from kankaku.railway.step.reasons import DWELLING
from kankaku.railway.step.state import Reason
from kankaku.railway.step.step_block import BLOCK_STEPS, StepBlock
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.property.runs import controller_of, run


class Keeper:
    """Keeps the blocks it is shown."""

    def __init__(self) -> None:
        self.blocks: list[StepBlock] = []

    def add(self, block: StepBlock) -> None:
        self.blocks.append(block)


def test_every_step_is_examined_once_and_blocks_share_their_edge() -> None:
    scenario = two_station_scenario(4, 200.0)
    world = world_of(scenario)
    _, engine = run(scenario)
    assert len(engine.seen) > BLOCK_STEPS
    controller, keeper, tracker = controller_of(world), Keeper(), Tracker(world)
    drive, recorder = controller.drive, Recorder(world, controller, (keeper,))
    memory = controller.protection.initial()
    for seen in engine.seen:
        state = tracker.update(seen)
        authority, memory = controller.protection.authorise(state, memory)
        advice, _ = controller.operation.advise(state, authority, None)
        recorder.write(state, authority, advice, drive.command(state, authority, advice))
    recorder.flush()
    blocks = keeper.blocks
    assert len(blocks) > 1
    for one, other in pairwise(blocks):
        assert one.time_s[-1] == other.time_s[0]
    times = np.concatenate([blocks[0].time_s[:1]] + [block.time_s[1:] for block in blocks])
    assert times.tolist() == engine.time_s.tolist()
    assert recorder.train_steps == sum(int(block.present.sum()) for block in blocks)


def test_samples_lie_on_the_run_and_name_a_reason() -> None:
    record, engine = run(two_station_scenario(1))
    sample = record.trajectory
    assert np.all(np.diff(sample.time_s) == pytest.approx(1.0))
    fronts_m = np.interp(sample.time_s, engine.time_s, engine.front_m[:, 0])
    assert sample.front_m == pytest.approx(fronts_m)
    reasons = set(sample.reason.tolist())
    assert reasons <= set(map(int, Reason))
    standing = sample.reason == DWELLING
    assert np.all(sample.speed_mps[standing] == 0.0)
    # It stands 30 s at west, and from its early arrival until 150 s at east.
    expected_s = 30.0 + (25_200.0 + 150.0 - record.arrival_s[0, 1])
    assert np.count_nonzero(standing) == pytest.approx(expected_s, abs=2.0)
    assert {Reason.TRACTION, Reason.STATION_STOP, Reason.LINE_LIMIT} >= reasons - {DWELLING}


def test_a_run_that_ends_with_the_last_step_of_a_block_leaves_no_empty_block() -> None:
    scenario = two_station_scenario(4, 200.0)
    world = world_of(scenario)
    _, engine = run(scenario)
    controller, keeper, tracker = controller_of(world), Keeper(), Tracker(world)
    drive = controller.drive
    recorder = Recorder(world, controller, (keeper,))
    memory = controller.protection.initial()
    for seen in engine.seen[: BLOCK_STEPS + 1]:
        state = tracker.update(seen)
        authority, memory = controller.protection.authorise(state, memory)
        advice, _ = controller.operation.advise(state, authority, None)
        recorder.write(state, authority, advice, drive.command(state, authority, advice))
    recorder.flush()
    assert [block.present.shape[0] for block in keeper.blocks] == [BLOCK_STEPS]
