"""Train detection against its definition, on random lines with random trains."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.plan.line import Block, Line, Platform, Section, Track, Turnout
from kankaku.railway.plan.timetable import Call, Service
from kankaku.railway.plan.world import World
from kankaku.railway.wayside.detection import Detection, Occupancy
from kankaku.testing.example_lines import commuter_train, make_scenario, stations_at, world_of
from tests.examples import examples

TRAINS = 5
MANY = examples(120)
SEEDS = st.integers(0, 2**32 - 1)


def cut(rng: np.random.Generator, start_m: float, end_m: float, mean_m: float) -> list[float]:
    """Return a start, places between, and an end, in whole millimetres."""
    count = rng.poisson((end_m - start_m) / mean_m)
    inner_m = {round(place_m, 3) for place_m in rng.uniform(start_m, end_m, count)}
    return sorted({start_m, *inner_m, end_m})


def pieces(track: str, places_m: list[float], name: str) -> list[Block]:
    return [
        Block(f"{name}.{number}", track, start_m, end_m)
        for number, (start_m, end_m) in enumerate(pairwise(places_m))
    ]


def random_line(rng: np.random.Generator) -> Line:
    bounds_m = [0.0, *np.cumsum(np.round(rng.uniform(400.0, 900.0, rng.integers(1, 5)), 3))]
    bounds_m = np.round(bounds_m, 3).tolist()
    sections, blocks, circuits = [], [], []
    for number, (start_m, end_m) in enumerate(pairwise(bounds_m)):
        names = [f"{number}{side}" for side in "abc"[: rng.integers(1, 4)]]
        sections.append(
            Section(start_m, end_m, tuple(Track(name, start_m, end_m) for name in names))
        )
        for name in names:
            mine = pieces(name, cut(rng, start_m, end_m, rng.uniform(100.0, 500.0)), name)
            blocks += mine
            for block in mine:
                if rng.random() < 0.6:
                    places_m = cut(rng, block.start_m, block.end_m, 80.0)
                    circuits += pieces(name, places_m, block.id)
    turnouts = tuple(
        Turnout(
            str(number),
            after.start_m,
            round(after.start_m - rng.uniform(0.0, 150.0), 3),
            round(after.start_m + rng.uniform(0.0, 150.0), 3),
        )
        for number, (before, after) in enumerate(pairwise(sections))
        if max(len(before.tracks), len(after.tracks)) > 1
    )
    platforms = tuple(
        Platform(f"station{number}", track.id, track.start_m, track.end_m, track.end_m - 50.0)
        for number, section in enumerate(sections)
        for track in section.tracks
    )
    return Line(
        name="random",
        stations=stations_at(
            {f"station{number}": section.end_m - 50.0 for number, section in enumerate(sections)}
        ),
        sections=tuple(sections),
        platforms=platforms,
        turnouts=turnouts,
        limits=(),
        gradients=(),
        curves=(),
        balises_m=(),
        blocks=tuple(blocks),
        circuits=tuple(circuits),
        release_delay_s=rng.choice([0.0, 0.3, 1.0, 2.5]),
    )


def random_world(rng: np.random.Generator) -> World:
    line = random_line(rng)
    services = []
    for row in range(TRAINS):
        first = rng.integers(0, len(line.sections))
        route = tuple(str(rng.choice([t.id for t in s.tracks])) for s in line.sections[first:])
        stop_m = line.track_by_id[route[0]].end_m - 50.0
        call = Call(f"station{first}", route[0], stop_m, 100.0 * row, 100.0 * row + 30.0, 25.0)
        services.append(Service(f"T{row}", call.station, "commuter", route, (call,)))
    train = commuter_train(round(rng.uniform(20.0, 300.0), 3))
    return world_of(make_scenario(line, services, train))


def random_fronts_m(rng: np.random.Generator, world: World) -> FloatArray:
    """Fronts anywhere on the routes; often a front or a tail is exactly at a boundary."""
    line = world.line
    ends_m = np.array([circuit.end_m for circuit in line.track_circuits])
    front_m = np.zeros(world.size)
    for row, service in enumerate(world.timetable.services):
        start_m = line.track_by_id[service.route[0]].start_m
        anywhere_m = rng.uniform(start_m, line.end_m)
        at_m = rng.choice(ends_m) + rng.choice([0.0, world.length_m[row]])
        wanted_m = at_m if rng.random() < 0.5 else anywhere_m
        front_m[row] = wanted_m if start_m < wanted_m < line.end_m else anywhere_m
    return front_m


class Scene(NamedTuple):
    """Where the trains of a world are."""

    world: World
    front_m: FloatArray
    tail_m: FloatArray
    present: BoolArray

    @property
    def rows(self) -> list[int]:
        """Trains on the line."""
        return [int(row) for row in np.flatnonzero(self.present)]

    def touches(self, row: int, circuit: Block) -> bool:
        """Return whether any part of a train is in a circuit."""
        on_route = circuit.track in self.world.timetable.services[row].route
        overlaps = self.front_m[row] > circuit.start_m and self.tail_m[row] < circuit.end_m
        return bool(on_route and overlaps)

    def touching(self) -> list[set[int]]:
        """Return the trains that touch each circuit."""
        circuits = self.world.line.track_circuits
        return [{row for row in self.rows if self.touches(row, circuit)} for circuit in circuits]

    def way(self, turnout: Turnout, row: int) -> str | None:
        """Return the track of a train on the side of points with more tracks."""
        at_m = turnout.position_m
        sides = [s for s in self.world.line.sections if at_m in {s.start_m, s.end_m}]
        wider = max(sides, key=lambda section: len(section.tracks))
        route = self.world.timetable.services[row].route
        return next((track.id for track in wider.tracks if track.id in route), None)

    def other_way(self, turnout: Turnout, one: int, other: int) -> bool:
        """Return whether two trains pass points on different tracks."""
        ways = {self.way(turnout, one), self.way(turnout, other)}
        return None not in ways and len(ways) == 2

    def parts_or_joins(self, turnout: Turnout, one: int, other: int) -> bool:
        """Return whether two trains pass points on different tracks on either side of them."""
        at_m = turnout.position_m
        for section in self.world.line.sections:
            if at_m in {section.start_m, section.end_m}:
                own = {track.id for track in section.tracks}
                routes = (self.world.timetable.services[row].route for row in (one, other))
                tracks = [own.intersection(route) for route in routes]
                if all(tracks) and tracks[0] != tracks[1]:
                    return True
        return False

    def within(self, turnout: Turnout, row: int) -> bool:
        """Return whether any part of a train is in the fouling section of points."""
        past_start = self.front_m[row] > turnout.fouling_start_m
        return bool(past_start and self.tail_m[row] < turnout.fouling_end_m)


def scene_at(world: World, front_m: FloatArray, present: BoolArray) -> Scene:
    return Scene(world, front_m, front_m - world.length_m, present)


def random_scene(rng: np.random.Generator, world: World) -> Scene:
    return scene_at(world, random_fronts_m(rng, world), rng.random(world.size) < 0.6)


def look(detection: Detection, time_s: float, scene: Scene, before: Occupancy) -> Occupancy:
    return detection.look(time_s, *scene[1:], before)


@MANY
@given(SEEDS)
def test_circuits_are_occupied_by_trains_that_touch_them_and_for_a_while_after(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = random_world(rng)
    detection = Detection(world)
    seen = detection.initial()
    # The definition counts in whole milliseconds, where nothing is rounded.
    delay_ms = round(1000.0 * world.line.release_delay_s)
    last_ms = [-delay_ms - 1] * len(world.line.track_circuits)
    time_ms = 25_200_000
    for _ in range(8):
        time_ms += 100 * int(rng.integers(1, 15))
        scene = random_scene(rng, world)
        seen = look(detection, time_ms / 1000.0, scene, seen)
        for circuit, rows in enumerate(scene.touching()):
            if rows:
                last_ms[circuit] = time_ms
            assert seen.occupied[circuit] == (time_ms - last_ms[circuit] <= delay_ms)
            foremost = max(rows, key=lambda row: (scene.front_m[row], -row), default=-1)
            assert seen.foremost[circuit] == foremost


@MANY
@given(SEEDS)
def test_circuits_tile_every_block_and_every_route(seed: int) -> None:
    world = random_world(np.random.default_rng(seed))
    line, detection = world.line, Detection(world)
    for number, block in enumerate(line.blocks):
        owners = zip(line.track_circuits, detection.block_of_circuit, strict=True)
        mine = [circuit for circuit, owner in owners if owner == number]
        assert {circuit.track for circuit in mine} == {block.track}
        assert (mine[0].start_m, mine[-1].end_m) == (block.start_m, block.end_m)
        assert all(one.end_m == other.start_m for one, other in pairwise(mine))
    for row, service in enumerate(world.timetable.services):
        for tiling in (detection.circuits, detection.blocks):
            along = detection.along(row, tiling)
            start_m, end_m = tiling.start_m[along], tiling.end_m[along]
            assert start_m[0] == line.track_by_id[service.route[0]].start_m
            assert end_m[-1] == line.end_m
            assert start_m[1:].tolist() == end_m[:-1].tolist()


def expected_danger_m(scene: Scene, row: int, granted_to_m: float, seen: Occupancy) -> float:
    line, front_m = scene.world.line, scene.front_m[row]
    route = scene.world.timetable.services[row].route
    mine = [(n, c) for n, c in enumerate(line.track_circuits) if c.track in route]
    dangers_m = [c.start_m for n, c in mine if seen.occupied[n] and c.start_m >= front_m]
    dangers_m += [
        circuit.start_m
        for number, circuit in mine
        if circuit.start_m < front_m <= circuit.end_m and seen.foremost[number] != row
    ]
    closed_m = [granted_to_m]
    for turnout in line.turnouts:
        locked = any(
            scene.within(turnout, other) and scene.other_way(turnout, row, other)
            for other in scene.rows
        )
        if locked and front_m <= turnout.fouling_start_m:
            closed_m.append(turnout.fouling_start_m)
    first_m = mine[0][1].start_m
    for place_m in np.maximum(closed_m, first_m):
        dangers_m += [c.start_m for _, c in mine if c.start_m <= place_m < c.end_m]
    return min(dangers_m, default=np.inf)


@MANY
@given(SEEDS)
def test_danger_is_the_first_circuit_ahead_that_is_not_free(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = random_world(rng)
    detection = Detection(world)
    seen = detection.initial()
    for step in range(6):
        scene = random_scene(rng, world)
        anywhere_m = rng.uniform(0.0, world.line.end_m, world.size)
        granted_to_m = np.where(rng.random(world.size) < 0.5, world.far_m, anywhere_m)
        seen = look(detection, 25_200.0 + 0.5 * step, scene, seen)
        danger_m = detection.danger_m(*scene[1:], granted_to_m, seen)
        for row in range(world.size):
            expected_m = np.inf
            if scene.present[row]:
                expected_m = expected_danger_m(scene, row, granted_to_m[row], seen)
            assert danger_m[row] == expected_m


def granted_to_m(scene: Scene) -> FloatArray:
    """Grant points to the foremost train that has not cleared them, and to all on its way."""
    granted_to_m = np.full(scene.world.size, scene.world.far_m)
    for turnout in scene.world.line.turnouts:
        coming = [
            row
            for row in scene.rows
            if scene.tail_m[row] < turnout.fouling_end_m and scene.way(turnout, row)
        ]
        first = max(coming, key=lambda row: scene.front_m[row], default=-1)
        for row in coming:
            outside = scene.front_m[row] <= turnout.fouling_start_m
            if outside and scene.parts_or_joins(turnout, row, first):
                granted_to_m[row] = min(granted_to_m[row], turnout.fouling_start_m)
    return granted_to_m


def scene_apart(rng: np.random.Generator, world: World) -> Scene:
    """Put on the line as many trains as share no circuit and no points."""
    front_m, present = random_fronts_m(rng, world), np.zeros(world.size, dtype=np.bool_)
    for row in range(world.size):
        present[row] = True
        scene = scene_at(world, front_m, present)
        shared = any(len(rows) > 1 for rows in scene.touching())
        turnouts = world.line.turnouts
        present[row] = not shared and not any(scene.within(turnout, row) for turnout in turnouts)
    return scene_at(world, front_m, present)


# Two tracks that join where three begin: both trains go on along one of these.
@example(477_928)
@MANY
@given(SEEDS)
def test_trains_that_stop_before_danger_never_enter_an_occupied_circuit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = random_world(rng)
    detection = Detection(world)
    scene = scene_apart(rng, world)
    seen = look(detection, 25_200.0, scene, detection.initial())
    for step in range(1, 40):
        danger_m = detection.danger_m(*scene[1:], granted_to_m(scene), seen)
        wanted_m = scene.front_m + rng.uniform(0.0, 60.0, world.size)
        front_m = np.maximum(scene.front_m, np.minimum(wanted_m, danger_m))
        moved = scene_at(world, front_m, scene.present & (front_m < world.line.end_m))
        touching = moved.touching()
        assert all(len(rows) < 2 for rows in touching)
        entered = [not now <= then for now, then in zip(touching, scene.touching(), strict=True)]
        assert not np.any(entered & seen.occupied)
        scene, seen = moved, look(detection, 25_200.0 + 0.5 * step, moved, seen)
