"""Which trains can start, climb, hold and stop where their services take them, by closed forms."""

from dataclasses import replace
from pathlib import Path

import pytest

from kankaku.railway.motion.feasibility import RESERVE_MPS2, Feasibility, Lack, Shortfall, assess
from kankaku.railway.plan.line import Gradient, TrackCurve
from kankaku.railway.plan.rolling_stock import Traction, TrainType
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import ScenarioError
from kankaku.studies import study
from kankaku.testing.example_lines import commuter_train, two_station_scenario
from tests.cli.command import PROJECT, kankaku, refused
from tests.ends_of_ways import short_turn_scenario
from tests.unit import scenario_folder
from tests.unit.scenario_folder import write_scenario

GRAVITY = 9.80665
MASS_KG = 400_000.0
RATIO = 1.0 / 1.08
"""Share of gravity that a train of 8 % rotating mass feels. [-]"""
ROLLING_N = GRAVITY * (1.65 * 160.0 + 0.78 * 240.0)


def with_train(scenario: Scenario, train: TrainType) -> Scenario:
    return replace(scenario, train_types={train.id: train})


def pulling(scenario: Scenario, force_n: float) -> Scenario:
    traction = Traction(force_n, 11.0, 22.0)
    return with_train(scenario, replace(commuter_train(), traction=traction))


def braking(scenario: Scenario, lack: Lack, brake_mps2: float) -> Scenario:
    train = commuter_train()
    if lack is Lack.SERVICE_BRAKE:
        return with_train(scenario, replace(train, service_brake_mps2=brake_mps2))
    return with_train(scenario, replace(train, emergency_brake_mps2=brake_mps2))


def assessed(scenario: Scenario) -> Feasibility:
    return assess(scenario.line, scenario.train_types, scenario.timetable)


def only(scenario: Scenario) -> Shortfall:
    (found,) = assessed(scenario).shortfalls
    return found


def lacks(scenario: Scenario) -> list[Lack]:
    return [found.lack for found in assessed(scenario).shortfalls]


@pytest.mark.parametrize(
    ("start_m", "share"), [(0.0, 1.0), (200.0, 0.5), (250.0, 0.25)], ids=["all", "half", "quarter"]
)
def test_a_train_starts_against_the_gradient_below_its_whole_length(
    start_m: float, share: float
) -> None:
    # The train stands from 100 m to 300 m.
    hill = (Gradient(start_m, 300.0, 0.040),)
    needed_n = ROLLING_N + MASS_KG * GRAVITY * 0.040 * share
    scenario = two_station_scenario(1, gradients=hill)
    found = only(pulling(scenario, 0.999 * needed_n))
    assert found.lack is Lack.STARTING
    assert (found.leg.origin, found.place_m) == ("west", 300.0)
    assert found.gradient == pytest.approx(0.040 * share)
    assert found.needed == pytest.approx(needed_n, rel=1e-6)
    assert assessed(pulling(scenario, 1.01 * needed_n)).shortfalls == ()


def test_a_curve_holds_a_starting_train_back() -> None:
    scenario = two_station_scenario(1)
    line = replace(scenario.line, curves=(TrackCurve(0.0, 300.0, 200.0),))
    scenario = replace(scenario, line=line)
    # 600 / R in kgf per tonne.
    needed_n = ROLLING_N + 600.0 / 200.0 * 1e-3 * GRAVITY * MASS_KG
    assert only(pulling(scenario, 0.98 * needed_n)).lack is Lack.STARTING
    assert assessed(pulling(scenario, 1.02 * needed_n)).shortfalls == ()


def test_a_train_too_weak_for_the_level_cannot_start_anywhere() -> None:
    found = only(pulling(two_station_scenario(1), 0.9 * ROLLING_N))
    assert (found.lack, found.gradient) == (Lack.STARTING, 0.0)


def test_a_train_need_not_start_where_it_leaves_the_line() -> None:
    scenario = short_turn_scenario(2)
    ends = replace(scenario.timetable, services=scenario.timetable.services[1:])
    line = replace(scenario.line, gradients=(Gradient(1300.0, 1500.0, 0.040),))
    weak = pulling(replace(scenario, line=line), 120_000.0)
    assert lacks(weak) == [Lack.STARTING]
    assert lacks(replace(weak, timetable=ends)) == []


def test_a_ramp_that_a_run_up_takes_is_climbed_and_one_too_long_is_not() -> None:
    # 25 m/s are worth a rise of 1.08 x 25^2 / 2 / g = 34 m, traction not counted.
    def on_ramp(length_m: float) -> Scenario:
        hill = (Gradient(2300.0, 2300.0 + length_m, 0.055),)
        return pulling(two_station_scenario(1, spacing_m=4000.0, gradients=hill), 150_000.0)

    assert assessed(on_ramp(400.0)).shortfalls == ()
    found = only(on_ramp(1900.0))
    assert found.lack is Lack.CLIMBING
    assert (found.leg.origin, found.leg.destination) == ("west", "east")
    assert found.gradient == 0.055
    assert 2500.0 < found.place_m < 4200.0
    assert "150 kN" in str(found)
    assert "55 permil" in str(found)


