"""What SUMO does with trains, as far as the engine relies on it; a new release may change it."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias

import libsumo
import numpy as np
import pytest

from kankaku.railway.plan.scenario import Scenario
from kankaku.sumo_net.build import SumoFiles, build
from kankaku.sumo_net.door import disarm
from kankaku.testing.example_lines import two_station_scenario, world_of

READY_S = 25_200.0
STEP_S = 0.5
Simulation: TypeAlias = Any
Files: TypeAlias = Callable[[Scenario], SumoFiles]


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Files:
    monkeypatch.setenv("KANKAKU_CACHE", str(tmp_path / "cache"))

    def write(scenario: Scenario) -> SumoFiles:
        delay_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
        return build(scenario, world_of(scenario), delay_s, tmp_path / "run")

    return write


@contextmanager
def sumo(files: SumoFiles, *, disarmed: bool = True) -> Iterator[Simulation]:
    libsumo.start(["sumo", "-c", str(files.config), "--no-warnings"])
    try:
        if disarmed:
            disarm(libsumo, "commuter")
        yield libsumo
    finally:
        libsumo.close()


def step_until(time_s: float) -> None:
    while libsumo.simulation.getTime() < time_s - 1e-6:
        libsumo.simulationStep()


def take_over(train: str, time_s: float) -> None:
    step_until(time_s)
    libsumo.vehicle.setSpeedMode(train, 0)


def jump(train: str, distance_m: float) -> None:
    """Move a standing train by a distance in two steps."""
    for speed in (distance_m / STEP_S, 0.0):
        libsumo.vehicle.setSpeed(train, speed)
        libsumo.simulationStep()


def test_trains_obey_any_speed_when_all_checks_are_off(files: Files) -> None:
    with sumo(files(two_station_scenario(1))) as run:
        take_over("T1", READY_S)
        step_until(READY_S + 30.0)
        for speed in (20.0, 3.0, 50.0):
            run.vehicle.setSpeed("T1", speed)
            run.simulationStep()
            assert run.vehicle.getSpeed("T1") == speed


def test_ballistic_steps_integrate_constant_acceleration(files: Files) -> None:
    speeds = np.random.default_rng(3).uniform(0.0, 30.0, 40)
    with sumo(files(two_station_scenario(1))) as run:
        take_over("T1", READY_S)
        step_until(READY_S + 30.0)
        odometer = [run.vehicle.getDistance("T1")]
        for speed in speeds.tolist():
            run.vehicle.setSpeed("T1", speed)
            run.simulationStep()
            odometer.append(run.vehicle.getDistance("T1"))
    means = 0.5 * (speeds + np.concatenate([[0.0], speeds[:-1]]))
    assert np.diff(odometer)[1:] == pytest.approx(means[1:] * STEP_S, abs=1e-6)


@pytest.mark.parametrize(
    ("off_m", "begins"),
    [(-5.0, False), (-0.55, False), (-0.5, True), (0.0, True), (0.5, True)],
)
def test_stop_begins_between_its_start_and_its_end_only(
    files: Files, off_m: float, *, begins: bool
) -> None:
    with sumo(files(two_station_scenario(1))) as run:
        take_over("T1", READY_S)
        step_until(READY_S + 30.0)
        jump("T1", 1000.0 + off_m)
        started = []
        for _ in range(60):
            run.vehicle.setSpeed("T1", 0.0)
            run.simulationStep()
            started += run.simulation.getStopStartingVehiclesIDList()
        assert started == (["T1"] if begins else [])
        assert run.vehicle.getDistance("T1") == pytest.approx(1000.0 + off_m)


def test_stop_begins_one_step_after_the_train_stands(files: Files) -> None:
    with sumo(files(two_station_scenario(1))) as run:
        take_over("T1", READY_S)
        assert run.simulation.getDepartedIDList() == ("T1",)
        assert run.simulation.getStopStartingVehiclesIDList() == ()
        run.simulationStep()
        assert run.simulation.getStopStartingVehiclesIDList() == ("T1",)


@pytest.mark.parametrize(
    ("duration_s", "until_s", "ends_s"), [(10.0, 25.0, 25.5), (30.2, 25.0, 30.5)]
)
def test_stop_lasts_for_its_duration_and_until_its_time(
    files: Files, duration_s: float, until_s: float, ends_s: float
) -> None:
    built = files(two_station_scenario(1))
    routes = built.config.parent / "trains.rou.xml"
    timed = f'duration="{duration_s}" until="{READY_S + 0.5 + until_s}"'
    routes.write_text(re.sub(r'duration="\S+" until="\S+"', timed, routes.read_text()))
    with sumo(built) as run:
        take_over("T1", READY_S + STEP_S)
        assert run.simulation.getStopStartingVehiclesIDList() == ("T1",)
        while not run.simulation.getStopEndingVehiclesIDList():
            run.vehicle.setSpeed("T1", 20.0)
            run.simulationStep()
        # The train has moved in the step before the end of the stop is reported.
        assert run.simulation.getTime() == READY_S + STEP_S + ends_s
        assert run.vehicle.getSpeed("T1") == 20.0


def test_commanded_speed_is_forgotten_while_a_stop_lies_ahead(files: Files) -> None:
    with sumo(files(two_station_scenario(1)), disarmed=False) as run:
        take_over("T1", READY_S)
        step_until(READY_S + 30.0)
        run.vehicle.setSpeed("T1", 5.0)
        run.simulationStep()
        assert run.vehicle.getSpeed("T1") == 5.0
        run.simulationStep()
        assert run.vehicle.getSpeed("T1") > 5.0


def test_train_type_that_cannot_accelerate_stays_without_a_command(files: Files) -> None:
    with sumo(files(two_station_scenario(1))) as run:
        take_over("T1", READY_S)
        step_until(READY_S + 60.0)
        assert run.vehicle.getDistance("T1") == 0.0
        assert run.vehicle.getSpeed("T1") == 0.0
        run.vehicle.setSpeed("T1", 20.0)
        run.simulationStep()
        assert run.vehicle.getSpeed("T1") == 20.0


def test_red_signals_do_not_hold_a_train_with_all_checks_off(files: Files) -> None:
    scenario = two_station_scenario(2, headway_s=90.0, block_m=700.0)
    reds = 0
    with sumo(files(scenario)) as run:
        take_over("T1", READY_S)
        step_until(READY_S + 30.0)
        jump("T1", 600.0)
        take_over("T2", READY_S + 90.0)
        step_until(READY_S + 121.0)
        while run.vehicle.getDistance("T2") < 500.0:
            run.vehicle.setSpeed("T1", 0.0)
            run.vehicle.setSpeed("T2", 20.0)
            run.simulationStep()
            reds += "r" in run.trafficlight.getRedYellowGreenState("signal#main#1")
        assert reds > 10
        assert run.vehicle.getSpeed("T2") == 20.0


def test_collisions_are_seen_and_trains_that_just_do_not_touch_are_not(files: Files) -> None:
    with sumo(files(two_station_scenario(2, headway_s=90.0))) as run:
        take_over("T1", READY_S)
        step_until(READY_S + 30.0)
        jump("T1", 500.0)
        for _ in range(200):
            run.vehicle.setSpeed("T1", 0.0)
            run.simulationStep()
        run.vehicle.setSpeedMode("T2", 0)
        jump("T2", 299.0)
        assert run.simulation.getCollisions() == ()
        jump("T2", 2.0)
        run.vehicle.setSpeed("T2", 0.0)
        run.simulationStep()
        (collision,) = run.simulation.getCollisions()
        assert (collision.collider, collision.victim) == ("T2", "T1")


def test_train_enters_although_the_line_ahead_has_no_signal(files: Files) -> None:
    with sumo(files(two_station_scenario(2, headway_s=90.0)), disarmed=False) as run:
        step_until(READY_S + 90.0)
        assert run.simulation.getDepartedIDList() == ("T2",)
        assert run.vehicle.getIDCount() == 2


def test_simulations_may_follow_each_other_in_one_process(files: Files) -> None:
    built = files(two_station_scenario(1))
    ends = []
    for _ in range(2):
        with sumo(built, disarmed=False) as run:
            step_until(READY_S + 60.0)
            ends.append(run.vehicle.getDistance("T1"))
    assert ends[0] == ends[1] > 0.0
