"""Trains of two types on one line with limits and gradients: each keeps its own bounds."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.controllers.registry import OPERATIONS
from kankaku.railway.plan.line import Gradient, SpeedLimit
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.timetable import Timetable
from kankaku.testing.example_lines import commuter_train, merge_scenario, world_of
from tests.examples import examples
from tests.property.runs import run

QUICK = examples(8)
SLOW_MPS = 17.0


def mixed_fleet(scenario: Scenario) -> Scenario:
    """Every second train is shorter, slower and brakes harder."""
    other = replace(
        commuter_train(length_m=120.0, brake_mps2=1.2), id="short", maximum_speed_mps=SLOW_MPS
    )
    services = tuple(
        replace(service, train_type="short" if index % 2 else "commuter")
        for index, service in enumerate(scenario.timetable.services)
    )
    return replace(
        scenario,
        train_types={**scenario.train_types, "short": other},
        timetable=Timetable(services),
        line=replace(
            scenario.line,
            gradients=(Gradient(500.0, 1000.0, 0.004), Gradient(1000.0, 1700.0, -0.004)),
            limits=(SpeedLimit(600.0, 800.0, 15.0),),
        ),
    )


@pytest.mark.parametrize("operation", OPERATIONS)
@QUICK
@given(st.floats(40.0, 100.0), st.lists(st.floats(0.0, 90.0), min_size=8, max_size=8))
def test_trains_of_two_types_keep_their_own_bounds(
    operation: str, headway_s: float, drawn_s: list[float]
) -> None:
    scenario = mixed_fleet(merge_scenario(4, headway_s))
    record, engine = run(scenario, operation, delay_s=np.array(drawn_s).reshape(4, 2))
    assert record.violations == ()
    assert record.completed.all()
    assert engine.speed_mps[:, [1, 3]].max() <= SLOW_MPS + 1e-9
    assert engine.speed_mps[:, [0, 2]].max() > SLOW_MPS
    assert np.nanmax(np.abs(record.stop_error_m)) <= 0.3


def test_the_row_of_a_train_does_not_change_how_it_runs_alone() -> None:
    """The same short train, first or second in the fleet tables."""
    scenario = mixed_fleet(merge_scenario(2, 900.0))
    swapped = replace(scenario, train_types=dict(reversed(list(scenario.train_types.items()))))
    assert world_of(scenario).type_index.tolist() == [0, 1]
    assert world_of(swapped).type_index.tolist() == [1, 0]
    one, other = run(scenario)[1], run(swapped)[1]
    assert other.front_m == pytest.approx(one.front_m, abs=1e-6)
