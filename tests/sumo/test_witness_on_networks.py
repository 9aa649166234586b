"""The engine of networks does what the plain engine does, and SUMO sees who collides."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kankaku.controllers.registry import ControllerError
from kankaku.railway.loop.plain_engine import PlainEngine
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.step.engine_contract import Engine, Observation
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.shipped import folder_of
from kankaku.studies.study import run_once
from kankaku.sumo_net import witness_engine
from kankaku.sumo_net.agreement import AGREEMENT_M, EngineDisagreementError
from kankaku.sumo_net.build import build, steps_per_look, sumo_binary
from kankaku.sumo_net.witness_engine import WitnessEngine
from kankaku.testing.example_lines import world_of
from tests.property.runs import controller_of

SHUTTLES = ("d01", "u01", "d02", "u02", "d08", "u08")
LOOK_S = 1.0
CLOSE_UP = ControllerSpec("close_up", "moving_block", "close_up", {}, {})


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KANKAKU_CACHE", str(tmp_path / "cache"))


def only(scenario: str, *trains: str) -> Scenario:
    """Return a shipped scenario with some of its trains, which hand over stock among themselves."""
    whole = load(folder_of(scenario))
    services = tuple(
        replace(one, next_train=one.next_train if one.next_train in trains else "")
        for one in whole.timetable.services
        if one.train in trains
    )
    return replace(whole, timetable=replace(whole.timetable, services=services))


def on_sumo(scenario: Scenario, folder: Path, *, gui: bool = False) -> WitnessEngine:
    world = world_of(scenario)
    delay_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
    return WitnessEngine(build(scenario, world, delay_s, folder / "run"), world, gui=gui)


def plain(scenario: Scenario) -> PlainEngine:
    delay_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
    return PlainEngine(world_of(scenario), delay_s, scenario.step_s)


class Watched:
    """An engine that remembers what it showed."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self.seen: list[Observation] = []
        self.apply, self.advance, self.hold = engine.apply, engine.advance, engine.hold

    def observe(self) -> Observation:
        self.seen.append(self._engine.observe())
        return self.seen[-1]


def observed(scenario: Scenario, engine: PlainEngine) -> list[Observation]:
    world = world_of(scenario)
    delay_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
    with engine as running:
        watched = Watched(running)
        run = Run(world, delay_s, scenario.seed, scenario.patience_s)
        record = simulate(run, watched, controller_of(world), all_meters(world))
    assert record.completed.all()
    return watched.seen


def drive(
    scenario: Scenario, engine: Engine, halts_m: list[float], until_s: float
) -> list[Observation]:
    """Run every train at 20 m/s at most until its front is near a place, and halt there."""
    gain_mps, seen = 1.0 * scenario.step_s, [engine.observe()]
    while not seen[-1].collided and seen[-1].time_s < until_s:
        to_go_m = np.maximum(np.array(halts_m) - seen[-1].front_m, 0.0)
        fastest = np.minimum(seen[-1].speed_mps + gain_mps, 20.0)
        engine.apply(np.minimum(fastest, np.sqrt(1.6 * to_go_m)))
        engine.advance()
        seen.append(engine.observe())
    return seen


@pytest.mark.parametrize("step_s", [0.1, 0.3, 0.5])
def test_observations_are_those_of_the_plain_engine(tmp_path: Path, step_s: float) -> None:
    scenario = replace(only("terminal", *SHUTTLES), step_s=step_s)
    seen = observed(scenario, on_sumo(scenario, tmp_path))
    expected = observed(scenario, plain(scenario))
    assert len(seen) == len(expected)
    for one, other in zip(seen, expected, strict=True):
        assert np.array_equal(one.front_m, other.front_m)
        assert np.array_equal(one.speed_mps, other.speed_mps)
        assert (one.time_s, *one[3:]) == (other.time_s, *other[3:])
    handed_over = [one for one in seen if one.left and one.entered]
    assert handed_over


@pytest.mark.parametrize(("step_s", "steps"), [(0.1, 10), (0.5, 2), (0.3, 1), (1.0, 1), (2.0, 1)])
def test_sumo_looks_once_a_second_where_steps_make_one(step_s: float, steps: int) -> None:
    assert steps_per_look(step_s) == steps


def test_a_head_on_collision_is_seen_within_a_second(tmp_path: Path) -> None:
    scenario = only("single_track", "237", "238")
    line = scenario.line
    standing_m, runs_up_to_m = 4400.0, line.mirrored_m(4300.0)
    with on_sumo(scenario, tmp_path) as engine:
        begin_s = float(world_of(scenario).booked_departure_s[:, 0].max())
        seen = drive(scenario, engine, [standing_m, runs_up_to_m], begin_s + 1200.0)
    assert seen[-1].collided == (0, 1)
    met_s = next(one.time_s for one in seen if one.front_m[0] > line.mirrored_m(one.front_m[1]))
    assert 0.0 <= seen[-1].time_s - met_s <= LOOK_S


