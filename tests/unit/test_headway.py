"""Technical headways and blocking times against closed forms, and on the rush-hour line."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from kankaku.controllers import registry
from kankaku.controllers.protection.multi_step_atc import MultiStepAtc
from kankaku.railway.capacity.blocking_time import (
    Given,
    SharedTrack,
    blocking_times_s,
    leg_headway,
    technical_headways,
)
from kankaku.railway.capacity.compression import (
    common_ways,
    compressed_shifts_s,
    least_shifts_s,
    occupation_s,
)
from kankaku.railway.motion.journey import booked_journey, technical_journey
from kankaku.railway.plan.line import Line, SpeedLimit
from kankaku.railway.plan.rolling_stock import RunningResistance, Traction, TrainType
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.railway.plan.timetable import Call, Service, Timetable
from kankaku.railway.plan.world import World, build_world
from kankaku.railway.step.control import Foresight
from kankaku.scenarios.loading.load import load
from kankaku.testing.example_lines import commuter_train, straight_line

RUSH_HOUR = Path(__file__).parents[2] / "scenarios" / "rush_hour"
LENGTH_M, MARGIN_M, DWELL_S = 200.0, 25.0, 40.0
ACCELERATION_MPS2, BRAKE_MPS2, EMERGENCY_MPS2 = 0.7, 1.0, 1.3
STOPS_M = {"west": 500.0, "mid": 3500.0, "east": 6500.0}
EXACT_S = 0.02
"""Starting force over inertia is constant up to the speed held; the metre grid is not exact."""


def steady_train(acceleration_mps2: float = ACCELERATION_MPS2) -> TrainType:
    """A train of constant acceleration that meets no resistance."""
    kind = commuter_train(LENGTH_M, BRAKE_MPS2)
    force_n = acceleration_mps2 * kind.inertial_mass_kg
    return replace(
        kind,
        traction=Traction(force_n, 100.0, 120.0),
        resistance=RunningResistance(0.0, 0.0, 0.0),
        emergency_brake_mps2=EMERGENCY_MPS2,
    )


def steady_line(speed_mps: float, block_m: float | None = None) -> Line:
    limit = SpeedLimit(0.0, 9000.0, speed_mps)
    return straight_line(STOPS_M, 9000.0, limits=[limit], block_m=block_m)


def world_on(line: Line, trains: int = 1, interval_s: float = 300.0) -> World:
    services = [
        Service(f"T{number}", "west", "commuter", ("main",), _calls(25_200.0 + number * interval_s))
        for number in range(trains)
    ]
    return build_world(line, {"commuter": steady_train()}, Timetable(tuple(services)), 0.1)


def _calls(ready_s: float) -> tuple[Call, ...]:
    return tuple(
        Call(
            name, "main", stop_m, ready_s + 240.0 * number, ready_s + 240.0 * number + DWELL_S, 30.0
        )
        for number, (name, stop_m) in enumerate(STOPS_M.items())
    )


def protection(world: World, name: str, **options: float) -> Foresight:
    spec = ControllerSpec("x", name, "close_up", options, {})
    return cast("Foresight", registry.build(spec, world).protection)


def into_mid_s(world: World, foresight: Foresight) -> float:
    journey = technical_journey(world, foresight.profile, 0)
    return technical_headways(world, foresight, journey)[0].headway_s


def begins_to_brake_s(speed_mps: float, gain_mps2: float) -> float:
    """
    Time from a leader's start until a follower may reach its own braking point.

    The follower's braking point runs at its speed v, the room behind the leader grows as
    gain t^2 / 2 until it grows by v, too: they touch where both have the same speed, or where
    the follower begins to brake. Tangent condition of Sato et al. 2025, eqs. (14), (15).
    """
    clear_m = LENGTH_M + MARGIN_M
    touches_s = clear_m / speed_mps + 0.5 * speed_mps / gain_mps2
    if speed_mps / gain_mps2 <= touches_s:
        return touches_s
    return float(np.sqrt(2.0 * clear_m / gain_mps2))


@pytest.mark.parametrize("speed_mps", [10.0, 15.0, 20.0, 25.0])
def test_a_moving_block_has_the_headway_of_the_closed_form(speed_mps: float) -> None:
    world = world_on(steady_line(speed_mps))
    found_s = into_mid_s(world, protection(world, "moving_block", margin_m=MARGIN_M))
    leaves_s = begins_to_brake_s(speed_mps, ACCELERATION_MPS2)
    assert found_s == pytest.approx(DWELL_S + leaves_s + speed_mps / BRAKE_MPS2, abs=EXACT_S)


@pytest.mark.parametrize("speed_mps", [10.0, 15.0, 20.0, 25.0])
def test_relative_braking_counts_the_leaders_braking_distance(speed_mps: float) -> None:
    # A leader at speed v stands v^2 / 2 b_l further on: its rear gains a (1 + a / b_l).
    world = world_on(steady_line(speed_mps))
    options = {"margin_m": MARGIN_M, "leader_brake_kmhps": 3.6 * EMERGENCY_MPS2}
    found_s = into_mid_s(world, protection(world, "relative_braking", **options))
    gain_mps2 = ACCELERATION_MPS2 * (1.0 + ACCELERATION_MPS2 / EMERGENCY_MPS2)
    leaves_s = begins_to_brake_s(speed_mps, gain_mps2)
    assert found_s == pytest.approx(DWELL_S + leaves_s + speed_mps / BRAKE_MPS2, abs=EXACT_S)


def clears_s(tail_runs_m: float, speed_mps: float) -> float:
    """Time from a start until a tail has run some way, up to a speed that is held then."""
    speeding_m = 0.5 * speed_mps**2 / ACCELERATION_MPS2
    if tail_runs_m <= speeding_m:
        return float(np.sqrt(2.0 * tail_runs_m / ACCELERATION_MPS2))
    return tail_runs_m / speed_mps + 0.5 * speed_mps / ACCELERATION_MPS2


@pytest.mark.parametrize("block_m", [250.0, 320.0, 400.0])
@pytest.mark.parametrize("speed_mps", [12.0, 18.0])
def test_fixed_blocks_are_needed_where_the_code_falls_below_the_speed(
    block_m: float, speed_mps: float
) -> None:
    line = replace(steady_line(speed_mps, block_m), release_delay_s=1.5)
    world = world_on(line)
    foresight = protection(world, "multi_step_atc")
    # Blocks, speed and grade are the same everywhere before the end of the line.
    assert isinstance(foresight, MultiStepAtc)
    free = int(np.argmax(foresight.code_mps[0, 3] >= speed_mps))
    stop_m, length_m = STOPS_M["mid"], LENGTH_M
    braking_m = 0.5 * speed_mps**2 / BRAKE_MPS2
    expected_s = []
    for block in line.blocks:
        given_up_m = block.start_m + (free + 1) * block_m
        approaching_m = stop_m - braking_m - block.start_m
        # Further back the leader has given up all before it has stopped.
        if approaching_m < 0.0 or given_up_m <= stop_m - length_m:
            continue
        leaves_s = clears_s(given_up_m - (stop_m - length_m), speed_mps)
        arrives_s = approaching_m / speed_mps + speed_mps / BRAKE_MPS2
        expected_s.append(DWELL_S + leaves_s + 1.5 + arrives_s)
    # The lower code may be shown for the idle time.
    assert into_mid_s(world, foresight) == pytest.approx(max(expected_s) - 2.0, abs=EXACT_S)


def test_the_idle_time_of_the_codes_is_not_a_hindrance() -> None:
    world = world_on(steady_line(18.0, 320.0))
    strict: Any = protection(world, "multi_step_atc")
    strict.idle_time_s = 0.0
    strict_s = into_mid_s(world, strict)
    headway_s = into_mid_s(world, protection(world, "multi_step_atc"))
    assert headway_s == pytest.approx(strict_s - 2.0, abs=EXACT_S)


def test_the_headway_grows_with_the_margin_and_by_the_dwell() -> None:
    world = world_on(steady_line(20.0))
    headways_s = [
        into_mid_s(world, protection(world, "moving_block", margin_m=margin_m))
        for margin_m in (0.0, 25.0, 50.0, 100.0)
    ]
    assert all(before < after for before, after in pairwise(headways_s))
    later_s = np.array([0.0, 15.0, 0.0, 0.0])
    longer = replace(world, booked_departure_s=world.booked_departure_s + later_s)
    foresight = protection(world, "moving_block", margin_m=0.0)
    assert into_mid_s(longer, foresight) == pytest.approx(headways_s[0] + 15.0, abs=EXACT_S)


@pytest.mark.parametrize(
    ("name", "pieces"),
    [("multi_step_atc", "blocks"), ("atd", "track_circuits"), ("digital_atc", "track_circuits")],
)
def test_stairways_at_the_headway_touch_and_do_not_overlap(name: str, pieces: str) -> None:
    line = steady_line(20.0, 320.0)
    world = world_on(line)
    foresight = protection(world, name)
    journey = technical_journey(world, foresight.profile, 0)
    headways = technical_headways(world, foresight, journey)
    edges_m = np.array([*(piece.start_m for piece in getattr(line, pieces)), line.end_m])
    begin_s, end_s = blocking_times_s(world, foresight, journey, edges_m)
    needed = np.isfinite(begin_s)
    assert (end_s[needed] > begin_s[needed]).all()
    assert (np.diff(end_s[needed]) >= 0.0).all()
    greatest_s = max(headway.headway_s for headway in headways)
    assert np.nanmax(end_s - begin_s) == pytest.approx(greatest_s, abs=0.06)


def test_a_moving_block_keeps_a_place_until_tail_and_margin_have_passed_it() -> None:
    world = world_on(steady_line(20.0))
    foresight = protection(world, "moving_block", margin_m=MARGIN_M)
    journey = technical_journey(world, foresight.profile, 0)
    begin_s, end_s = blocking_times_s(world, foresight, journey, np.array([2000.0, 2050.0, 2100.0]))
    # At 20 m/s throughout: the braking distance of 200 m and the margin before the place begins,
    # and the length of the train behind where it ends.
    front_m, _ = journey.at(np.concatenate([begin_s, end_s]))
    assert front_m == pytest.approx([1775.0, 1825.0, 2250.0, 2300.0], abs=1.1)


def test_a_journey_is_where_it_is_booked_and_as_fast_as_the_curve() -> None:
    world = world_on(steady_line(20.0))
    journey = booked_journey(world, world.profile, 0)
    assert journey.arrival_s.tolist() == world.booked_arrival_s[0, :3].tolist()
    front_m, speed_mps = journey.at(np.array([*journey.arrival_s, *journey.departure_s]))
    assert front_m == pytest.approx([*STOPS_M.values(), *STOPS_M.values()], abs=1e-6)
    assert speed_mps == pytest.approx(0.0, abs=1e-6)
    fast = technical_journey(world, world.profile, 0)
    moments_s = fast.departure_s[0] + np.array([5.0, 10.0])
    front_m, speed_mps = fast.at(moments_s)
    # The first metre is run at constant acceleration, too.
    assert speed_mps == pytest.approx([3.5, 7.0], abs=0.01)
    assert front_m == pytest.approx([508.75, 535.0], abs=0.05)


def test_trains_of_one_pattern_are_compressed_to_their_headway() -> None:
    world = world_on(steady_line(20.0), trains=3, interval_s=300.0)
    foresight = protection(world, "moving_block", margin_m=MARGIN_M)
    journeys = [booked_journey(world, foresight.profile, row) for row in range(3)]
    least_s = least_shifts_s(world, foresight, journeys)
    calls = range(journeys[0].arrival_s.size)
    legs = [
        leg_headway(Given(world, foresight, journeys[0], 0, call), journeys[0]) for call in calls
    ]
    headway_s = max(leg.headway_s for leg in legs)
    assert least_s[0, 1] == pytest.approx(headway_s - 300.0, abs=0.06)
    assert compressed_shifts_s([0, 1, 2], least_s)[2] == pytest.approx(2.0 * least_s[0, 1], abs=0.1)
    compressed_s, booked_s = occupation_s(journeys, [0, 1, 2], least_s)
    assert booked_s == 600.0
    assert compressed_s == pytest.approx(2.0 * headway_s, abs=0.2)


@pytest.fixture(scope="module")
def rush_hour() -> World:
    scenario = load(RUSH_HOUR)
    return build_world(scenario.line, scenario.train_types, scenario.timetable, scenario.step_s)


def test_on_the_rush_hour_line_every_method_is_closer_than_the_one_before(rush_hour: World) -> None:
    headways_s = []
    late: dict[str, Any] = {name: {"idle_time_s": 2.0} for name in ("atd", "digital_atc")}
    for name in ("multi_step_atc", "atd", "digital_atc", "moving_block", "relative_braking"):
        foresight = protection(rush_hour, name, **late.get(name, {}))
        journey = technical_journey(rush_hour, foresight.profile, 0)
        found = technical_headways(rush_hour, foresight, journey)
        headways_s.append([headway.headway_s for headway in found])
    assert len(headways_s[0]) == len(rush_hour.line.stations) - 1
    assert (np.diff(headways_s, axis=0) < 0.0).all()


def test_trains_on_two_tracks_share_the_line_behind_the_points_and_the_points(
    rush_hour: World,
) -> None:
    line, services = rush_hour.line, rush_hour.timetable.services
    through = next(service for service in services if service.origin == "omiya")
    starting = next(service for service in services if service.origin == "minami-urawa")
    points = {turnout.id: turnout for turnout in line.turnouts}
    north, south = points["minami-urawa-north"], points["minami-urawa-south"]
    (behind,) = common_ways(line, starting, through)
    # 5.0 s of throw and 1.5 s of lock proof.
    assert behind == SharedTrack(south.fouling_end_m, south.fouling_start_m, throws_s=(6.5, 0.0))
    (ahead,) = common_ways(line, through, starting)
    assert ahead == behind
    assert common_ways(line, through, through) == (SharedTrack(),)
    # Two that part at the points and meet again behind them.
    elsewhere = {"akabane-1": "akabane-2"}
    other = replace(through, route=tuple(elsewhere.get(t, t) for t in through.route))
    first, second = common_ways(line, other, through)
    assert first.cleared_m == points["akabane-north"].fouling_end_m
    assert first.parts_m == points["akabane-north"].fouling_start_m
    assert first.throws_s[1] == second.throws_s[0] == 6.5
    assert second.gate_m == points["akabane-south"].fouling_start_m
    assert north.fouling_end_m < first.cleared_m


@pytest.mark.parametrize("name", ["moving_block", "multi_step_atc", "atd", "digital_atc"])
def test_a_train_that_does_not_stay_at_its_origin_is_compressed_like_one_that_hardly_does(
    name: str,
) -> None:
    found_s = []
    for stay_s in (0.0, 1.0):
        world = world_on(steady_line(20.0, 320.0), trains=3)
        ready_s = world.booked_arrival_s.copy()
        ready_s[:, 0] = world.booked_departure_s[:, 0] - stay_s
        world = replace(world, booked_arrival_s=ready_s)
        foresight = protection(world, name)
        journeys = [booked_journey(world, foresight.profile, row) for row in range(3)]
        least_s = least_shifts_s(world, foresight, journeys)
        found_s.append(occupation_s(journeys, [0, 1, 2], least_s))
    assert found_s[0] == pytest.approx(found_s[1], abs=0.2)
    assert found_s[0][0] > 0.0
