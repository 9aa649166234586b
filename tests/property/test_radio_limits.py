"""Whatever the radio loses, nobody may go further than with knowledge of everything."""

from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from kankaku.controllers.protection.moving_block import MovingBlock, MovingBlockOptions
from kankaku.railway.plan.radio_spec import RadioSpec
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import Authority, LineState
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from kankaku.testing.loop_station import loop_station_scenario
from tests.examples import examples
from tests.property.runs import controller_of, run

LINES = {
    "one track": lambda: two_station_scenario(4, 70.0),
    "merge": lambda: merge_scenario(4, 60.0),
    "loop station": lambda: loop_station_scenario(4, 70.0, one_starts_inside=True),
}


class Compared:
    """Compares every limit with that of a moving block that knows the true places."""

    def __init__(self, world: World, protection: Any) -> None:  # noqa: ANN401
        self._protection = protection
        self._plain = MovingBlock(world, MovingBlockOptions())
        self.gaps_m: list[float] = []

    def initial(self) -> Any:  # noqa: ANN401 - the memories of both
        return self._protection.initial(), self._plain.initial()

    def authorise(self, state: LineState, memory: Any) -> tuple[Authority, Any]:  # noqa: ANN401
        authority, by_radio = self._protection.authorise(state, memory[0])
        plain, true = self._plain.authorise(state, memory[1])
        # Who has heard nothing yet is to stay where it stands.
        most_m = np.maximum(plain.eoa_m, state.front_m)
        self.gaps_m += (most_m - authority.eoa_m)[state.present].tolist()
        assert np.array_equal(authority.ceiling_mps, plain.ceiling_mps)
        return authority, (by_radio, true)


@example("merge", 0.25, 3.0, 0.0, 0.0, [0.0, 0.0, 39.0, *[0.0] * 12])
@examples(12)
@given(
    st.sampled_from(list(LINES)),
    st.floats(0.0, 0.4),
    st.floats(1.0, 5.0),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
    st.lists(st.floats(0.0, 120.0), min_size=15, max_size=15),
)
def test_never_an_earlier_permission_than_with_the_true_places(
    name: str, loss: float, burst: float, one_s: float, other_s: float, drawn_s: list[float]
) -> None:
    scenario = LINES[name]()
    spec = RadioSpec(1.0, min(one_s, other_s), max(one_s, other_s), loss, burst)
    world = world_of(scenario)
    honest = controller_of(world, radio=spec)
    compared = Compared(world, honest.protection)
    services = scenario.timetable.services
    delay_s = np.resize(drawn_s, (len(services), max(len(s.calls) for s in services)))
    controller = replace(honest, protection=compared)
    record, _ = run(scenario, controller=controller, delay_s=delay_s, radio=spec)
    assert min(compared.gaps_m) >= -1e-9
    assert max(compared.gaps_m) > 1.0
    assert record.violations == ()
    assert record.completed.all()
