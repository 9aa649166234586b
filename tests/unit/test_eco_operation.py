"""Energy-saving driving on the line: to the second, and again after a hindrance."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from kankaku.controllers.operation import eco as operation
from kankaku.controllers.operation.eco import EcoOptions
from kankaku.controllers.options import OptionError
from kankaku.railway.motion.eco_run import eco, eco_run
from kankaku.railway.motion.run_curve import fastest_run
from kankaku.railway.motion.timed_run import timed_run
from kankaku.railway.plan.line import Gradient, SpeedLimit
from kankaku.railway.plan.rolling_stock import Traction
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Reason
from kankaku.testing.example_lines import commuter_train, two_station_scenario
from tests.property.runs import run, solo_scenario

LIMITS = [SpeedLimit(900.0, 1200.0, 15.0)]
GRADIENTS = [Gradient(400.0, 900.0, 0.006), Gradient(1300.0, 1900.0, -0.008)]


def scenario_of(run_s: float, trains: int = 1, headway_s: float = 300.0) -> Scenario:
    return two_station_scenario(
        trains,
        headway_s,
        spacing_m=2000.0,
        run_s=run_s,
        limits=LIMITS,
        gradients=GRADIENTS,
        step_s=0.1,
    )


def net_j(record: RunRecord) -> float:
    return float((record.energy.consumed_j - record.energy.recovered_j)[0])


@pytest.mark.parametrize("run_s", [128.0, 130.0, 140.0, 170.0, 300.0])
def test_with_slack_a_train_arrives_at_the_booked_time_and_saves(run_s: float) -> None:
    fastest, _ = run(scenario_of(run_s), "close_up")
    record, _ = run(scenario_of(run_s), "eco")
    assert fastest.arrival_s[0, 1] < record.world.booked_arrival_s[0, 1] - 1.0
    late_s = record.arrival_s[0, 1] - record.world.booked_arrival_s[0, 1]
    assert -0.5 <= late_s <= 0.5
    assert net_j(record) < 0.95 * net_j(fastest)
    assert record.violations == ()


def uphill(force_n: float, ramp_m: float, slack_s: float, step_s: float) -> Scenario:
    """A ramp of 55 permil, which takes 0.50 m/s2 of the train's traction or more than it has."""
    train = commuter_train()
    train = replace(train, traction=Traction(force_n, 11.0, 22.0))
    ramp = [Gradient(1500.0, 1500.0 + ramp_m, 0.055)]
    scenario = solo_scenario(train, [300.0, 4000.0], 4300.0, gradients=ramp, step_s=step_s)
    (service,) = scenario.timetable.services
    start, stop = service.calls
    shortest_s = fastest_run(scenario.line, train, start.stop_m, stop.stop_m).run_time_s
    start = replace(start, departure_s=start.arrival_s + 10.0)
    arrival_s = start.departure_s + shortest_s + slack_s
    stop = replace(stop, arrival_s=arrival_s, departure_s=arrival_s + 10.0)
    booked = replace(service, calls=(start, stop))
    return replace(scenario, timetable=replace(scenario.timetable, services=(booked,)))


@settings(max_examples=10, deadline=None)
@given(
    st.floats(205e3, 260e3),
    st.floats(200.0, 900.0),
    st.floats(2.0, 150.0),
    st.sampled_from([0.1, 0.2, 0.5]),
)
@example(215e3, 1000.0, 62.4, 0.5)
@example(200e3, 400.0, 60.0, 0.1)
def test_near_the_limit_of_traction_a_train_climbs_saves_and_is_in_time(
    force_n: float, ramp_m: float, slack_s: float, step_s: float
) -> None:
    scenario = uphill(force_n, ramp_m, slack_s, step_s)
    record, _ = run(scenario, "eco")
    assert record.violations == ()
    late_s = record.arrival_s[0, 1] - record.world.booked_arrival_s[0, 1]
    assert late_s <= 2.0 * step_s + 1e-6


@pytest.mark.parametrize("force_n", [200e3, 215e3, 225e3, 400e3])
@pytest.mark.parametrize("slack_s", [5.0, 20.0, 60.0])
def test_a_run_by_coasting_and_one_of_least_energy_agree_on_what_can_be_climbed(
    force_n: float, slack_s: float
) -> None:
    scenario = uphill(force_n, 400.0, slack_s, 0.1)
    (train,) = scenario.train_types.values()
    ends_m = 300.0, 4000.0
    run_time_s = fastest_run(scenario.line, train, *ends_m).run_time_s + slack_s
    for curve in (
        timed_run(scenario.line, train, *ends_m, run_time_s),
        eco_run(scenario.line, train, *ends_m, run_time_s).curve,
    ):
        assert curve.run_time_s == pytest.approx(run_time_s, abs=0.011)
        on_ramp = (curve.chainage_m > 1400.0) & (curve.chainage_m < 2200.0)
        assert curve.speed_mps[on_ramp].min() > 1.0


def test_without_slack_a_train_runs_as_fast_as_it_may() -> None:
    _, free = run(scenario_of(110.0), "close_up")
    _, saving = run(scenario_of(110.0), "eco")
    assert np.array_equal(saving.speed_mps, free.speed_mps)


def test_what_lowers_the_speed_is_said() -> None:
    record, _ = run(scenario_of(140.0), "eco")
    assert Reason.PLAN in record.trajectory.reason


def test_a_train_that_is_held_up_and_late_follows_as_closely_as_it_may(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    planned: list[float] = []
    plan = eco

    def counted(*args: object, **options: object) -> object:
        planned.append(1.0)
        return plan(*args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(operation, "eco", counted)
    scenario = scenario_of(200.0, trains=2, headway_s=100.0)
    delay_s = np.zeros((2, 2))
    delay_s[0, 1] = 110.0
    record, _ = run(scenario, "eco", delay_s=delay_s)
    plans = len(planned)
    close_up, _ = run(scenario, "close_up", delay_s=delay_s)
    assert record.violations == ()
    assert record.arrival_s[1, 1] > record.world.booked_arrival_s[1, 1]
    intervals_s = [found.arrival_s[1, 1] - found.departure_s[0, 1] for found in (record, close_up)]
    assert intervals_s[0] <= intervals_s[1] + 2.0
    assert 2 <= plans <= 20


def test_a_train_that_is_held_up_for_a_while_is_still_on_time() -> None:
    scenario = scenario_of(200.0, trains=2, headway_s=80.0)
    delay_s = np.zeros((2, 2))
    delay_s[0, 0] = 60.0
    record, _ = run(scenario, "eco", delay_s=delay_s)
    assert record.violations == ()
    assert record.arrival_s[1, 1] == pytest.approx(record.world.booked_arrival_s[1, 1], abs=0.5)


@pytest.mark.parametrize(
    ("options", "key"),
    [({"least_slack_s": -1.0}, "least_slack_s"), ({"patience_s": 0.0}, "patience_s")],
)
def test_a_value_that_makes_no_sense_is_refused(options: dict[str, float], key: str) -> None:
    with pytest.raises(OptionError, match=key):
        EcoOptions(**options)
