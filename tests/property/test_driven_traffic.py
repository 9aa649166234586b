"""Dense traffic of trains that answer gradually, in any driving style: nobody is accused."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.controllers.drive import TractionDrive
from kankaku.controllers.manner import manner_of
from kankaku.railway.compiled import plain
from kankaku.railway.plan.driving_style import DrivingStyle
from kankaku.railway.plan.line import Gradient, SpeedLimit
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.world import World
from kankaku.testing.example_lines import commuter_train, merge_scenario, world_of
from tests.examples import examples
from tests.property.manners import answering, any_driven_speeds, any_style
from tests.property.runs import controller_of, run

QUICK = examples(6)
END_M = 2000.0
PROTECTIONS = ["moving_block", "atd", "digital_atc", "multi_step_atc"]
SLOW_BRAKE = replace(commuter_train(), brake_build_up_s=3.0)


def dense(train: TrainType, style: DrivingStyle, headway_s: float, step_s: float) -> Scenario:
    """Five trains that close up behind the first ones, through a merge and to a platform."""
    scenario = merge_scenario(5, headway_s, block_m=200.0, step_s=step_s)
    line = replace(
        scenario.line,
        gradients=(Gradient(450.0, 900.0, 0.012), Gradient(900.0, 1700.0, -0.012)),
        limits=(SpeedLimit(700.0, 800.0, 14.0),),
    )
    return replace(scenario, line=line, train_types={train.id: train}, driving=style)


@pytest.mark.parametrize("protection", PROTECTIONS)
@QUICK
@given(
    answering(commuter_train()),
    any_style(),
    any_driven_speeds(END_M),
    st.tuples(st.floats(35.0, 90.0), st.sampled_from([0.1, 0.2, 0.5])),
    st.lists(st.floats(0.0, 120.0), min_size=10, max_size=10),
)
def test_no_delay_makes_trains_meet_in_any_style(
    protection: str,
    train: TrainType,
    style: DrivingStyle,
    driven_speeds: tuple[SpeedLimit, ...],
    times_s: tuple[float, float],
    drawn_s: list[float],
) -> None:
    scenario = dense(train, style, *times_s)
    scenario = replace(scenario, line=replace(scenario.line, driven_speeds=driven_speeds))
    controller = controller_of(world_of(scenario), protection=protection)
    record, _ = run(scenario, controller=controller, delay_s=np.array(drawn_s).reshape(5, 2))
    assert [violation.message for violation in record.violations] == []
    assert record.completed.all()


def test_a_driver_eases_off_in_time_where_the_line_gets_steeper() -> None:
    gradual = replace(commuter_train(), jerk_mps3=0.375)
    scenario = dense(gradual, DrivingStyle(), 35.0, 0.1)
    controller = controller_of(world_of(scenario), protection="digital_atc")
    record, _ = run(scenario, controller=controller, delay_s=np.zeros((5, 2)))
    assert record.violations == ()


class Unready(TractionDrive):
    """Brakes for the end of its authority as if the whole brake were there at once."""

    def __init__(self, world: World) -> None:
        super().__init__(world)
        late = manner_of(world)
        never = np.full(world.size, np.inf)
        self._manner = plain(late._replace(rise_mps=never, hard_mps=never, jerk_mps=never))


def test_a_drive_that_forgets_the_build_up_is_accused() -> None:
    scenario = dense(SLOW_BRAKE, DrivingStyle(), 40.0, 0.1)
    delay_s = np.zeros((5, 2))
    delay_s[0, 1] = 150.0
    honest = controller_of(world_of(scenario))
    assert run(scenario, controller=honest, delay_s=delay_s)[0].violations == ()
    unready = replace(honest, drive=Unready(world_of(scenario)))
    kinds = {seen.kind for seen in run(scenario, controller=unready, delay_s=delay_s)[0].violations}
    assert kinds & {"authority", "spacing"}
