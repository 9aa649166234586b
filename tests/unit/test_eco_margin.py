"""The energy layer: what it costs, what it saves, and where it says so."""

from dataclasses import replace

import numpy as np
import pytest

from kankaku.controllers.choosing import with_settings
from kankaku.controllers.eco_layer.eco_margin import WORD
from kankaku.controllers.eco_layer.leg_runs import LegRuns
from kankaku.controllers.operation.close_up import NO_CEILING_MPS
from kankaku.controllers.registry import ControllerError, build, options_of
from kankaku.railway.plan.driving_style import DrivingStyle
from kankaku.railway.plan.line import Gradient, SpeedLimit
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import NOTHING, Reason
from kankaku.testing.example_lines import commuter_train, two_station_scenario, world_of
from tests.property.runs import run

LIMITS = [SpeedLimit(900.0, 1200.0, 15.0)]
GRADIENTS = [Gradient(400.0, 900.0, 0.006), Gradient(1300.0, 1900.0, -0.008)]
PLAIN = ControllerSpec("x", "moving_block", "close_up", {}, {})
STYLE = DrivingStyle(
    "usual", 1.0, 0.8, 1.0, coasting_band_mps=3.0, departure_reaction_s=2.0, late_after_s=30.0
)


def scenario_of(run_s: float, trains: int = 1, step_s: float = 0.2) -> Scenario:
    answering = replace(commuter_train(), jerk_mps3=0.8, brake_build_up_s=1.0)
    scenario = two_station_scenario(
        trains, 90.0, spacing_m=2000.0, run_s=run_s, limits=LIMITS, gradients=GRADIENTS
    )
    return replace(scenario, step_s=step_s, train_types={answering.id: answering})


def run_with(
    scenario: Scenario, margin_s: float | None, delay_s: float = 0.0, **changes: object
) -> RunRecord:
    spec = replace(PLAIN, eco_margin_s=margin_s, **changes)  # type: ignore[arg-type]
    world = world_of(scenario)
    overstay_s = np.zeros((world.size, world.stop_m.shape[1] - 1))
    overstay_s[0, 0] = delay_s
    record, _ = run(scenario, controller=build(spec, world), delay_s=overstay_s)
    assert record.violations == ()
    assert record.completed.all()
    return record


def run_s(record: RunRecord) -> float:
    return float(record.arrival_s[0, 1] - record.departure_s[0, 0])


def net_j(record: RunRecord) -> float:
    account = record.energy
    return float((account.consumed_j - account.recovered_j - account.auxiliary_j).sum())


@pytest.mark.parametrize(("margin_s", "saved"), [(0.5, 0.06), (1.0, 0.1)])
def test_a_train_alone_spends_the_margin_and_saves(margin_s: float, saved: float) -> None:
    scenario = scenario_of(100.0, step_s=0.1)
    fastest, spent = run_with(scenario, None), run_with(scenario, margin_s)
    assert run_s(spent) - run_s(fastest) == pytest.approx(margin_s, abs=0.101)
    assert net_j(spent) < (1.0 - saved) * net_j(fastest)


def test_what_lowers_the_speed_is_said_and_nobody_is_blamed() -> None:
    trajectory = run_with(scenario_of(100.0), 1.0).trajectory
    planned = trajectory.reason == Reason.PLAN
    assert planned.any()
    assert {trajectory.plans[word] for word in trajectory.plan[planned]} == {WORD}
    assert np.all(trajectory.cause[planned] == NOTHING)


def test_words_of_the_operation_stay_its_own() -> None:
    world = world_of(scenario_of(100.0))
    plain = replace(PLAIN, operation="two_stage")
    operation = build(plain, world).operation
    around = build(replace(plain, eco_margin_s=0.1), world).operation
    assert around.reasons == (*operation.reasons, WORD)


@pytest.mark.parametrize("delay_s", [20.0, 50.0])
def test_behind_a_late_leader_nobody_loses_more_than_the_margin(delay_s: float) -> None:
    scenario = scenario_of(100.0, trains=3)
    margin_s = 0.5
    fastest = run_with(scenario, None, delay_s)
    spent = run_with(scenario, margin_s, delay_s)
    lost_s = spent.arrival_s[:, 1] - fastest.arrival_s[:, 1]
    # Each waits for the one before, which is later by a margin, too.
    assert lost_s.max() <= 3.0 * margin_s + 2.0 * scenario.step_s
    assert lost_s.min() >= -scenario.step_s
    assert net_j(spent) < net_j(fastest)


