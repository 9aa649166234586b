"""What SUMO's own rail model and signals do, as far as the comparison with them relies on it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest

from kankaku.controllers.peers import PEERS, build_peer
from kankaku.railway.arrays import GRAVITY_MPS2, FloatArray
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.motion.run_curve import fastest_run
from kankaku.railway.plan.dwell import DwellDelays, Overstay
from kankaku.railway.plan.line import Block, Gradient, SpeedLimit
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.engine_contract import Observation
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Reason
from kankaku.sumo_net.build import build_native, sumo_binary
from kankaku.sumo_net.native import NativeEngine, PeerError
from kankaku.sumo_net.native_xml import STANDING_GAP_M
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from tests.ends_of_ways import joint_scenario, short_turn_scenario

READY_S = 25_200.0
LENGTH_M = 200.0
BOTH = pytest.mark.parametrize("peer", PEERS)
HILLS = (Gradient(400.0, 700.0, 0.010), Gradient(900.0, 1250.0, -0.012))
LIMITS = (SpeedLimit(450.0, 800.0, 15.0), SpeedLimit(800.0, 1500.0, 18.0))

Opener: TypeAlias = Callable[[Scenario, str], NativeEngine]


@pytest.fixture
def opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Opener:
    monkeypatch.setenv("KANKAKU_CACHE", str(tmp_path / "cache"))

    def open_native(scenario: Scenario, peer: str) -> NativeEngine:
        world = world_of(scenario)
        delay_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
        moving_block = PEERS[peer].moving_block
        folder = tmp_path / "run"
        files = build_native(scenario, world, delay_s, folder, moving_block=moving_block)
        return NativeEngine(files, world)

    return open_native


def watched(engine: NativeEngine, until_s: float) -> list[Observation]:
    seen = []
    with engine as running:
        while True:
            seen.append(running.observe())
            if seen[-1].time_s >= until_s:
                return seen
            running.apply(np.zeros(seen[-1].speed_mps.size))
            running.advance()


def recorded(opened: Opener, scenario: Scenario, peer: str) -> RunRecord:
    world = world_of(scenario)
    with opened(scenario, peer) as engine:
        delay_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
        controller = build_peer("peer", peer, world)
        patience_s = scenario.patience_s
        run = Run(world, delay_s, 1, patience_s)
        return simulate(run, engine, controller, all_meters(world))


def times(seen: list[Observation], event: str, train: int) -> list[float]:
    return [now.time_s for now in seen if train in getattr(now, event)]


def fronts_m(seen: list[Observation], train: int) -> FloatArray:
    return np.array([now.front_m[train] for now in seen])


def speeds_mps(seen: list[Observation], train: int) -> FloatArray:
    return np.array([now.speed_mps[train] for now in seen])


def overstaying(train: str, station: str, delay_s: float) -> DwellDelays:
    return DwellDelays(overstays=(Overstay(train, station, delay_s),))


@BOTH
@pytest.mark.parametrize(("step_s", "apart_s"), [(0.1, 0.3), (0.5, 0.8)])
@pytest.mark.parametrize("limits", [(), LIMITS])
def test_lone_train_runs_as_fast_as_our_fastest_run(
    opened: Opener, peer: str, step_s: float, apart_s: float, limits: tuple[SpeedLimit, ...]
) -> None:
    scenario = two_station_scenario(
        1, spacing_m=1500.0, gradients=HILLS, limits=limits, block_m=400.0, step_s=step_s
    )
    seen = watched(opened(scenario, peer), READY_S + 180.0)
    (kind,) = scenario.train_types.values()
    run_s = times(seen, "stopped", 0)[1] - times(seen, "released", 0)[0]
    fastest_s = fastest_run(scenario.line, kind, 300.0, 1800.0).run_time_s
    assert run_s == pytest.approx(fastest_s, abs=apart_s)


@BOTH
def test_limits_hold_for_the_whole_train(opened: Opener, peer: str) -> None:
    limits = (SpeedLimit(450.0, 800.0, 15.0), SpeedLimit(800.0, 1800.0, 20.0))
    scenario = two_station_scenario(1, limits=limits, block_m=400.0, step_s=0.1)
    seen = watched(opened(scenario, peer), READY_S + 200.0)
    front_m, speed_mps = fronts_m(seen, 0), speeds_mps(seen, 0)
    # Half a step apart from where SUMO has the front.
    on_slow = (front_m > 450.0 + 1.5) & (front_m < 800.0 + LENGTH_M - 1.5)
    assert speed_mps[on_slow].max() == pytest.approx(15.0, abs=1e-3)
    assert speed_mps[front_m > 450.0].max() == pytest.approx(20.0, abs=1e-3)
    assert speed_mps[front_m < 440.0].max() > 15.0


def sloping(gradient: float) -> Scenario:
    return two_station_scenario(
        1, gradients=(Gradient(700.0, 1700.0, gradient),), block_m=900.0, step_s=0.1
    )


@pytest.mark.parametrize("gradient", [0.0, 0.02])
def test_brake_has_its_own_rate_on_the_level_and_on_a_climb(
    opened: Opener, gradient: float
) -> None:
    seen = watched(opened(sloping(gradient), "sumo_native_moving"), READY_S + 110.0)
    front_m, speed_mps = fronts_m(seen, 0), speeds_mps(seen, 0)
    braking = (front_m[:-1] > 1150.0) & (speed_mps[1:] > 0.2)
    assert -np.diff(speed_mps)[braking] / 0.1 == pytest.approx(1.0, abs=0.01)
    assert front_m[-1] == 1300.0


def test_brake_is_weaker_on_a_descent_and_the_train_runs_past_its_stop(opened: Opener) -> None:
    scenario = sloping(-0.02)
    (kind,) = scenario.train_types.values()
    seen = watched(opened(scenario, "sumo_native_moving"), READY_S + 110.0)
    front_m, speed_mps = fronts_m(seen, 0), speeds_mps(seen, 0)
    braking = (front_m[:-1] > 1150.0) & (speed_mps[1:] > 0.2)
    pull_mps2 = 0.02 * GRAVITY_MPS2 * kind.gravity_ratio
    drag_mps2 = kind.resistance.force_n(speed_mps[:-1]) / kind.inertial_mass_kg
    rate_mps2 = 1.0 - pull_mps2 + drag_mps2
    assert -np.diff(speed_mps)[braking] / 0.1 == pytest.approx(rate_mps2[braking], abs=0.01)
    assert 1340.0 < front_m[-1] < 1400.0


def test_run_ends_when_a_train_runs_past_a_signal_behind_its_stop(opened: Opener) -> None:
    scenario = sloping(-0.02)
    blocks = (Block("a", "main", 0.0, 1310.0), Block("b", "main", 1310.0, 1800.0))
    scenario = replace(scenario, line=replace(scenario.line, blocks=blocks))
    with pytest.raises(PeerError, match="T1 past a booked stop"):
        watched(opened(scenario, "sumo_native_fixed"), READY_S + 300.0)


@BOTH
@pytest.mark.parametrize("step_s", [0.1, 0.5])
def test_early_train_departs_at_its_booked_time(opened: Opener, peer: str, step_s: float) -> None:
    scenario = two_station_scenario(1, block_m=400.0, step_s=step_s)
    record = recorded(opened, scenario, peer)
    booked_s = record.world.booked_departure_s[:, :-1]
    assert record.departure_s == pytest.approx(booked_s, abs=1e-6)
    assert record.arrival_s[0, 0] == READY_S
    assert record.stop_error_m == pytest.approx(0.0, abs=0.01)


@BOTH
@pytest.mark.parametrize("step_s", [0.1, 0.5])
@pytest.mark.parametrize("delays_s", [(7.0, 41.0), (7.3, 41.45)])
def test_late_train_stops_for_its_minimum_dwell_and_its_delay(
    opened: Opener, peer: str, step_s: float, delays_s: tuple[float, float]
) -> None:
    stays = tuple(
        Overstay("T1", station, delay_s)
        for station, delay_s in zip(("west", "east"), delays_s, strict=True)
    )
    scenario = two_station_scenario(
        1, run_s=60.0, block_m=400.0, delays=DwellDelays(overstays=stays), step_s=step_s
    )
    record = recorded(opened, scenario, peer)
    stays_s = (record.departure_s - record.arrival_s)[0] - 25.0 - delays_s
    assert stays_s.min() >= -1e-6
    assert stays_s.max() < step_s


@BOTH
def test_every_event_is_reported_once_and_in_order(opened: Opener, peer: str) -> None:
    scenario = merge_scenario(3, headway_s=120.0, block_m=400.0)
    seen = watched(opened(scenario, peer), READY_S + 600.0)
    for train in range(3):
        entered_s, stopped_s, released_s, left_s = (
            times(seen, name, train) for name in ("entered", "stopped", "released", "left")
        )
        assert entered_s == [READY_S + 120.0 * train] == stopped_s[:1]
        assert len(left_s) == 1
        assert len(stopped_s) == len(released_s) == 2
        assert stopped_s[0] < released_s[0] < stopped_s[1] < released_s[1] < left_s[0]
        assert (seen[-1].front_m[train], seen[-1].speed_mps[train]) == (2000.0, 0.0)
    assert all(now.collided == () for now in seen)
    assert (seen[0].entered, seen[0].front_m.tolist()) == ((), [300.0] * 3)


@BOTH
def test_train_moves_from_the_moment_its_stop_ends(opened: Opener, peer: str) -> None:
    seen = watched(opened(two_station_scenario(1, block_m=400.0), peer), READY_S + 40.0)
    at = next(index for index, now in enumerate(seen) if now.released)
    assert seen[at].time_s == READY_S + 30.0
    assert (seen[at].front_m[0], seen[at].speed_mps[0]) == (300.0, 0.0)
    assert seen[at + 1].speed_mps[0] > 0.0


@BOTH
@pytest.mark.parametrize("step_s", [0.1, 0.5])
def test_places_and_speeds_are_those_of_constant_acceleration(
    opened: Opener, peer: str, step_s: float
) -> None:
    scenario = two_station_scenario(1, gradients=HILLS, block_m=400.0, step_s=step_s)
    seen = watched(opened(scenario, peer), READY_S + 170.0)
    speed_mps, front_m = speeds_mps(seen, 0), fronts_m(seen, 0)
    mean_mps = 0.5 * (speed_mps[1:] + speed_mps[:-1])
    # SUMO takes the last bit of speed, up to 0.1 m/s, away within the step.
    halting = (speed_mps[1:] == 0.0) & (speed_mps[:-1] > 0.0)
    off_m = np.abs(np.diff(front_m) - mean_mps * step_s)
    assert off_m[~halting].max() < 1e-6
    assert off_m.max() <= 0.1 * step_s


@BOTH
def test_account_of_energy_closes(opened: Opener, peer: str) -> None:
    scenario = two_station_scenario(1, gradients=HILLS, block_m=400.0, step_s=0.1)
    energy = recorded(opened, scenario, peer).energy
    used_j = energy.resistance_j + energy.potential_j + energy.kinetic_j
    assert energy.traction_j - energy.braking_j == pytest.approx(used_j, rel=1e-3)


@BOTH
def test_follower_waits_behind_a_train_that_overstays(opened: Opener, peer: str) -> None:
    delays = overstaying("T1", "east", 240.0)
    scenario = two_station_scenario(2, headway_s=90.0, block_m=150.0, delays=delays)
    record = recorded(opened, scenario, peer)
    assert record.completed.all()
    assert record.violations == ()
    (row,) = set(record.standstills.row)
    assert row == 1
    front_m = float(record.standstills.front_m.max())
    gap_m = 1300.0 - LENGTH_M - front_m
    if PEERS[peer].moving_block:
        assert gap_m == pytest.approx(STANDING_GAP_M, abs=0.5)
    else:
        # It stands before the signal of the block that holds the tail, which begins at 1050 m.
        assert 1050.0 - 3.0 < front_m < 1050.0


def test_moving_block_keeps_braking_distance_and_fifty_metres_or_five_below_30_kmh(
    opened: Opener,
) -> None:
    delays = overstaying("T1", "east", 60.0)
    scenario = two_station_scenario(3, 70.0, spacing_m=2000.0, delays=delays, step_s=0.1)
    seen = watched(opened(scenario, "sumo_native_moving"), READY_S + 420.0)
    for ahead, behind in ((0, 1), (1, 2)):
        speed_mps = speeds_mps(seen, behind)
        gap_m = fronts_m(seen, ahead) - LENGTH_M - fronts_m(seen, behind)
        spare_m = gap_m - speed_mps**2 / 2.0
        near = (fronts_m(seen, ahead) < 2800.0) & (speed_mps > 0.0)
        # A train at 30 km/h may be one step of traction faster.
        fast = near & (speed_mps > 30.0 / 3.6 + 0.1)
        assert spare_m[fast].min() == pytest.approx(50.0, abs=0.1)
        assert spare_m[near].min() == pytest.approx(STANDING_GAP_M, abs=0.1)


def test_fixed_block_holds_one_train_at_a_time(opened: Opener) -> None:
    delays = overstaying("T1", "east", 60.0)
    scenario = two_station_scenario(3, 80.0, block_m=250.0, delays=delays)
    seen = watched(opened(scenario, "sumo_native_fixed"), READY_S + 500.0)
    fronts = np.array([now.front_m for now in seen])
    present = (fronts > 300.0) & (fronts < 1800.0)
    for block in scenario.line.blocks:
        inside = present & (fronts > block.start_m) & (fronts - LENGTH_M < block.end_m)
        assert inside.sum(axis=1).max() == 1


@BOTH
def test_train_waits_outside_until_its_platform_is_free(opened: Opener, peer: str) -> None:
    scenario = two_station_scenario(2, headway_s=25.0, block_m=400.0)
    seen = watched(opened(scenario, peer), READY_S + 200.0)
    (entered_s,) = times(seen, "entered", 1)
    front_m = next(now.front_m[0] for now in seen if now.time_s == entered_s)
    assert front_m - LENGTH_M >= 300.0
    assert times(seen, "stopped", 1)[0] == entered_s


@BOTH
def test_order_where_tracks_join_is_that_of_the_timetable(
    opened: Opener, peer: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    delays = overstaying("T1", "west", 120.0)
    scenario = merge_scenario(3, headway_s=60.0, block_m=400.0, delays=delays)

    def order() -> list[int]:
        seen = watched(opened(scenario, peer), READY_S + 700.0)
        return [row for now in seen for row in now.left]

    assert order() == [0, 1, 2]
    # Without the constraints SUMO lets the train go first that is ready first.
    monkeypatch.setattr("kankaku.sumo_net.native_xml.precedences", lambda *_: iter(()))
    assert order() == [1, 0, 2]


@BOTH
def test_nothing_but_the_peer_binds_the_speed_and_our_rules_judge_nothing(
    opened: Opener, peer: str
) -> None:
    record = recorded(opened, merge_scenario(2, block_m=400.0), peer)
    assert set(record.trajectory.reason) == {int(Reason.DWELLING), int(Reason.PEER)}
    assert record.violations == ()
    assert record.completed.all()


@BOTH
def test_trains_that_never_get_through_are_unfinished(opened: Opener, peer: str) -> None:
    delays = overstaying("T1", "east", 900.0)
    scenario = two_station_scenario(2, block_m=400.0, delays=delays)
    record = recorded(opened, replace(scenario, patience_s=10.0), peer)
    assert record.violations == ()
    assert [item.row for item in record.unfinished] == [0, 1]
    assert record.unfinished[0].sentence == "T1 still stood at 'east': its stop was not over"


@BOTH
def test_a_peers_train_leaves_where_its_service_ends(opened: Opener, peer: str) -> None:
    record = recorded(opened, short_turn_scenario(4, block_m=400.0), peer)
    assert record.completed.all()
    assert record.violations == ()
    booked_s = record.world.booked_departure_s[[1, 3], 1]
    assert record.departure_s[[1, 3], 1] == pytest.approx(booked_s, abs=1.0)
    assert record.energy.distance_m[[1, 3]] == pytest.approx(1200.0, abs=6.0)
    assert record.energy.distance_m[[0, 2]] == pytest.approx(3700.0, abs=20.0)


@BOTH
def test_a_peers_train_stops_at_the_buffer_stop(opened: Opener, peer: str) -> None:
    scenario = joint_scenario(0.0)
    blocks = tuple(
        Block(track.id, track.id, track.start_m, track.end_m)
        for track in scenario.line.track_by_id.values()
    )
    record = recorded(opened, replace(scenario, line=replace(scenario.line, blocks=blocks)), peer)
    assert record.completed.all()
    assert np.isfinite(record.arrival_s).all()


def test_window_is_driven_through_the_same_interface(
    opened: Opener, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The command line of sumo takes the options of sumo-gui, and needs no display.
    scenario = two_station_scenario(1, block_m=400.0)
    without = watched(opened(scenario, "sumo_native_fixed"), READY_S + 60.0)
    monkeypatch.setattr("kankaku.sumo_net.door.sumo_binary", lambda _: sumo_binary("sumo"))
    engine = opened(scenario, "sumo_native_fixed")
    windowed = NativeEngine(engine._files, world_of(scenario), gui=True)  # noqa: SLF001
    seen = watched(windowed, READY_S + 60.0)
    assert fronts_m(seen, 0).tolist() == fronts_m(without, 0).tolist()
