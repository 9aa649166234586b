"""Random block layouts, gradients, codes and trains: nobody passes a boundary at danger."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kankaku.controllers.drive import TractionDrive
from kankaku.controllers.operation.close_up import no_advice
from kankaku.controllers.registry import PROTECTIONS, ControllerError, Medium, build
from kankaku.railway.arrays import GRAVITY_MPS2, BoolArray, FloatArray
from kankaku.railway.plan.line import Block, Gradient, Line, Platform, Section, SpeedLimit, Track
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.railway.plan.timetable import Call, Service
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Separation
from kankaku.railway.step.obstructions import unobstructed
from kankaku.railway.step.state import NOTHING, Events, LineState
from kankaku.testing.example_lines import commuter_train, make_scenario, stations_at, world_of
from tests.examples import all_if_deep, examples

RUNNERS = 50
CASES = all_if_deep([10_000], [2_000])[0]
LINE_M = 5000.0
STOP_M = 300.0
STEPS = 240
STEP_S = 0.5
WITHIN_A_STEP_M = 0.05 + 1.2 * STEP_S**2 / 8.0
"""By which a train that stops within a step may pass its aim. [m]"""
MANY = settings(
    # Two of three layouts are accepted.
    max_examples=5 * CASES // (2 * RUNNERS),
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
FEW = examples(20)


@dataclass(frozen=True)
class Ahead:
    """Trains that stand, start, run on and brake their hardest; arrays of shape (RUNNERS,)."""

    tail_m: FloatArray
    starts_s: FloatArray
    brakes_s: FloatArray
    fastest_mps: FloatArray


def random_line(rng: np.random.Generator) -> Line:
    """Parallel tracks with blocks of their own, over the same hills and limits."""
    tracks = tuple(Track(f"track-{number}", 0.0, LINE_M) for number in range(RUNNERS))
    blocks = []
    for track in tracks:
        mean_m = rng.uniform(100.0, 500.0)
        inner_m = np.cumsum(rng.uniform(0.4, 1.6, 200) * mean_m)
        ends_m = np.round([0.0, *inner_m[inner_m < LINE_M - 10.0], LINE_M], 3).tolist()
        blocks += [
            Block(f"{track.id}-{number}", track.id, start_m, end_m)
            for number, (start_m, end_m) in enumerate(pairwise(ends_m))
        ]
    places_m = np.sort(rng.uniform(0.0, LINE_M, 6)).tolist()
    steepest = rng.choice([0.0, 0.01, 0.035])
    return Line(
        name="random",
        stations=stations_at({"west": STOP_M}),
        sections=(Section(0.0, LINE_M, tracks),),
        platforms=tuple(Platform("west", track.id, 50.0, 320.0, STOP_M) for track in tracks),
        turnouts=(),
        limits=(SpeedLimit(places_m[0], places_m[3], rng.uniform(8.0, 30.0)),),
        gradients=tuple(
            Gradient(start_m, end_m, rng.uniform(-steepest, steepest))
            for start_m, end_m in pairwise(places_m)
            if end_m > start_m
        ),
        curves=(),
        balises_m=(),
        blocks=tuple(blocks),
        release_delay_s=rng.choice([0.0, 1.0, 3.0]),
    )


def random_world(rng: np.random.Generator) -> World:
    """On every track a train ahead (even rows) and one behind it (odd rows)."""
    line = random_line(rng)
    services = [
        Service(
            f"{role}-{track.id}",
            "west",
            "commuter",
            (track.id,),
            (Call("west", track.id, STOP_M, 0.0, 30.0, 25.0),),
        )
        for track in line.sections[0].tracks
        for role in ("ahead", "behind")
    ]
    train = commuter_train(rng.uniform(40.0, 250.0), rng.uniform(0.6, 1.2))
    return world_of(make_scenario(line, services, train, step_s=STEP_S))


def random_ahead(rng: np.random.Generator, world: World) -> Ahead:
    starts_s = rng.uniform(0.0, 60.0, RUNNERS)
    return Ahead(
        rng.uniform(1500.0, LINE_M - 1500.0, RUNNERS),
        np.where(rng.random(RUNNERS) < 0.5, np.inf, starts_s),
        starts_s + rng.uniform(0.0, 40.0, RUNNERS),
        rng.uniform(0.0, world.train_types[0].maximum_speed_mps, RUNNERS),
    )


def state_of(world: World, time_s: float, front_m: FloatArray, speed_mps: FloatArray) -> LineState:
    size = world.size
    behind = np.arange(size) % 2 == 1
    tail_m = front_m - world.length_m
    everybody, far_m = np.ones(size, dtype=np.bool_), np.full(size, world.far_m)
    return LineState(
        time_s=time_s,
        front_m=front_m,
        tail_m=tail_m,
        speed_mps=speed_mps,
        present=everybody,
        running=everybody,
        leader=np.where(behind, np.arange(size) - 1, -1),
        follows=behind,
        clear_to_m=np.where(behind, np.roll(tail_m, 1), far_m),
        granted_to_m=far_m,
        granted_by=np.full(size, NOTHING),
        next_call=np.ones(size, dtype=np.intp),
        stop_m=far_m,
        arrival_s=np.zeros(size),
        events=Events(),
        wayside=unobstructed(size, world.far_m),
        calls_version=0,
        wayside_version=0,
    )


def fastest_start(rng: np.random.Generator, protection: Any, front_m: FloatArray) -> FloatArray:  # noqa: ANN401
    """As fast as is permitted there behind the train ahead."""
    speed_mps = np.zeros(front_m.size)
    for row in range(1, front_m.size, 2):
        ahead_m = front_m[[row - 1]]
        eoa_m = protection.eoa_behind_m(row, 1, row - 1, ahead_m, np.zeros(1))
        permitted = protection.permitted_mps(row, front_m[[row]], eoa_m)[0]
        speed_mps[row] = permitted * rng.choice([1.0, 1.0, rng.random()])
    return speed_mps


def random_options(rng: np.random.Generator, protection: str) -> Mapping[str, Any]:
    if protection == "multi_step_atc":
        falling = np.sort(rng.uniform(8.0, 110.0, rng.integers(1, 6)))[::-1].round(1)
        return {
            "codes_kmh": (*np.unique(falling)[::-1].tolist(), 0.0),
            "idle_time_s": float(rng.choice([0.0, 1.0, 2.0, 4.0])),
            "overlap_m": float(rng.choice([0.0, 10.0, 25.0])),
            "release_below_kmh": float(rng.choice([0.0, 3.0])),
            "sighting_time_s": float(rng.choice([0.0, 0.0, 4.0, 10.0])),
            "overlap_beyond_m": float(rng.choice([0.0, 0.0, 100.0])),
        }
    if protection == "atd":
        return {
            "step_m": float(rng.choice([5.0, 20.0, 25.0])),
            "control_brake_percent": float(rng.choice([60.0, 90.0, 100.0])),
            "idle_time_s": float(rng.choice([0.0, 1.5])),
        }
    if protection == "digital_atc":
        return {
            "pattern_brake_percent": float(rng.choice([60.0, 90.0, 100.0])),
            "idle_time_s": float(rng.choice([0.0, 2.0])),
            "overlap_m": float(rng.choice([0.0, 25.0])),
        }
    if protection == "relative_braking":
        # Just harder than the 1.3 m/s2 with which the train ahead does brake.
        return {"margin_m": 0.0, "leader_brake_kmhps": 4.69}
    return {"margin_m": 0.0}


def run_on(
    world: World,
    protection: Any,  # noqa: ANN401
    front_m: FloatArray,
    speed_mps: FloatArray,
    ahead: Ahead,
    *,
    codes_only: bool,
) -> Iterator[LineState]:
    """Yield states; every train behind runs as fast as the drive may."""
    drive, memory = TractionDrive(world), protection.initial()
    nothing = no_advice(world.size)
    train = world.train_types[0]
    for step in range(STEPS):
        time_s = STEP_S * step
        state = state_of(world, time_s, front_m, speed_mps)
        authority, memory = protection.authorise(state, memory)
        yield state
        if codes_only:
            # Else the drive would brake in time whatever the codes are.
            authority = authority._replace(eoa_m=state.stop_m)
        next_mps = drive.command(state, authority, nothing).speed_mps.copy()
        leading = speed_mps[::2]
        going = (time_s >= ahead.starts_s) & (time_s < ahead.brakes_s)
        faster = np.minimum(leading + 0.9 * STEP_S, ahead.fastest_mps)
        # Gravity helps the brake uphill, and no train brakes harder than that.
        rise_m = world.line.height_m(front_m[::2]) - world.line.height_m(state.tail_m[::2])
        gravity = GRAVITY_MPS2 * train.gravity_ratio * rise_m / train.length_m
        slower = np.maximum(leading - (train.emergency_brake_mps2 + gravity) * STEP_S, 0.0)
        next_mps[::2] = np.where(going, np.maximum(faster, slower), slower)
        front_m = front_m + 0.5 * (speed_mps + next_mps) * STEP_S
        speed_mps = next_mps


def boundaries_m(world: World) -> FloatArray:
    """Starts of the blocks of every track, infinite where there are no more of them."""
    starts_m: list[list[float]] = [[] for _ in range(RUNNERS)]
    for block in world.line.blocks:
        starts_m[int(block.track.removeprefix("track-"))].append(block.start_m)
    most = max(map(len, starts_m))
    return np.array([[*row, *[np.inf] * (most - len(row))] for row in starts_m])


def danger_m(starts_m: FloatArray, state: LineState) -> FloatArray:
    """Where the block begins that the tail of each train ahead is in."""
    passed = (starts_m <= state.tail_m[::2, np.newaxis]).sum(axis=1)
    begins_m: FloatArray = starts_m[np.arange(RUNNERS), passed - 1]
    return begins_m


# Who has commands by radio alone is not put on the line running: see test_control_maps.py.
AT_ONCE = [name for name, layer in PROTECTIONS.items() if layer.medium is not Medium.RADIO]


@pytest.mark.parametrize("protection", AT_ONCE)
def test_no_layout_that_is_accepted_lets_a_train_pass_a_boundary_at_danger(
    protection: str,
) -> None:
    tried = {"accepted": 0, "stood": 0}

    def nobody_overruns(seed: int) -> None:
        rng = np.random.default_rng(seed)
        world = random_world(rng)
        options = random_options(rng, protection)
        spec = ControllerSpec("x", protection, "close_up", options, {})
        try:
            controller = build(spec, world)
        except ControllerError:
            return
        ahead = random_ahead(rng, world)
        front_m = np.empty(world.size)
        front_m[::2] = ahead.tail_m + world.length_m[::2]
        front_m[1::2] = rng.uniform(STOP_M, ahead.tail_m)
        speed_mps = fastest_start(rng, controller.protection, front_m)
        fixed = controller.separation in {Separation.BLOCKS, Separation.CIRCUITS}
        codes_only = controller.separation is Separation.BLOCKS
        starts_m, overlap_m = boundaries_m(world), options.get("overlap_m", 25.0)
        outside: BoolArray | None = None
        for state in run_on(
            world, controller.protection, front_m, speed_mps, ahead, codes_only=codes_only
        ):
            behind_m = state.front_m[1::2]
            assert np.all(behind_m <= state.tail_m[::2] + WITHIN_A_STEP_M)
            if fixed:
                until_m = danger_m(starts_m, state) - overlap_m
                if outside is None:
                    outside = behind_m <= until_m
                assert np.all(behind_m[outside] <= until_m[outside] + WITHIN_A_STEP_M)
        tried["accepted"] += RUNNERS
        tried["stood"] += int(np.count_nonzero(state.speed_mps[1::2] <= 0.0))

    many = protection == "multi_step_atc"
    rounds = MANY if many else FEW
    rounds(given(st.integers(0, 2**32 - 1))(nobody_overruns))()
    assert tried["accepted"] >= (CASES if many else 100)
    assert tried["stood"] >= 0.1 * tried["accepted"]
