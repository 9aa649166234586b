"""Looking ahead only now and then sees what looking in every step sees."""

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest

from kankaku.controllers.registry import build
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Protection
from kankaku.railway.step.state import Authority, LineState
from kankaku.railway.wayside.detection import Detection
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from kankaku.testing.loop_station import loop_station_scenario
from tests.examples import all_if_deep
from tests.property.runs import run

SCENARIOS: dict[str, Callable[[], Scenario]] = {
    "one track": lambda: two_station_scenario(4, 70.0, block_m=90.0),
    "merge": lambda: merge_scenario(4, 60.0, block_m=130.0),
    "loop station": lambda: loop_station_scenario(4, 70.0, one_starts_inside=True, block_m=250.0),
}


class Compared:
    """A protection beside which somebody looks in every step."""

    def __init__(self, world: World, honest: Protection[Any]) -> None:
        self._detection = Detection(world)
        self._honest = honest
        self.looks, self.steps = 0, 0

    def initial(self) -> Any:  # noqa: ANN401
        return self._detection.blind(), self._detection.initial(), self._honest.initial()

    def authorise(self, state: LineState, memory: Any) -> tuple[Authority, Any]:  # noqa: ANN401
        detection, (before, seen, honest) = self._detection, memory
        seen = detection.look(state.time_s, state.front_m, state.tail_m, state.present, seen)
        wanted_m = detection.danger_m(
            state.front_m, state.tail_m, state.present, state.granted_to_m, seen
        )
        sight = detection.look_ahead(state, before)
        assert np.array_equal(sight.danger_m, wanted_m)
        self.steps += 1
        self.looks += sight is not before
        authority, honest = self._honest.authorise(state, honest)
        return authority, (sight, seen, honest)


PROTECTIONS = ("multi_step_atc", "atd", "digital_atc")
STEPS = [*product([0.1, 0.5], PROTECTIONS)]
# Short steps take five times as long, and the detection is the same under every protection.
STEPS_ONCE = [(0.1, "digital_atc"), *product([0.5], PROTECTIONS)]


@pytest.mark.parametrize("make", SCENARIOS.values(), ids=SCENARIOS)
@pytest.mark.parametrize("release_s", [0.0, 0.3, 2.0])
@pytest.mark.parametrize(("step_s", "protection"), all_if_deep(STEPS, STEPS_ONCE))
def test_what_is_seen_now_and_then_is_what_is_seen_always(
    make: Callable[[], Scenario], release_s: float, step_s: float, protection: str
) -> None:
    given = make()
    line = replace(given.line, release_delay_s=release_s)
    scenario = replace(given, line=line, step_s=step_s)
    world = world_of(scenario)
    honest = build(ControllerSpec("x", protection, "close_up", {}, {}), world)
    compared = Compared(world, honest.protection)
    delay_s = np.zeros((world.size, int(world.call_count.max())))
    delay_s[:2, 1] = 70.0, 40.0
    record, _ = run(scenario, controller=replace(honest, protection=compared), delay_s=delay_s)
    assert record.completed.all()
    assert compared.looks < 0.6 * compared.steps