@pytest.mark.parametrize("booked_s", [135.0, 200.0])
def test_with_the_reserve_a_train_on_time_arrives_when_it_is_booked(booked_s: float) -> None:
    scenario = scenario_of(booked_s)
    record = run_with(scenario, 0.1, eco_reserve=True)
    late_s = record.arrival_s[0, 1] - record.world.booked_arrival_s[0, 1]
    assert late_s == pytest.approx(0.0, abs=0.5)
    assert net_j(record) < 0.8 * net_j(run_with(scenario, 0.1))


def test_with_the_reserve_a_train_without_time_to_spare_has_the_margin() -> None:
    scenario = scenario_of(150.0)
    late = run_with(scenario, 0.1, 60.0, eco_reserve=True)
    assert run_s(late) == run_s(run_with(scenario, 0.1, 60.0))


def test_who_is_held_up_on_the_way_hurries_on() -> None:
    scenario = scenario_of(160.0, trains=2)
    delay_s = 75.0
    held, free = run_with(scenario, 0.1, delay_s, eco_reserve=True), run_with(scenario, 0.1)
    fast = run_with(scenario, 0.1, delay_s)
    assert held.arrival_s[1, 1] - fast.arrival_s[1, 1] <= max(
        held.world.booked_arrival_s[1, 1] - fast.arrival_s[1, 1] + 0.5, 1.0
    )
    assert held.arrival_s[1, 1] > free.arrival_s[1, 1]


@pytest.mark.parametrize(("delay_s", "hurries"), [(20.0, False), (40.0, True)])
def test_in_a_style_that_idles_the_reserve_is_what_drivers_leave(
    delay_s: float, hurries: bool
) -> None:
    scenario = replace(scenario_of(100.0), driving=STYLE)
    usual, planned = (
        run_with(scenario, margin_s, 30.0 + delay_s, eco_reserve=margin_s is not None)
        for margin_s in (None, 0.5)
    )
    assert run_s(planned) == pytest.approx(run_s(usual) + 0.5 * hurries, abs=1.5)
    assert net_j(planned) < net_j(usual)


@pytest.mark.parametrize("hurries", [False, True])
def test_in_a_style_that_idles_trains_keep_to_it_with_a_margin(hurries: bool) -> None:
    scenario = replace(scenario_of(100.0), driving=STYLE)
    delay_s = 100.0 * hurries
    usual, spent = (run_with(scenario, margin_s, delay_s) for margin_s in (None, 0.5))
    # Whoever coasts may decide a step later whether to speed up once more.
    assert 0.0 <= run_s(spent) - run_s(usual) <= 0.5 + (0.2 if hurries else 1.0)
    assert net_j(spent) < net_j(usual)


def test_a_ceiling_never_holds_back_who_speeds_up() -> None:
    world = world_of(scenario_of(100.0))
    protection = build(PLAIN, world).protection
    runs = LegRuns(world, world, protection, 0.5)  # type: ignore[arg-type]
    made = runs.quickest(0, 1, True)
    assert made is not None
    ceiling_mps, time_s = made.table
    # Up to the first limit and from its end on the run speeds up.
    assert np.all(np.diff(ceiling_mps[:300]) <= 1e-9)
    assert ceiling_mps.min() > 0.0
    assert ceiling_mps.max() == NO_CEILING_MPS
    assert np.all(np.diff(time_s) > 0.0)
    assert runs.quickest(0, 1, True) is made


def test_without_the_key_nothing_is_different() -> None:
    world = world_of(scenario_of(100.0))
    assert type(build(PLAIN, world).operation).__name__ == "CloseUp"
    assert "energy" not in options_of(PLAIN)
    spent = replace(PLAIN, eco_margin_s=0.1)
    assert options_of(spent)["energy"] == {"eco_margin_s": 0.1, "eco_reserve": False}


def test_it_can_be_set_on_the_command_line() -> None:
    (found,) = with_settings([PLAIN], ["x.eco_reserve=true", "x.eco_margin_s=1"])
    assert (found.eco_margin_s, found.eco_reserve) == (1.0, True)


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("x.eco_margin_s=true", "--set: x.eco_margin_s: True; allowed: a number"),
        ("x.eco_margin_s=-1", "--set: x.eco_margin_s: eco_margin_s is -1; allowed: 0.001 to 60"),
        ("x.eco_reserve=1", "--set: x.eco_reserve: 1.0; allowed: true or false"),
    ],
)
def test_a_setting_that_makes_no_sense_is_refused(setting: str, told: str) -> None:
    with pytest.raises(ControllerError) as caught:
        with_settings([PLAIN], [setting])
    assert str(caught.value) == told


def test_a_reserve_without_a_margin_is_refused() -> None:
    with pytest.raises(ControllerError, match=r"controllers\.x\.eco_reserve"):
        build(replace(PLAIN, eco_reserve=True), world_of(scenario_of(100.0)))
