"""Steps in bundles: the same bytes as step by step, and only where an offer says what is done."""

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from kankaku.controllers.drive import TractionDrive
from kankaku.controllers.operation.close_up import CloseUp
from kankaku.controllers.protection.moving_block import MovingBlock
from kankaku.controllers.registry import OPERATIONS, PROTECTIONS, SUPERVISIONS, build
from kankaku.railway.arrays import FloatArray
from kankaku.railway.loop.bundling import Bundling
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.plan.disruptions import Disruptions, Obstacle
from kankaku.railway.plan.line import Crossing
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.scenario import UNSUPERVISED, ControllerSpec, Scenario
from kankaku.railway.step.bundles import offered
from kankaku.railway.step.records import RunRecord
from kankaku.testing.example_lines import merge_scenario, world_of
from kankaku.testing.loop_station import loop_station_scenario
from kankaku.testing.toy_engine import ToyEngine
from tests.examples import examples
from tests.property.manners import any_style
from tests.property.runs import Observed

QUICK = examples(8)
PAIRS = [
    *((protection, "close_up") for protection in PROTECTIONS),
    *(
        ("moving_block", operation)
        for operation in OPERATIONS
        if operation not in {"close_up", "clairvoyant"}
    ),
]
"""Each layer once: whatever stands above or below it is compiled with it, but not another one."""
LINES = {
    "merge": merge_scenario(4, 70.0, block_m=200.0, step_s=0.5),
    "loop": loop_station_scenario(4, 70.0, one_starts_inside=True, block_m=250.0),
}


def run(scenario: Scenario, spec: ControllerSpec, delay_s: FloatArray, wrap: Any) -> RunRecord:  # noqa: ANN401 - an engine's
    world = world_of(scenario).driven_as(spec.driving)
    whole = Run(world, delay_s, 0, scenario.patience_s, scenario.disruptions, scenario.radio)
    engine = wrap(ToyEngine(world, delay_s, scenario.step_s))
    return simulate(whole, engine, build(spec, world, scenario.radio, delay_s), all_meters(world))


def arrays_of(told: object, where: str = "") -> dict[str, bytes]:
    """Every number of a record, by its place."""
    if isinstance(told, np.ndarray):
        return {where: told.tobytes()}
    if is_dataclass(told):
        parts = [(field.name, getattr(told, field.name)) for field in fields(told)]
    elif isinstance(told, tuple):
        parts = [(str(place), one) for place, one in enumerate(told)]
    else:
        return {where: repr(told).encode()}
    found: dict[str, bytes] = {}
    for name, part in parts:
        if name not in {"world", "foresight"}:
            found |= arrays_of(part, f"{where}.{name}")
    return found


def assert_same_both_ways(
    scenario: Scenario, spec: ControllerSpec, delay_s: FloatArray
) -> RunRecord:
    at_once = run(scenario, spec, delay_s, lambda engine: engine)
    step_by_step = run(scenario, spec, delay_s, Observed)
    assert arrays_of(at_once) == arrays_of(step_by_step)
    return at_once


def delays_s(scenario: Scenario) -> FloatArray:
    world = world_of(scenario)
    delay_s = np.zeros((world.size, world.stop_m.shape[1] - 1))
    delay_s[0, :] = 45.0
    delay_s[1, -1] = 60.0
    return delay_s


