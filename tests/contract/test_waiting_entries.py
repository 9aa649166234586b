"""Trains that wait until they can enter: the same bytes, whether or not each step is looked at."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import kankaku
from kankaku.analysis.tables.run_tables import run_tables
from kankaku.controllers.registry import build
from kankaku.live.line_advice import nothing_asked
from kankaku.live.outside_layers import OutsideOperation
from kankaku.railway.loop.bundling import Bundling
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.studies.opening import world_of
from kankaku.testing.example_lines import merge_scenario
from kankaku.testing.toy_engine import ToyEngine
from tests.property.runs import Observed

SPEC = ControllerSpec("test", "moving_block", "close_up", {}, {})


def tables(scenario: Scenario, slow_mps: float, wrap: Any) -> dict[str, str]:  # noqa: ANN401 - an engine's
    world = world_of(scenario, 0.5)
    delays_s = np.zeros_like(world.minimum_dwell_s[:, :-1])
    bare = build(SPEC, world)
    slowed = OutsideOperation(bare.operation, world, ("outside",))
    ceiling_mps = np.where(np.arange(world.size) % 2, np.inf, slow_mps)
    slowed.ask(nothing_asked(world.size)._replace(ceiling_mps=ceiling_mps))
    run = Run(world, delays_s, 1, 600.0)
    engine = wrap(ToyEngine(world, delays_s, 0.5))
    record = simulate(run, engine, replace(bare, operation=slowed), all_meters(world))
    return {name: frame.to_csv() for name, frame in run_tables(record).frames.items()}


@pytest.mark.parametrize(
    ("name", "slow_mps"), [("merge", 1.5), ("branch", 0.4), ("overtaking", 0.4)]
)
def test_trains_enter_in_the_same_step(
    name: str, slow_mps: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    merge = merge_scenario(6, 60.0, step_s=0.5)
    scenario = merge if name == "merge" else kankaku.load(name)
    late: list[float] = []
    take = Bundling.take

    def noted(self: Bundling, seen: Any, *others: Any) -> Any:  # noqa: ANN401 - as the method
        taken = take(self, seen, *others)
        booked_s = self._engine._world.booked_arrival_s  # noqa: SLF001
        waiting = self._engine._waiting  # noqa: SLF001
        if taken[0] and waiting and booked_s[waiting[0], 0] < seen.time_s - 1.0:
            late.append(taken[0])
        return taken

    monkeypatch.setattr(Bundling, "take", noted)
    at_once = tables(scenario, slow_mps, lambda engine: engine)
    # Somebody waited, and steps were taken in one go meanwhile.
    assert sum(late) > 50
    assert tables(scenario, slow_mps, Observed) == at_once
