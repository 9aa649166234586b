"""The engine runs ahead of SUMO between events; a SUMO that does otherwise is not believed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kankaku.controllers.drive import TractionDrive
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.timetable import Timetable
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Command
from kankaku.railway.step.engine_contract import Engine
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Advice, Authority, LineState
from kankaku.sumo_net.agreement import EngineDisagreementError
from kankaku.sumo_net.build import build
from kankaku.sumo_net.engine import SumoEngine
from kankaku.testing.example_lines import two_station_scenario, world_of
from kankaku.testing.toy_engine import ToyEngine
from tests.property.runs import controller_of
from tests.supervising import HoldEverybody, dwell_delays_s, supervised

STEPS = 800


def accelerate(engine: Engine) -> None:
    for _ in range(STEPS):
        engine.apply(np.minimum(engine.observe().speed_mps + 0.05, 10.0))
        engine.advance()


class Halts:
    """A drive that halts for a while a little before the end of the line, and creeps off it."""

    def __init__(self, world: World, away_m: float) -> None:
        self._honest, self._world = TractionDrive(world), world
        self._place_m = world.line.end_m - away_m
        self._until_s = np.inf

    def command(self, state: LineState, authority: Authority, advice: Advice) -> Command:
        command = self._honest.command(state, authority, advice)
        to_go_m = max(self._place_m - float(state.front_m[0]), 0.0)
        if to_go_m < 0.1 and self._until_s == np.inf:
            self._until_s = state.time_s + 5.0
        most_mps = np.sqrt(0.5 * to_go_m) if state.time_s < self._until_s else 0.4
        if to_go_m < 0.1 and state.time_s < self._until_s:
            most_mps = 0.0
        return command._replace(speed_mps=np.minimum(command.speed_mps, most_mps))


@pytest.mark.parametrize("step_s", [0.1, 0.5])
def test_trains_are_held_on_sumo_as_they_are_without_it(tmp_path: Path, step_s: float) -> None:
    scenario = two_station_scenario(2, 90.0, step_s=step_s)
    world = world_of(scenario)
    delay_s = dwell_delays_s(world, 0, 1, 33.3)

    def recorded(engine: Engine) -> RunRecord:
        controller = supervised(world, HoldEverybody(world, open_s=17.3, closed_s=6.1))
        return simulate(Run(world, delay_s, 1, 600.0), engine, controller, all_meters(world))

    with SumoEngine(build(scenario, world, delay_s, tmp_path), world) as engine:
        ours = recorded(engine)
    plain = recorded(ToyEngine(world, delay_s, step_s))
    assert ours.completed.all()
    assert np.array_equal(ours.departure_s, plain.departure_s)
    assert ours.arrival_s == pytest.approx(plain.arrival_s)
    assert ours.held is not None
    assert plain.held is not None
    assert ours.held.open_s == pytest.approx(plain.held.open_s)
    assert ours.held.closed_s == pytest.approx(plain.held.closed_s)
    # T1 overstays in the east by more than it would be held there.
    assert ours.held.open_s[0] == pytest.approx([17.3, 0.0])
    assert ours.held.closed_s[1] == pytest.approx([6.1, 6.1], abs=step_s)


@pytest.mark.parametrize("away_m", [0.05, 0.3, 0.6, 1.2])
def test_a_train_may_halt_a_little_before_the_end_of_the_line(
    tmp_path: Path, away_m: float
) -> None:
    """SUMO may have taken it off the line by then."""
    scenario = two_station_scenario(1, step_s=0.1)
    world, delay_s = world_of(scenario), np.zeros((1, 2))
    controller = replace(controller_of(world), drive=Halts(world, away_m))
    with SumoEngine(build(scenario, world, delay_s, tmp_path), world) as engine:
        record = simulate(Run(world, delay_s, 1, 600.0), engine, controller, all_meters(world))
    assert record.completed.all()


def test_a_train_off_its_commands_stops_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = two_station_scenario(1, step_s=0.1)
    world = world_of(scenario)
    with SumoEngine(build(scenario, world, np.zeros((1, 2)), tmp_path), world) as engine:
        accelerate(engine)
        honest = engine._set_speed  # noqa: SLF001
        monkeypatch.setattr(engine, "_set_speed", lambda train, mps: honest(train, 1.01 * mps))
        with pytest.raises(EngineDisagreementError, match="off its commands"):
            accelerate(engine)


@pytest.mark.parametrize("dwell_s", [0.0, 0.3, 0.7004, 1.3996])
@pytest.mark.parametrize("booked_s", [-600.0, 0.0, 0.7004])
@pytest.mark.parametrize("step_s", [0.1, 0.5])
def test_short_stops_end_in_both_at_once(
    tmp_path: Path, step_s: float, booked_s: float, dwell_s: float
) -> None:
    scenario = two_station_scenario(2, 90.0, step_s=step_s)
    services = tuple(
        replace(
            service,
            calls=tuple(
                replace(
                    call,
                    minimum_dwell_s=dwell_s,
                    departure_s=call.arrival_s + max(booked_s, 0.0 if number == 0 else booked_s),
                )
                for number, call in enumerate(service.calls)
            ),
        )
        for service in scenario.timetable.services
    )
    scenario = replace(scenario, timetable=Timetable(services))
    world, delay_s = world_of(scenario), np.zeros((2, 2))
    with SumoEngine(build(scenario, world, delay_s, tmp_path), world) as engine:
        run = Run(world, delay_s, 1, 600.0)
        record = simulate(run, engine, controller_of(world), all_meters(world))
    assert record.completed.all()


def test_who_comes_from_before_a_stop_to_a_stand_within_a_step_leaves_in_both_at_once(
    tmp_path: Path,
) -> None:
    scenario = two_station_scenario(1, step_s=1.0)
    world, delay_s = world_of(scenario), np.zeros((1, 2))
    way_m = float(np.diff(world.stop_m[0, :2])[0])
    # In its last step it goes more than the half metre around its mark in which SUMO sees it.
    cruise_mps = way_m / round(way_m / 1.2)
    released: list[float] = []
    with SumoEngine(build(scenario, world, delay_s, tmp_path), world) as engine:
        while len(released) < 2:
            seen = engine.observe()
            released += [seen.time_s] * len(seen.released)
            far = world.stop_m[0, 1] - seen.front_m[0] > 0.75 * cruise_mps
            engine.apply(np.full(1, cruise_mps if released and far else 0.0))
            engine.advance()
    assert seen.front_m[0] == pytest.approx(world.stop_m[0, 1])


def test_a_stop_that_ends_in_one_of_both_alone_stops_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = two_station_scenario(1, step_s=0.1)
    world = world_of(scenario)
    run = Run(world, np.zeros((1, 2)), 1, 600.0)
    with SumoEngine(build(scenario, world, np.zeros((1, 2)), tmp_path), world) as engine:
        monkeypatch.setattr(engine, "_dwell_s", engine._dwell_s + 90.0)  # noqa: SLF001
        with pytest.raises(EngineDisagreementError, match="lets T1 go"):
            simulate(run, engine, controller_of(world), all_meters(world))


def test_a_stop_that_sumo_is_not_told_to_extend_stops_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = two_station_scenario(2, 90.0, step_s=0.1)
    world = world_of(scenario)
    delay_s = np.zeros((2, 2))
    with SumoEngine(build(scenario, world, delay_s, tmp_path), world) as engine:
        monkeypatch.setattr(engine, "_set_stop", lambda *_: None)
        controller = supervised(world, HoldEverybody(world, open_s=17.3, closed_s=6.1))
        with pytest.raises(EngineDisagreementError, match=r"lets T\d go"):
            simulate(Run(world, delay_s, 1, 600.0), engine, controller, all_meters(world))
