"""Networks at random: what is not refused arrives, and nobody is ever where another one is."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.records import RunRecord
from kankaku.scenarios.reading.mistakes import ScenarioError
from tests.examples import examples
from tests.networks import Files, network, run_network
from tests.property.runs import Observed
from tests.property.test_random_timetables import presence
from tests.random_networks import random_networks

SOME = examples(30, HealthCheck.data_too_large)
delays = st.dictionaries(
    st.tuples(st.integers(0, 11), st.integers(0, 3)), st.floats(0.0, 400.0), max_size=4
)


def loaded(files: Files) -> Scenario | None:
    """Return a scenario; none where trains would wait for each other for ever."""
    with TemporaryDirectory() as folder:
        try:
            return network(Path(folder) / "random", files)
        except ScenarioError as error:
            for mistake in error.mistakes:
                assert mistake.problem.startswith("trains would wait for each other"), mistake
            return None


def taken_m(world: World, engine: Observed, row: int, track: int) -> tuple[np.ndarray, np.ndarray]:
    """Return from where to where on a track of its route a train stands, by chainage."""
    passage = world.timetable.services[row].route[track]
    ends = world.line.track_by_id[passage]
    front_m = engine.front_m[:, row]
    low_m = np.maximum(front_m - world.length_m[row], ends.start_m)
    high_m = np.minimum(front_m, ends.end_m)
    there = presence(engine, world.size)[:, row] & (high_m > low_m)
    low_m, high_m = (world.chainage_m(row, place_m) for place_m in (low_m, high_m))
    if world.falling[row]:
        low_m, high_m = high_m, low_m
    return np.where(there, low_m, np.nan), np.where(there, high_m, np.nan)


def assert_nobody_meets(record: RunRecord, engine: Observed) -> None:
    """Compare every two trains in every step, on every track told once or twice."""
    world = record.world
    tracks = world.line.track_by_id
    on: dict[tuple[str, float], list[tuple[int, np.ndarray, np.ndarray]]] = {}
    for row, service in enumerate(world.timetable.services):
        for number, name in enumerate(service.route):
            track = tracks[name]
            low_m, high_m = taken_m(world, engine, row, number)
            rising = track.start_m if not world.falling[row] else world.line.mirrored_m(track.end_m)
            # The two ends of a ring that is cut are compared by where on the track trains are.
            on.setdefault((track.place, 0.0), []).append((row, low_m - rising, high_m - rising))
    for users in on.values():
        for number, (row, low_m, high_m) in enumerate(users):
            for other, others_low_m, others_high_m in users[:number]:
                shared_m = np.minimum(high_m, others_high_m) - np.maximum(low_m, others_low_m)
                assert row == other or not np.any(shared_m > 0.0), (row, other)


@SOME
@given(random_networks(), delays, st.sampled_from(["close_up", "two_stage"]))
def test_what_is_not_refused_arrives_and_nobody_meets(
    files: Files, drawn_s: dict[tuple[int, int], float], operation: str
) -> None:
    scenario = loaded(files)
    if scenario is None:
        return
    services = scenario.timetable.services
    overstays: dict[str, dict[str, float]] = {}
    for (row, call), delay_s in drawn_s.items():
        service = services[row % len(services)]
        station = service.calls[call % len(service.calls)].station
        overstays.setdefault(service.train, {})[station] = delay_s
    record, engine = run_network(scenario, operation, delays_s=overstays)
    assert [violation.message for violation in record.violations] == []
    assert record.unfinished == ()
    assert record.completed.all()
    assert_nobody_meets(record, engine)