@pytest.mark.parametrize("brake", [Lack.SERVICE_BRAKE, Lack.EMERGENCY_BRAKE])
def test_a_brake_is_stronger_than_gravity_on_the_steepest_descent(brake: Lack) -> None:
    slopes = (Gradient(500.0, 900.0, -0.030), Gradient(900.0, 950.0, -0.060))
    scenario = two_station_scenario(1, gradients=slopes)
    # Of its 200 m a train has at most 50 m on the steeper and 150 m on the gentler slope.
    pull_mps2 = GRAVITY * RATIO * (0.75 * 0.030 + 0.25 * 0.060)
    least_mps2 = pull_mps2 + RESERVE_MPS2
    found = only(braking(scenario, brake, 0.999 * least_mps2))
    assert found.lack is brake
    assert found.gradient == pytest.approx(-0.0375)
    assert found.place_m == pytest.approx(950.0, abs=1.0)
    assert found.needed == pytest.approx(least_mps2)
    assert assessed(braking(scenario, brake, 1.001 * least_mps2)).shortfalls == ()


@pytest.mark.parametrize("gradient", [-0.020, 0.020])
def test_a_brake_holds_a_train_at_its_last_stop_on_either_slope(gradient: float) -> None:
    scenario = two_station_scenario(1, gradients=(Gradient(1050.0, 1800.0, gradient),))
    least_mps2 = GRAVITY * RATIO * 0.020 + RESERVE_MPS2
    brake = Lack.SERVICE_BRAKE
    assert lacks(braking(scenario, brake, 0.99 * least_mps2)) == [brake]
    assert lacks(braking(scenario, brake, 1.01 * least_mps2)) == []


def test_a_ramp_between_stops_asks_nothing_of_a_brake() -> None:
    scenario = two_station_scenario(1, spacing_m=2000.0, gradients=(Gradient(800.0, 1100.0, 0.05),))
    assert assessed(braking(scenario, Lack.SERVICE_BRAKE, 0.3)).shortfalls == ()


def test_a_leg_booked_too_fast_is_told_once_for_all_its_trains() -> None:
    # 1 km at 1 m/s2 either way takes 2 sqrt(1000) = 63 s at least.
    (hurry,) = assessed(two_station_scenario(12, run_s=40.0)).hurries
    assert (hurry.booked_s, hurry.trains) == (40.0, 12)
    assert hurry.least_s > 63.0
    assert str(hurry).startswith("commuter from 'west' to 'east': booked 40 s, at least ")
    assert str(hurry).endswith("; 12 trains")


@pytest.mark.parametrize(("early_s", "told"), [(0.9, 0), (1.1, 1)])
def test_a_booking_may_cut_off_a_part_of_a_second(early_s: float, told: int) -> None:
    (hurry,) = assessed(two_station_scenario(1, run_s=1.0)).hurries
    booked_s = hurry.least_s - early_s
    assert len(assessed(two_station_scenario(1, run_s=booked_s)).hurries) == told


def test_weak_trains_are_refused_with_file_and_key(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    scenario_folder.replace(
        folder, "rolling_stock.toml", "starting_force_kn = 335.0", "starting_force_kn = 5.0"
    )
    complaint = refused(folder, "--step", "0.3", "--out", tmp_path / "out")
    assert "rolling_stock.toml: train.unit.traction.starting_force_kn: 5 kN" in complaint
    assert complaint == refused(folder, "--step", "0.1", "--out", tmp_path / "out")


def test_weak_brakes_are_refused_with_file_and_key(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path)
    scenario_folder.replace(folder, "gradients.csv", "0.5,0.9,-10", "0.5,0.9,-60")
    scenario_folder.replace(
        folder, "rolling_stock.toml", "service_brake_kmhps = 5.0", "service_brake_kmhps = 2.0"
    )
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    (mistake,) = caught.value.mistakes
    assert (mistake.file, mistake.where) == ("rolling_stock.toml", "train.unit.service_brake_kmhps")
    # 60 permil of 9.80665 m/s2 over 1.08, in km/h/s.
    assert f"gravity pulls with {3.6 * GRAVITY * 0.060 / 1.08:.3g}" in mistake.problem


def test_what_is_booked_too_fast_is_told_and_runs(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    scenario_folder.replace(
        folder,
        "calls.csv",
        "A1,first,north-1,07:00:00,07:00:30",
        "A1,first,north-1,07:00:00,07:02:00",
    )
    (warning,) = load(folder).warnings
    assert warning.startswith("calls.csv: unit from 'first' to 'middle': booked 30 s, at least ")
    screen = kankaku(folder, "--out", tmp_path / "out")
    assert screen.status == 0
    assert screen.complaints.count(warning) == 1
    assert warning not in screen.answers


def test_a_scenario_of_ones_own_is_refused_before_the_run() -> None:
    scenario = pulling(two_station_scenario(1), 0.9 * ROLLING_N)
    spec = ControllerSpec("plain", "moving_block", "close_up", {}, {})
    with pytest.raises(study.StudyError, match=r"3.982 kN do not start the train at 'west'"):
        study.run_once(scenario, spec, 1, 0.5)


def test_the_trains_of_the_examples_are_strong_enough() -> None:
    examples = sorted((PROJECT / "scenarios").glob("*/scenario.toml"))
    assert len(examples) > 5
    for file in examples:
        assert load(file.parent).warnings == ()
