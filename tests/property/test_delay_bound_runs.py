"""No run is ahead of the bound of its arrivals, whatever the delays, the way and the style."""

from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.analysis.tables.delay import technical_run_times_s
from kankaku.railway.capacity.delay_bound import arrival_bounds_s
from kankaku.railway.plan.driving_style import FASTEST, DrivingStyle
from kankaku.railway.plan.line import Gradient, SpeedLimit
from kankaku.testing.example_lines import merge_scenario, world_of
from tests.examples import examples
from tests.property.runs import controller_of, run

if TYPE_CHECKING:
    from kankaku.railway.step.control import Foresight

QUICK = examples(4)
HURRYING = DrivingStyle(
    "hurrying",
    station_brake_mps2=0.8,
    below_limit_mps=1.0,
    coasting_band_mps=2.0,
    departure_reaction_s=1.0,
    late_after_s=20.0,
)


@pytest.mark.parametrize("operation", ["close_up", "two_stage"])
@QUICK
@given(
    st.sampled_from(["moving_block", "multi_step_atc", "relative_braking"]),
    st.sampled_from([FASTEST, HURRYING]),
    st.floats(40.0, 110.0),
    st.lists(st.floats(0.0, 120.0), min_size=8, max_size=8),
)
def test_no_train_arrives_before_its_bound(
    operation: str, protection: str, style: DrivingStyle, headway_s: float, drawn_s: list[float]
) -> None:
    scenario = merge_scenario(4, headway_s, block_m=200.0)
    line = replace(
        scenario.line,
        gradients=(Gradient(450.0, 900.0, 0.012), Gradient(900.0, 1700.0, -0.012)),
        limits=(SpeedLimit(700.0, 800.0, 14.0),),
    )
    scenario = replace(scenario, line=line, driving=style)
    world = world_of(scenario)
    controller = controller_of(world, operation, protection)
    record, _ = run(scenario, controller=controller, delay_s=np.array(drawn_s).reshape(4, 2))
    known = replace(record, foresight=cast("Foresight", controller.protection))
    bound_s = arrival_bounds_s(known, technical_run_times_s(world))
    assert np.all(record.arrival_s[:, 1:] >= bound_s[:, 1:] - 1e-9)