@pytest.fixture
def taken(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many steps each bundle took."""
    steps: list[int] = []
    take = Bundling.take

    def counted(*arguments: Any) -> Any:  # noqa: ANN401 - as the method
        found = take(*arguments)
        steps.append(found[0])
        return found

    monkeypatch.setattr(Bundling, "take", counted)
    return steps


@pytest.mark.parametrize(("protection", "operation"), [*PAIRS, ("control_map", "control_map")])
def test_tables_are_the_same_step_by_step(
    protection: str, operation: str, taken: list[int]
) -> None:
    scenario = LINES["merge"]
    spec = ControllerSpec("test", protection, operation, {}, {})
    record = assert_same_both_ways(scenario, spec, delays_s(scenario))
    assert record.completed.all()
    steps = record.end_s - 25_200.0
    assert sum(taken) > 0.5 * steps / scenario.step_s


@pytest.mark.parametrize("supervision", [name for name in SUPERVISIONS if name != UNSUPERVISED])
def test_tables_are_the_same_where_trains_are_held(supervision: str, taken: list[int]) -> None:
    spec = ControllerSpec("test", "moving_block", "close_up", {}, {}, supervision=supervision)
    assert_same_both_ways(LINES["merge"], spec, delays_s(LINES["merge"]))
    assert sum(taken) > 0


def test_tables_are_the_same_with_a_margin_of_energy(taken: list[int]) -> None:
    spec = ControllerSpec("test", "moving_block", "two_stage", {}, {}, eco_margin_s=2.0)
    assert_same_both_ways(LINES["merge"], spec, delays_s(LINES["merge"]))
    assert sum(taken) > 0


def test_tables_are_the_same_with_points_and_a_sudden_obstacle(taken: list[int]) -> None:
    scenario = LINES["loop"]
    line = replace(scenario.line, crossings=(Crossing("road", 700.0, 708.0, 250.0, 10.0),))
    obstacle = Obstacle("road", 25_362.0, 25_390.0)
    scenario = replace(scenario, line=line, disruptions=Disruptions(obstacles=(obstacle,)))
    for protection in ("moving_block", "multi_step_atc", "control_map"):
        spec = ControllerSpec("test", protection, "close_up", {}, {})
        assert_same_both_ways(scenario, spec, delays_s(scenario))
    assert sum(taken) > 0


@QUICK
@given(
    any_style(),
    st.sampled_from(PAIRS),
    st.tuples(st.floats(45.0, 100.0), st.sampled_from([0.1, 0.2, 0.3, 0.5])),
    st.lists(st.floats(0.0, 100.0), min_size=6, max_size=6),
)
def test_any_traffic_is_the_same_step_by_step(
    style: Any,  # noqa: ANN401 - a driving style
    pair: tuple[str, str],
    times_s: tuple[float, float],
    drawn_s: list[float],
) -> None:
    # A radio whose cycle the step does not divide is refused.
    assume(pair[0] != "control_map" or times_s[1] in {0.1, 0.5})
    scenario = merge_scenario(3, times_s[0], block_m=200.0, step_s=times_s[1])
    scenario = replace(scenario, driving=style)
    spec = ControllerSpec("test", *pair, {}, {})
    assert_same_both_ways(scenario, spec, np.array(drawn_s).reshape(3, 2))


class SlowerDrive(TractionDrive):
    """Commands something else than the class above, whose offer knows nothing of it."""

    def command(self, *arguments: Any) -> Any:  # noqa: ANN401 - as the class above
        return super().command(*arguments)


class Handing:
    """Hands on all that it is asked."""

    def __init__(self, layer: object) -> None:
        self._layer = layer

    def authorise(self, *arguments: Any) -> Any:  # noqa: ANN401 - as the layer
        return self._layer.authorise(*arguments)  # type: ignore[attr-defined]

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        return getattr(self._layer, name)


def test_an_offer_counts_only_for_what_it_stands_for() -> None:
    world = world_of(LINES["merge"])
    spec = ControllerSpec("test", "moving_block", "close_up", {}, {})
    controller = build(spec, world)
    assert isinstance(controller.protection, MovingBlock)
    assert isinstance(controller.operation, CloseUp)
    assert offered(controller.protection, "steps", "authorise")
    assert offered(controller.operation, "steps", "advise")
    assert offered(controller.drive, "steps", "command")
    assert not offered(SlowerDrive(world), "steps", "command")
    assert not offered(Handing(controller.protection), "steps", "authorise")
    controller.protection.authorise = controller.protection.authorise  # type: ignore[method-assign]
    assert not offered(controller.protection, "steps", "authorise")


def test_an_engine_that_watches_is_asked_in_every_step(taken: list[int]) -> None:
    scenario = LINES["merge"]
    spec = ControllerSpec("test", "moving_block", "close_up", {}, {})
    watched: list[Observed] = []

    def watch(engine: ToyEngine) -> Observed:
        watched.append(Observed(engine))
        return watched[0]

    record = run(scenario, spec, delays_s(scenario), watch)
    assert not taken
    steps = round((record.end_s - watched[0].time_s[0]) / scenario.step_s)
    assert len(watched[0].seen) == steps + 1