def test_trains_that_converge_are_seen_within_a_second(tmp_path: Path) -> None:
    scenario = only("branch", "n01", "s02")
    with on_sumo(scenario, tmp_path) as engine:
        begin_s = float(world_of(scenario).booked_departure_s[:, 0].max())
        seen = drive(scenario, engine, [2600.0, 2650.0], begin_s + 900.0)
    assert seen[-1].collided == (0, 1)
    # The one stands across the node, and the other one comes to it.
    met_s = next(one.time_s for one in seen if one.front_m[1] > 2500.0)
    assert 0.0 <= seen[-1].time_s - met_s <= LOOK_S


def test_trains_that_have_met_are_followed_further(tmp_path: Path) -> None:
    scenario = only("branch", "n01", "s02")
    with on_sumo(scenario, tmp_path) as engine:
        begin_s = float(world_of(scenario).booked_departure_s[:, 0].max())
        halts_m = [2600.0, 2650.0]
        met_s = drive(scenario, engine, halts_m, begin_s + 900.0)[-1].time_s
        engine.apply(np.zeros(2))
        engine.advance()
        after = drive(scenario, engine, halts_m, met_s + 10.0)
    assert after[-1].time_s >= met_s + 10.0


def test_a_train_may_run_past_the_end_of_its_track(tmp_path: Path) -> None:
    scenario = only("terminal", "d01")
    end_m = scenario.line.end_m
    with on_sumo(scenario, tmp_path) as engine:
        begin_s = float(world_of(scenario).booked_departure_s[0, 0])
        seen = drive(scenario, engine, [end_m + 50.0], begin_s + 360.0)
    assert seen[-1].front_m[0] > end_m + 49.0
    assert not any(one.left for one in seen)


def test_a_train_off_its_commands_stops_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = only("terminal", "d01")
    with on_sumo(scenario, tmp_path) as engine:
        begin_s = float(world_of(scenario).booked_departure_s[0, 0])
        drive(scenario, engine, [2000.0], begin_s + 20.0)
        slipping = engine._move_in_sumo  # noqa: SLF001
        farther = 1.0 + AGREEMENT_M

        def slip(vehicles: list[str], gone_m: list[float], *speeds_mps: list[float]) -> None:
            slipping(vehicles, gone_m, *([farther * mps for mps in told] for told in speeds_mps))

        monkeypatch.setattr(engine, "_move_in_sumo", slip)
        with pytest.raises(EngineDisagreementError, match=r"d01 is .* off its commands"):
            drive(scenario, engine, [2000.0], begin_s + 40.0)


def test_a_network_in_which_sumo_sees_two_tracks_for_one_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(witness_engine, "twins", lambda _: {"down": "up"})
    scenario = only("terminal", "d01")
    with pytest.raises(EngineDisagreementError, match="down and up are one track"):
        on_sumo(scenario, tmp_path).__enter__()
    monkeypatch.undo()
    with on_sumo(scenario, tmp_path) as engine:
        assert engine.observe().entered == ()


def test_window_shows_every_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # The command line of sumo takes the options of sumo-gui, and needs no display.
    monkeypatch.setattr("kankaku.sumo_net.door.sumo_binary", lambda _: sumo_binary("sumo"))
    scenario = only("terminal", "d01")
    begin_s = float(world_of(scenario).booked_departure_s[0, 0])
    with on_sumo(scenario, tmp_path, gui=True) as engine:
        seen = drive(scenario, engine, [500.0], begin_s + 0.5)
        assert seen[-1].front_m[0] > 0.0
        shown_s = engine._sumo.simulation.getTime()  # noqa: SLF001
    assert shown_s == pytest.approx(seen[-1].time_s)


def test_a_study_runs_networks_on_sumo_as_a_witness() -> None:
    engines: list[object] = []

    def note(part: str, layer: object) -> object:
        if part == "engine":
            engines.append(layer)
        return layer

    record = run_once(only("terminal", "d01", "u01"), CLOSE_UP, 1, 0.5, wrap=note)
    assert record.completed.all()
    assert [type(engine) for engine in engines] == [WitnessEngine]


def test_peers_do_not_run_on_networks() -> None:
    peer = ControllerSpec("them", "", "", {}, {}, peer="sumo_native_moving")
    with pytest.raises(ControllerError, match="chains only") as caught:
        run_once(only("terminal", "d01"), peer, 1, 0.5)
    assert caught.value.where == "controllers.them.peer"
    assert caught.value.allowed == "a protection and an operation"
