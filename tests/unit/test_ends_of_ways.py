"""What a train that ends on the way means to signalling, and to the capacity of a line."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kankaku.railway.capacity.compression import least_shifts_s
from kankaku.railway.motion.journey import booked_journey
from kankaku.railway.plan.disruptions import Cause, Closure, Disruptions
from kankaku.railway.plan.line import Crossing
from kankaku.railway.plan.timetable import Timetable
from kankaku.railway.plan.world import World
from kankaku.railway.safety.band_exclusion import layers_of
from kankaku.railway.step.state import Events
from kankaku.railway.wayside.detection import Detection
from kankaku.railway.wayside.signalling import Wayside
from kankaku.testing.example_lines import world_of
from kankaku.testing.loop_station import loop_station_scenario
from tests.ends_of_ways import joint_scenario, short_turn_scenario
from tests.property.runs import controller_of, run

CROSSING = Crossing("road", 1800.0, 1808.0, 1300.0, 20.0)
ZONE = Closure("zone", Cause.FAILURE, ("main",), 1800.0, 1900.0, 0.0, np.inf, np.inf)


def siding_world() -> World:
    """Return a loop station where the second of three trains ends on its own track."""
    scenario = loop_station_scenario(3, block_m=250.0)
    first, second, third = scenario.timetable.services
    second = replace(
        second, route=second.route[:2], calls=second.calls[:2], leaves_at_last_call=True
    )
    return world_of(replace(scenario, timetable=Timetable((first, second, third))))


@pytest.mark.parametrize("beside", ["crossing", "closure"])
def test_what_lies_behind_its_last_stop_does_not_concern_it(beside: str) -> None:
    scenario = short_turn_scenario(3)
    if beside == "crossing":
        scenario = replace(scenario, line=replace(scenario.line, crossings=(CROSSING,)))
    world = world_of(scenario)
    disruptions = Disruptions(closures=(ZONE,) if beside == "closure" else ())
    wayside = Wayside(world, disruptions)
    # The second train stands at its last stop, past the place where trains strike in.
    front_m = np.array([300.0, 1500.0, 300.0])
    present = np.ones(3, dtype=np.bool_)
    trains = front_m, front_m - 200.0, np.zeros(3)
    wayside.update(25_200.0, trains, present, Events(entered=(0, 1, 2)))
    assert wayside.state.concerns[:, 0].tolist() == [True, False, True]


def test_points_behind_its_last_stop_are_no_points_of_its_way() -> None:
    world = siding_world()
    fan, throat = Detection(world)._points.way.tolist()  # noqa: SLF001 - what it looks up
    assert fan == [0, 1, 0]
    assert throat == [0, -1, 0]
    passed = layers_of(world).used[-2:].tolist()
    assert passed == [[True, True, True], [True, False, True]]


def test_its_journey_ends_with_its_last_stop() -> None:
    world = world_of(short_turn_scenario(2))
    through, short = (booked_journey(world, world.profile, row) for row in (0, 1))
    assert short.leaves_s == short.departure_s[-1] == 25_200.0 + 90.0 + 150.0
    assert short.chainage_m[-1] == 1500.0
    assert through.chainage_m[-1] == 4000.0


def test_the_train_behind_it_is_held_against_the_one_before_it_as_well() -> None:
    world = world_of(short_turn_scenario(4))
    foresight: Any = controller_of(world).protection
    journeys = [booked_journey(world, world.profile, row) for row in range(4)]
    shifts_s = least_shifts_s(world, foresight, journeys)
    assert set(shifts_s) == {(0, 1), (0, 2), (1, 2), (2, 3)}


def test_it_takes_no_energy_and_stands_nowhere_between_stations() -> None:
    record, engine = run(short_turn_scenario(4, 60.0))
    assert record.violations == ()
    assert record.energy.distance_m == pytest.approx([3700.0, 1200.0, 3700.0, 1200.0], abs=15.0)
    assert set(record.standstills.row.tolist()) <= {0, 2}
    left_s = [seen.time_s for seen in engine.seen if 1 in seen.left]
    assert left_s == [record.departure_s[1, 1]]


@pytest.mark.parametrize("beyond_m", [0.0, 0.5])
def test_a_journey_to_the_buffer_stop_ends_there(beyond_m: float) -> None:
    world = world_of(joint_scenario(beyond_m))
    assert world.leaves_at_stop.tolist() == [True]
    assert booked_journey(world, world.profile, 0).chainage_m[-1] == 2200.0
    assert world_of(joint_scenario(1.5)).leaves_at_stop.tolist() == [False]
