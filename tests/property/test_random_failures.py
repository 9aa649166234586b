"""Random failures on random days: nothing unsafe ever happens, and everybody arrives."""

from dataclasses import replace

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from kankaku.controllers.control_map.map_protection import ControlMapOptions
from kankaku.controllers.control_map.wrong_maps import WrongMaps
from kankaku.controllers.registry import build
from kankaku.railway.failures.random_failures import draw_failure
from kankaku.railway.failures.unit_failures import FailureMode, UnitFailure, Variant
from kankaku.railway.plan.radio_spec import LOSSLESS
from kankaku.railway.plan.scenario import Scenario
from kankaku.testing.example_lines import world_of
from kankaku.testing.loop_station import loop_station_scenario
from tests.examples import examples
from tests.property.runs import READY_S, run
from tests.property.test_control_maps import days
from tests.unit.test_unit_failures import SPEC, Listener, failing, two_trains

DAYS = examples(40)


@st.composite
def with_balises(draw: st.DrawFn) -> Scenario:
    """Return a day on a line with balises, near or far from each other, or none."""
    scenario = draw(days())
    spacing_m = draw(st.sampled_from([200.0, 450.0, 1500.0, 1e4]))
    balises_m = np.arange(draw(st.floats(0.0, 200.0)), scenario.line.end_m, spacing_m)
    return replace(scenario, line=replace(scenario.line, balises_m=tuple(balises_m.tolist())))


@DAYS
@given(
    with_balises(),
    st.integers(0, 10_000),
    st.lists(st.floats(0.0, 90.0), min_size=15, max_size=15),
    st.sampled_from([0.0, 0.02, 0.1]),
)
def test_no_fault_ever_endangers_anybody(
    scenario: Scenario, number: int, drawn_s: list[float], loss_ratio: float
) -> None:
    world = world_of(scenario)
    failure = draw_failure(world, 1, number)
    radio = replace(LOSSLESS, loss_ratio=loss_ratio)
    controller = build(SPEC, world, radio)
    if failure.kind is FailureMode.MAP:
        wrong = WrongMaps(world, ControlMapOptions(early_s=1000.0), radio, failure)
        controller = replace(controller, protection=wrong)
    delay_s = np.resize(np.array(drawn_s), (world.size, world.stop_m.shape[1] - 1))
    record, _ = run(
        scenario, controller=controller, delay_s=delay_s, radio=radio, unit_failures=(failure,)
    )
    assert record.violations == ()
    assert record.completed.all()


@DAYS
@given(
    st.floats(-30.0, 30.0),
    st.sampled_from([Variant.JUMP, Variant.DRIFT]),
    st.floats(30.0, 120.0),
    st.floats(5.0, 60.0),
    st.floats(0.0, 90.0),
)
def test_no_clock_ever_lets_a_limit_exceed_what_was_free(
    ahead_s: float, variant: Variant, onset_s: float, lasts_s: float, overstay_s: float
) -> None:
    """Up to the tail of the leader as it last reported, the margin taken off, and not further."""
    assume(abs(ahead_s) > 1e-3)
    failure = UnitFailure(variant, "T2", READY_S + onset_s, READY_S + onset_s + lasts_s, ahead_s)
    record, _, listener = failing(two_trains(70.0), failure, overstay_s=overstay_s)
    assert record.violations == ()
    assert_limits_were_free(listener)


def assert_limits_were_free(listener: Listener) -> None:
    compared = 0
    furthest_m = -np.inf
    for state, authority, memory in listener.said:
        if not state.present.all():
            continue
        # Reports never go back, so what was free once stays free.
        furthest_m = max(furthest_m, float(memory.reports.front_m[0]))
        eoa_m = max(float(authority.eoa_m[1]), float(state.front_m[1]))
        assert eoa_m <= max(furthest_m - 200.0 - 25.0, float(state.front_m[1])) + 1e-6
        compared += 1
    assert compared > 100


def test_two_faults_at_once_are_no_danger_where_they_do_not_meet() -> None:
    scenario = loop_station_scenario(3, 80.0)
    slow = UnitFailure(Variant.JUMP, "T1", READY_S + 90.0, READY_S + 120.0, -5.0)
    deaf = UnitFailure(Variant.DOWN, "T3", READY_S + 250.0, READY_S + 280.0)
    record, _, _ = failing(scenario, slow, deaf)
    assert record.violations == ()
    assert record.completed.all()
