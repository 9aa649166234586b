"""How close trains of a network follow each other, against sums of run times by hand."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.records import RunRecord
from kankaku.testing.example_lines import world_of
from tests.networks import (
    CALL,
    JUNCTION,
    LENGTH_M,
    NODE,
    PLATFORM,
    TERMINAL,
    TRACK,
    arrival_s,
    dwells,
    network,
    row_of,
    run_network,
    stations,
)
from tests.property.runs import Observed

STEP = TERMINAL["scenario.toml"].replace("step_s = 0.5", "step_s = 0.1")
MARGIN_M = 25.0
"""A moving block stops trains so far before what is not granted. [m]"""
THROW_S = 5.0
"""Points are thrown in 4 s and proven in another one. [s]"""
SLOW = "start_km,end_km,limit_kmh\n{},36\n"
"""So slow that the tractive force is the same at every speed."""


@dataclass(frozen=True)
class Even:
    """A train whose acceleration and brake are the same at every speed."""

    speed_mps: float
    acceleration_mps2: float
    brake_mps2: float

    def off_s(self, distance_m: float) -> float:
        """Return how long it takes to run a distance from a stand, and on. [s]"""
        return distance_m / self.speed_mps + self.speed_mps / (2.0 * self.acceleration_mps2)

    def run_s(self, distance_m: float) -> float:
        """Return how long it takes to run a distance from stand to stand. [s]"""
        return self.off_s(distance_m) + self.speed_mps / (2.0 * self.brake_mps2)


def even_train(scenario: Scenario, speed_mps: float) -> Even:
    """Return the train of a scenario with the mean of its resistance."""
    (train,) = scenario.train_types.values()
    resistance_n = float(train.resistance.force_n(np.array([0.6 * speed_mps]))[0])
    mass_kg = train.mass_kg * (1.0 + train.rotating_mass_ratio)
    force_n = train.traction.starting_force_n - resistance_n
    return Even(speed_mps, force_n / mass_kg, train.service_brake_mps2)


def undisturbed(scenario: Scenario, **delays_s: dict[str, float]) -> tuple[RunRecord, Observed]:
    """Run a scenario in which nothing goes wrong."""
    record, engine = run_network(scenario, delays_s=delays_s)
    assert record.violations == ()
    assert record.completed.all()
    return record, engine


@pytest.mark.parametrize("platform", ["p1", "p2"])
def test_shortest_headway_of_a_terminal(tmp_path: Path, platform: str) -> None:
    """
    r2 waits before the points until f1, which is r1's stock, has left them.

    From arrival to arrival: turn back, run until the tail is out of the points, throw them, and
    run in from where r2 stands, whether it goes to the same track or to the other one, whose way
    in the way out crosses.
    """
    calls = TERMINAL["calls.csv"].replace("07:04:20,07:05:30", "07:04:20,07:04:50")
    calls = calls.replace("r2,a,in,07:03:00,07:04:00", "r2,a,in,07:01:40,07:02:00")
    scenario = network(
        tmp_path,
        TERMINAL,
        scenario=STEP,
        calls=calls.replace("b,p2", f"b,{platform}"),
        limits=SLOW.format("-0.5,2.2"),
    )
    record, _ = undisturbed(scenario)
    train = even_train(scenario, 10.0)
    # Front of f1: from km 1.9, where r1's tail was, to 100 m beyond the far end of the points.
    out_m = 1900.0 - 1550.0 + LENGTH_M
    in_m = 2000.0 - (1550.0 - MARGIN_M)
    headway_s = 60.0 + train.off_s(out_m) + THROW_S + train.run_s(in_m)
    simulated_s = arrival_s(record, "r2", "b") - arrival_s(record, "r1", "b")
    assert simulated_s == pytest.approx(headway_s, abs=1.0)


SINGLE = {
    **TERMINAL,
    "scenario.toml": STEP,
    "stations.csv": stations(a=0.0, b=3.0),
    "dwell_stations.csv": dwells("a", "b"),
    "nodes.csv": NODE
    + "W,-0.5,boundary,-0.5,-0.5,0,0\nw,0.5,points,0.45,0.55,4,1\n"
    + "e,2.5,points,2.45,2.55,4,1\nE,3.5,boundary,3.5,3.5,0,0\n",
    "tracks.csv": TRACK
    + "w1,W,w,rising,1\nw2,W,w,falling,2\nmid,w,e,both,1.5\n"
    + "e1,e,E,rising,1\ne2,e,E,falling,2\n",
    "platforms.csv": PLATFORM
    + "a,w1,-0.11,0.01,0.0\na,w2,-0.11,0.01,-0.1\nb,e1,2.99,3.11,3.1\nb,e2,2.99,3.11,3.0\n",
}
"""A single track between two double ones, or between two loops."""


def _minutes(number: int) -> tuple[int, int, int]:
    """Return when a train is ready, departs and arrives. [min]"""
    return 2 * number, 2 * number + 1, 2 * number + 2


def test_cycle_of_a_single_track_between_two_loops(tmp_path: Path) -> None:
    """
    Trains of both directions go in turn, each from a stand before the points.

    From one of a direction to the next one: twice the run until the tail is out of the points at
    the other end, and twice the throw.
    """
    calls, services = CALL, "train,train_type\n"
    for number in range(8):
        # Booked faster than they can run, so that all of them queue.
        ready, departs, arrives = (f"{7 + t // 60:02d}:{t % 60:02d}" for t in _minutes(number))
        name = f"{'rf'[number % 2]}{number // 2}"
        start, end = (("a,w1", "b,e1"), ("b,e2", "a,w2"))[number % 2]
        calls += f"{name},{start},{ready}:00,{departs}:00\n"
        calls += f"{name},{end},{arrives}:30,{arrives}:50\n"
        services += f"{name},unit\n"
    scenario = network(
        tmp_path, SINGLE, calls=calls, services=services, limits=SLOW.format("-0.5,3.5")
    )
    record, engine = undisturbed(scenario)
    train = even_train(scenario, 10.0)
    run_m = MARGIN_M + (2550.0 - 450.0) + LENGTH_M
    cycle_s = 2.0 * (train.off_s(run_m) + THROW_S)
    passes_s = [engine.passes_s(row_of(record, f"r{number}"), 1500.0) for number in range(4)]
    assert np.diff(passes_s)[1:] == pytest.approx(cycle_s, abs=1.0)


def test_shortest_headway_of_a_merge(tmp_path: Path) -> None:
    """
    s1 is not held up if it is granted the points when it is not yet within braking distance.

    From front to front at the points: n1's length and the points at full speed, the throw, and
    from where s1 would begin to brake to the points, with the margin.
    """
    speed_mps, fouling_m = 20.0, 100.0
    scenario = network(tmp_path, JUNCTION, scenario=STEP)
    brake_mps2 = world_of(scenario).train_types[0].service_brake_mps2
    headway_s = (fouling_m + LENGTH_M + MARGIN_M) / speed_mps + THROW_S
    headway_s += speed_mps / (2.0 * brake_mps2)

    def headway_and_delay_s(late_s: float) -> tuple[float, float]:
        """Return the headway if n1 is late, and by how much s1 is held up. [s]"""
        record, engine = undisturbed(scenario, n1={"n": 20.0 + late_s})
        rows = row_of(record, "n1"), row_of(record, "s1")
        first_s = engine.passes_s(rows[0], 950.0)
        # s1 leaves after 120 s in any case.
        behind_s = engine.passes_s(rows[1], 1150.0) - alone_s[1]
        return alone_s[0] - first_s, behind_s

    record, engine = undisturbed(scenario)
    alone_s = [engine.passes_s(row_of(record, "s1"), place_m) for place_m in (950.0, 1150.0)]
    low_s, high_s = 20.0, 70.0
    assert headway_and_delay_s(low_s)[1] == 0.0
    while high_s - low_s > 0.15:
        middle_s = round(0.5 * (low_s + high_s), 1)
        free = headway_and_delay_s(middle_s)[1] < 1e-3
        low_s, high_s = (middle_s, high_s) if free else (low_s, middle_s)
    assert headway_and_delay_s(low_s)[0] == pytest.approx(headway_s, abs=1.0)
