"""A controller is the same as an operation in the loop, by steps, and through an environment."""

import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kankaku.analysis.tables.run_tables import RunTables, run_tables
from kankaku.controllers.registry import build
from kankaku.live.agent_link import AgentLink
from kankaku.live.line_advice import LineAdvice
from kankaku.live.line_view import LineView
from kankaku.live.policy_operation import PolicyOperation
from kankaku.live.simulation import Simulation
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.plan.dwell import DwellDelays, Overstay
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.studies.opening import NO_SUMO, foresight_of, world_of
from kankaku.testing.example_lines import merge_scenario
from kankaku.testing.toy_engine import ToyEngine

SPEC = ControllerSpec("test", "moving_block", "close_up", {}, {})
LATE = DwellDelays(overstays=(Overstay("T1", "east", 60.0), Overstay("T2", "west", 15.0)))
LINE = merge_scenario(4, 60.0, delays=LATE, step_s=0.5)
SLOW_MPS = 12.5
"""The same in single precision, in which environments take their actions."""


def policy(view: LineView) -> LineAdvice:
    """Slow whoever is near the end of its authority, or late."""
    near = view.running & (view.eoa_m - view.front_m < 600.0)
    late = view.delay_s > 20.0
    return LineAdvice(ceiling_mps=np.where(near | late, SLOW_MPS, np.inf))


def bytes_of(tables: RunTables) -> dict[str, str]:
    return {name: frame.to_csv() for name, frame in tables.frames.items()}


def in_the_loop(operation: Any) -> RunTables:  # noqa: ANN401 - builds one from world and foresight
    """Run an operation of one's own as any other."""
    world = world_of(LINE, LINE.step_s)
    delays_s = LINE.dwell_delays.draw(LINE.timetable, 1)
    bare = build(SPEC, world)
    run = Run(world, delays_s, 1, LINE.patience_s)
    engine = ToyEngine(world, delays_s, LINE.step_s)
    controller = replace(bare, operation=operation(world, bare.protection))
    record = simulate(run, engine, controller, all_meters(world))
    return run_tables(replace(record, foresight=foresight_of(bare)))


@pytest.mark.parametrize("interval_s", [0.5, 10.0])
def test_a_policy_is_the_same_as_operation_by_steps_and_in_an_environment(
    interval_s: float,
) -> None:
    whole = in_the_loop(lambda world, _: PolicyOperation(world, policy, interval_s, ("outside",)))
    stepped = Simulation(LINE, SPEC, 1, interval_s=interval_s, engine=NO_SUMO)
    for view in stepped:
        stepped.step(policy(view))
    link = AgentLink(LINE, SPEC, interval_s=interval_s, actions=("ceiling",))
    link.begin(1)
    while not link.simulation.over:
        asked_mps = np.asarray(policy(link.simulation.state).ceiling_mps)
        action = np.minimum(asked_mps[:, None], link.highest).astype(np.float32)
        link.act(action.astype(np.float64))
    slowed = whole.trajectory["plan"] == "outside"
    assert slowed.any()
    assert not slowed.all()
    assert bytes_of(stepped.tables()) == bytes_of(whole)
    assert bytes_of(link.simulation.tables()) == bytes_of(whole)


def test_the_example_operation_is_the_same_by_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    example = Path(__file__).parents[2] / "docs" / "examples" / "own_operation"
    monkeypatch.syspath_prepend(str(example))
    kankaku_steady: Any = import_module("kankaku_steady")
    options = kankaku_steady.SteadyOptions(steady_kmh=36.0)
    whole = in_the_loop(lambda world, foresight: kankaku_steady.Steady(world, options, foresight))
    stepped = Simulation(LINE, SPEC, 1, interval_s=0.5, engine=NO_SUMO, words=("steady",))
    for view in stepped:
        near = view.running & (view.eoa_m - view.front_m < options.near_m)
        ceiling_mps = np.where(near, options.steady_kmh / 3.6, np.inf)
        stepped.step(LineAdvice(ceiling_mps=ceiling_mps, cause=view.eoa_by))
    sys.modules.pop("kankaku_steady")
    assert (whole.trajectory["plan"] == "steady").any()
    assert bytes_of(stepped.tables()) == bytes_of(whole)


def test_an_operation_that_would_hold_trains_is_refused() -> None:
    def holds(view: LineView) -> LineAdvice:
        return LineAdvice(hold_until_s=view.time_s + 10.0)

    with pytest.raises(ValueError, match="holds no train at its platform"):
        in_the_loop(lambda world, _: PolicyOperation(world, holds, 10.0, ("outside",)))
