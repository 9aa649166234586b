"""Headways that signalling engineers publish, and their closed form over a moving block."""

from collections.abc import Iterator
from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from kankaku.controllers import registry
from kankaku.railway.capacity.blocking_time import blocking_times_s, technical_headways
from kankaku.railway.capacity.permitted import permitted_profile
from kankaku.railway.motion.journey import technical_journey
from kankaku.railway.plan.line import Block
from kankaku.railway.plan.rolling_stock import RunningResistance, Traction, TrainType
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.railway.plan.timetable import Call, Service, Timetable
from kankaku.railway.plan.world import World, build_world
from kankaku.railway.step.control import Foresight
from kankaku.testing.example_lines import commuter_train, straight_line

DWELL_S, LENGTH_M = 30.0, 200.0
SPEED_MPS = 120.0 / 3.6
BRAKING_M = 1180.0
"""From 120 km/h. [m]"""
SIGHTING_S, OVERLAP_M = 10.0, 183.0
NEEDED_M = 1189.0
"""One block of three aspects, or two of four. [m]"""
STARTS_MPS2 = 0.50765
STOPS_M = {"west": 0.0, "mid": 9512.0, "east": 19_024.0}


def steady_train(acceleration_mps2: float, brake_mps2: float, speed_mps: float) -> TrainType:
    """A train of constant acceleration and braking that meets no resistance."""
    kind = commuter_train(LENGTH_M, brake_mps2)
    force_n = acceleration_mps2 * kind.inertial_mass_kg
    return replace(
        kind,
        traction=Traction(force_n, 110.0, 120.0),
        resistance=RunningResistance(0.0, 0.0, 0.0),
        maximum_speed_mps=speed_mps,
    )


def divided(block: Block) -> Iterator[Block]:
    """Yield the circuits of a block: its overlap behind the signal, and the rest."""
    joint_m = min(block.start_m + OVERLAP_M, block.end_m)
    yield replace(block, id=f"{block.id}-overlap", end_m=joint_m)
    if joint_m < block.end_m:
        yield replace(block, id=f"{block.id}-rest", start_m=joint_m)


def world_with(train: TrainType, block_m: float | None) -> World:
    line = straight_line(STOPS_M, 19_624.0, block_m=block_m)
    circuits = tuple(circuit for block in line.blocks for circuit in divided(block))
    calls = tuple(
        Call(name, "main", stop_m, 25_200.0 + 600.0 * place, 25_230.0 + 600.0 * place, DWELL_S)
        for place, (name, stop_m) in enumerate(STOPS_M.items())
    )
    timetable = Timetable((Service("one", "west", train.id, ("main",), calls),))
    line = replace(line, circuits=circuits)
    return build_world(line, {train.id: train}, timetable, 0.1)


def clears_s(runs_m: float) -> float:
    """Return how long the leader takes from its stop until it has run so far."""
    gaining_m = 0.5 * SPEED_MPS**2 / STARTS_MPS2
    if runs_m <= gaining_m:
        return float(np.sqrt(2.0 * runs_m / STARTS_MPS2))
    return runs_m / SPEED_MPS + 0.5 * SPEED_MPS / STARTS_MPS2


def foresight_of(world: World, protection: str, **options: float | tuple[float, ...]) -> Foresight:
    spec = ControllerSpec("x", protection, "close_up", options, {})
    return cast("Foresight", registry.build(spec, world).protection)


@pytest.mark.parametrize(
    ("block_m", "codes_kmh", "non_stop_s", "stopping_s"),
    [(NEEDED_M, (120.0, 0.0), 92.8, 191.0), (NEEDED_M / 2.0, (120.0, 84.8, 0.0), 75.0, 173.1)],
)
def test_three_and_four_aspect_signals_have_the_headways_of_the_exam(
    block_m: float, codes_kmh: tuple[float, ...], non_stop_s: float, stopping_s: float
) -> None:
    # IRSE examination forum, threads 138 and 890: 120 km/h, 10 s of sighting, 183 m of overlap,
    # 200 m of train; stopping adds V/2b + dwell + V/2a.
    train = steady_train(STARTS_MPS2, SPEED_MPS**2 / 2.0 / BRAKING_M, SPEED_MPS)
    world = world_with(train, block_m)
    foresight = foresight_of(
        world,
        "multi_step_atc",
        codes_kmh=codes_kmh,
        idle_time_s=0.0,
        overlap_m=0.0,
        sighting_time_s=SIGHTING_S,
        overlap_beyond_m=OVERLAP_M,
    )
    journey = technical_journey(world, permitted_profile(world, foresight, 0), 0)
    found_s = technical_headways(world, foresight, journey)[0].headway_s
    # Nine metres before it brakes for the stop the follower passes the last signal that must not
    # show a lower code: when he sees it the leader has cleared the block behind the stop, and the
    # overlap behind that. Where blocks are short it is still gaining speed then.
    arrives_s = (NEEDED_M - BRAKING_M + 2.0 * BRAKING_M) / SPEED_MPS
    closed_s = SIGHTING_S + DWELL_S + clears_s(block_m + OVERLAP_M + LENGTH_M) + arrives_s
    assert found_s == pytest.approx(closed_s, abs=0.05)
    assert found_s == pytest.approx(stopping_s, abs=0.1)
    edges_m = np.array([block.start_m for block in world.line.blocks[:16]])
    begin_s, end_s = blocking_times_s(world, foresight, journey, edges_m)
    # Where the leader runs at full speed, three or four blocks before the station.
    running = (edges_m[1:] + LENGTH_M < STOPS_M["mid"] - BRAKING_M) & (edges_m[:-1] > 4500.0)
    assert running.any()
    assert (end_s - begin_s)[running] == pytest.approx(non_stop_s, abs=0.1)


@pytest.mark.parametrize(("speed_kmh", "published_s"), [(50.0, 61.15), (80.0, 65.1), (90.0, 67.2)])
def test_a_moving_block_has_the_station_headway_of_the_textbook(
    speed_kmh: float, published_s: float
) -> None:
    # 200 m of train, 10 m of margin, 1.3 m/s2 both ways, 30 s of dwell.
    speed_mps, rate_mps2, margin_m = speed_kmh / 3.6, 1.3, 10.0
    world = world_with(steady_train(rate_mps2, rate_mps2, speed_mps), None)
    foresight = foresight_of(world, "moving_block", margin_m=margin_m)
    journey = technical_journey(world, permitted_profile(world, foresight, 0), 0)
    found_s = technical_headways(world, foresight, journey)[0].headway_s
    clears_s = (LENGTH_M + margin_m) / speed_mps + speed_mps / 2.0 / rate_mps2
    closed_s = DWELL_S + clears_s + speed_mps / rate_mps2
    assert found_s == pytest.approx(closed_s, abs=0.05)
    assert found_s == pytest.approx(published_s, abs=0.06)
