"""Signals show our occupancy, SUMO's own record agrees with it, and what SUMO does about both."""

import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias
from xml.etree import ElementTree as ET

import libsumo
import numpy as np
import pytest

from kankaku.controllers import registry
from kankaku.railway.arrays import BoolArray
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.plan.dwell import DwellDelays, Overstay
from kankaku.railway.plan.line import Block, Section, SpeedLimit, Track, Turnout
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.timetable import Call, Service
from kankaku.railway.plan.world import World
from kankaku.railway.step.engine_contract import Engine, Observation
from kankaku.railway.step.records import RunRecord
from kankaku.railway.wayside.detection import Detection
from kankaku.sumo_net import door
from kankaku.sumo_net import engine as engine_module
from kankaku.sumo_net.build import IGNORE_SIGNALS, SumoFiles, build
from kankaku.sumo_net.door import disarm
from kankaku.sumo_net.engine import SumoEngine
from kankaku.sumo_net.signals import block_of_lane, shown_network
from kankaku.testing.example_lines import (
    blocks_every,
    make_scenario,
    merge_scenario,
    platform_for,
    straight_line,
    two_station_scenario,
    world_of,
)

READY_S = 25_200.0
STEP_S = 0.5
CLOSE_UP = ControllerSpec("close_up", "moving_block", "close_up", {}, {})
Noted: TypeAlias = Callable[[Observation], None]
Files: TypeAlias = Callable[[Scenario], SumoFiles]


class Watched:
    """An engine whose observations are noted."""

    def __init__(self, engine: Engine, note: Noted) -> None:
        self._engine = engine
        self._note = note
        self.apply, self.advance, self.hold = engine.apply, engine.advance, engine.hold

    def observe(self) -> Observation:
        seen = self._engine.observe()
        self._note(seen)
        return seen


class Stay(NamedTuple):
    """How long a train was in a block."""

    entry_s: float
    exit_s: float


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Files:
    monkeypatch.setenv("KANKAKU_CACHE", str(tmp_path / "cache"))

    def write(scenario: Scenario) -> SumoFiles:
        delay_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
        return build(scenario, world_of(scenario), delay_s, tmp_path / "run")

    return write


@pytest.fixture
def without_window(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run what a window would show inside this process."""
    start = door.start

    def start_here(files: SumoFiles, options: Mapping[str, str], *, gui: bool) -> Any:  # noqa: ANN401, ARG001
        return start(files, options, gui=False)

    monkeypatch.setattr(engine_module, "start", start_here)


def loop_scenario(trains: int = 3, headway_s: float = 60.0) -> Scenario:
    """Return a line of one track that parts into two at 400 m, which join at 1000 m."""
    ends_m = {"in": (0.0, 400.0), "a": (400.0, 1000.0), "b": (400.0, 1000.0), "out": (1000.0, 2e3)}
    tracks = {name: Track(name, *ends) for name, ends in ends_m.items()}
    stops_m = {"in": ("west", 300.0), "a": ("mid", 900.0), "b": ("mid", 900.0)}
    stops_m["out"] = ("east", 1500.0)
    line = replace(
        straight_line({"west": 300.0, "mid": 900.0, "east": 1500.0}, 2000.0),
        name="loop",
        sections=(
            Section(0.0, 400.0, (tracks["in"],)),
            Section(400.0, 1000.0, (tracks["a"], tracks["b"])),
            Section(1000.0, 2000.0, (tracks["out"],)),
        ),
        platforms=tuple(platform_for(at, track, m) for track, (at, m) in stops_m.items()),
        turnouts=(
            Turnout("parting", 400.0, 340.0, 460.0),
            Turnout("joining", 1000.0, 940.0, 1010.0),
        ),
        blocks=tuple(block for track in tracks.values() for block in blocks_every(track, 200.0)),
    )
    services = []
    for row in range(trains):
        route = ("in", "b" if row % 2 else "a", "out")
        calls = []
        for number, track in enumerate(route):
            arrival_s = READY_S + row * headway_s + number * 100.0
            at, stop_m = stops_m[track]
            calls.append(Call(at, track, stop_m, arrival_s, arrival_s + 30.0, 25.0))
        services.append(Service(f"T{row + 1}", "west", "commuter", route, tuple(calls)))
    delays = DwellDelays(overstays=(Overstay("T1", "mid", 60.0),))
    return make_scenario(line, services, delays=delays, step_s=STEP_S)


def with_release_delay(scenario: Scenario, delay_s: float) -> Scenario:
    return replace(scenario, line=replace(scenario.line, release_delay_s=delay_s))


SCENARIOS = {
    "plain": two_station_scenario(3, headway_s=60.0, block_m=400.0),
    "merge": merge_scenario(4, headway_s=70.0, block_m=200.0),
    "loop": loop_scenario(4, headway_s=50.0),
    "released late": with_release_delay(loop_scenario(3, headway_s=50.0), 3.0),
}


def run(scenario: Scenario, files: SumoFiles, note: Noted, *, gui: bool) -> RunRecord:
    world = world_of(scenario)
    controller = registry.build(CLOSE_UP, world)
    with SumoEngine(files, world, gui=gui) as engine:
        delay_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
        run = Run(world, delay_s, scenario.seed, scenario.patience_s)
        return simulate(run, Watched(engine, note), controller, all_meters(world))


@contextmanager
def shown(files: SumoFiles) -> Iterator[Any]:
    """Start SUMO with signals that show what they are told."""
    network = shown_network(files.network)
    options = ["--no-warnings", "--railsignal.default-classes=ship", f"--net-file={network}"]
    libsumo.start(["sumo", "-c", str(files.config), *options])
    try:
        disarm(libsumo, "commuter")
        yield libsumo
    finally:
        libsumo.close()


def shown_by_signals() -> dict[str, list[tuple[str, str]]]:
    """Return the track behind each link of each signal and its aspect."""
    lights = libsumo.trafficlight
    return {
        signal: [
            (lane.split("#")[0], aspect)
            for ((_, lane, _),), aspect in zip(
                lights.getControlledLinks(signal),
                lights.getRedYellowGreenState(signal),
                strict=True,
            )
        ]
        for signal in lights.getIDList()
    }


def block_at(scenario: Scenario, signal: str, track: str) -> Block:
    """Return the block of a track behind a signal, on a line where no stop is in the way."""
    blocks = [block for block in scenario.line.blocks if block.track == track]
    kind, *place = signal.split("#")
    return blocks[0 if kind == "section" else int(place[1])]


class Expected:
    """Occupancy of the blocks by where SUMO has its vehicles; shares no code with ours."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        blocks = scenario.line.blocks
        self.block_of_lane = {lane: blocks[n] for lane, n in block_of_lane(scenario.line).items()}
        self.last_s: dict[Block, float] = {}
        self.steps = 0
        self.reds: set[Block] = set()

    def __call__(self, seen: Observation) -> None:
        services = {service.train: service for service in self.scenario.timetable.services}
        for train in libsumo.vehicle.getIDList():
            service = services[train]
            front_m = service.calls[0].stop_m + libsumo.vehicle.getDistance(train)
            for block in self.scenario.line.blocks:
                inside = front_m > block.start_m + 1e-9 and front_m - 200.0 < block.end_m - 1e-9
                if block.track in service.route and inside:
                    self.last_s[block] = seen.time_s
        for signal, links in shown_by_signals().items():
            for track, aspect in links:
                block = block_at(self.scenario, signal, track)
                occupied = self.holds(seen.time_s, self.last_s.get(block, -np.inf))
                assert aspect == ("r" if occupied else "G"), (signal, track, seen.time_s)
                if occupied:
                    self.reds.add(block)
        red = {lane for lane in libsumo.polygon.getIDList() if libsumo.polygon.getColor(lane)[0]}
        held = {block for block, last_s in self.last_s.items() if self.holds(seen.time_s, last_s)}
        assert {self.block_of_lane[lane] for lane in red} == held
        self.steps += 1

    def holds(self, now_s: float, last_s: float) -> bool:
        return now_s - last_s <= self.scenario.line.release_delay_s + 1e-6


@pytest.mark.usefixtures("without_window")
@pytest.mark.parametrize("name", SCENARIOS)
def test_signal_is_red_while_the_block_behind_it_is_occupied(files: Files, name: str) -> None:
    scenario = SCENARIOS[name]
    expected = Expected(scenario)
    record = run(scenario, files(scenario), expected, gui=True)
    assert record.completed.all()
    assert expected.steps > 500
    assert expected.reds == {block for block in scenario.line.blocks if block.start_m > 0.0}


@pytest.mark.usefixtures("without_window")
@pytest.mark.parametrize(
    "scenario",
    [loop_scenario(4, 30.0), merge_scenario(4, 30.0, block_m=200.0), merge_scenario(4, 30.0)],
    ids=["loop", "merge", "no blocks"],
)
def test_a_run_that_is_watched_has_the_same_results(files: Files, scenario: Scenario) -> None:
    seen: dict[bool, list[Observation]] = {False: [], True: []}
    built = files(scenario)
    for gui, noted in seen.items():
        run(scenario, built, noted.append, gui=gui)
    assert len(seen[False]) == len(seen[True])
    for bare, watched in zip(seen[False], seen[True], strict=True):
        assert (bare.time_s, *bare[3:]) == (watched.time_s, *watched[3:])
        assert bare.front_m == pytest.approx(watched.front_m, abs=1e-6)


def test_a_run_without_window_has_no_signals_to_show(
    files: Files, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = two_station_scenario(1, block_m=400.0)
    monkeypatch.setattr(engine_module, "BlockSignals", None)
    monkeypatch.setattr(engine_module, "shown_network", None)
    assert run(scenario, files(scenario), lambda _: None, gui=False).completed.all()


def test_blocks_belong_to_lanes_although_signals_stand_beside_stops() -> None:
    limits = (SpeedLimit(0.0, 450.0, 20.0), SpeedLimit(450.0, 900.0, 15.0))
    line = two_station_scenario(1, block_m=300.0, limits=limits).line
    assert block_of_lane(line) == {f"main#{number}_0": number for number in range(6)}
    assert block_of_lane(loop_scenario().line)["out#0_0"] == 8
    assert block_of_lane(replace(line, blocks=())) == {}


def test_rail_signal_that_is_told_what_to_show_crashes_sumo(files: Files) -> None:
    script = """
import libsumo, sys
libsumo.start(["sumo", "-c", sys.argv[1], "--no-warnings"])
libsumo.trafficlight.setRedYellowGreenState("section#1", "rr")
while libsumo.simulation.getTime() < 25300.0:
    libsumo.simulationStep()
"""
    config = str(files(loop_scenario()).config)
    done = subprocess.run([sys.executable, "-c", script, config], timeout=300, check=False)  # noqa: S603
    assert done.returncode < 0


def test_signals_change_only_when_they_are_told(files: Files) -> None:
    with shown(files(loop_scenario())) as sumo:
        lights = sumo.trafficlight
        told = {
            signal: "G" * len(lights.getControlledLinks(signal)) for signal in lights.getIDList()
        }
        told |= {"section#1": "rG", "signal#b#1": "r"}
        for signal, aspects in told.items():
            lights.setRedYellowGreenState(signal, aspects)
        while sumo.simulation.getTime() < READY_S + 200.0:
            sumo.simulationStep()
            assert {signal: lights.getRedYellowGreenState(signal) for signal in told} == told


def test_links_of_a_signal_are_in_an_order_of_their_own(files: Files) -> None:
    built = files(loop_scenario())
    with shown(built) as sumo:
        links = sumo.trafficlight.getControlledLinks("section#1")
    assert [lane for ((_, lane, _),) in links] == ["b#0_0", "a#0_0"]


def test_trains_enter_and_run_although_all_signals_are_red(files: Files) -> None:
    entered: dict[str, float] = {}
    with shown(files(loop_scenario(2, 30.0))) as sumo:
        for signal in sumo.trafficlight.getIDList():
            links = sumo.trafficlight.getControlledLinks(signal)
            sumo.trafficlight.setRedYellowGreenState(signal, "r" * len(links))
        while sumo.simulation.getTime() < READY_S + 90.0:
            sumo.simulationStep()
            for train in sumo.simulation.getDepartedIDList():
                entered[train] = sumo.simulation.getTime()
                sumo.vehicle.setSpeedMode(train, 0)
            for train in entered:
                sumo.vehicle.setSpeed(train, 10.0)
        assert sumo.vehicle.getSpeed("T1") == 10.0
    # T1 stands for 30 s, and 20 s later its tail has left the platform.
    assert entered == {"T1": READY_S, "T2": READY_S + 50.0}


def test_front_at_a_signal_has_not_passed_it_and_tail_at_a_signal_has_left(
    files: Files, tmp_path: Path
) -> None:
    output = f"--railsignal-vehicle-output={tmp_path / 'vehicles.xml'}"
    config = str(files(two_station_scenario(1, block_m=400.0)).config)
    libsumo.start(["sumo", "-c", config, "--no-warnings", output])
    try:
        disarm(libsumo, "commuter")
        while libsumo.simulation.getTime() < READY_S + 40.0:
            libsumo.simulationStep()
            if libsumo.simulation.getDepartedIDList():
                libsumo.vehicle.setSpeedMode("T1", 0)
        # From 300 m to 400 m, where the front stays for two steps, and to 600 m.
        for speed_mps in (200.0, 0.0, 0.0, 0.0, 400.0, 0.0):
            libsumo.vehicle.setSpeed("T1", speed_mps)
            libsumo.simulationStep()
        assert libsumo.vehicle.getDistance("T1") == 300.0
    finally:
        libsumo.close()
    root = ET.parse(tmp_path / "vehicles.xml").getroot()  # noqa: S314
    ways = {way.attrib["id"]: way for way in root.iter("driveWay")}
    (entry,) = ways["signal#main#1.0"].findall("entry")
    (leave,) = ways["section#0.d0"].findall("exit")
    assert float(entry.attrib["time"]) == READY_S + 42.0
    assert float(leave.attrib["time"]) == READY_S + 42.5


def recorded(folder: Path) -> dict[tuple[str, str], Stay]:
    """Return SUMO's stays by train and lane behind a signal."""
    (blocks,), (vehicles,) = (
        [ET.parse(folder / f"{name}.xml").getroot()]  # noqa: S314
        for name in ("blocks", "vehicles")
    )
    lanes = {}
    for way in blocks.iter("driveWay"):
        (forward,) = way.iter("forward")
        (lanes[way.attrib["id"]],) = forward.attrib["lanes"].split()
    stays: dict[tuple[str, str], Stay] = {}
    for way in vehicles.iter("driveWay"):
        for entry, leave in zip(way.findall("entry"), way.findall("exit"), strict=True):
            stay = Stay(float(entry.attrib["time"]), float(leave.attrib["time"]))
            key = entry.attrib["id"], lanes[way.attrib["id"]]
            # Ways that differ in their origin or in what follows have the same block.
            assert stays.setdefault(key, stay) == stay
    return stays


class OurStays:
    """When each train was in each block, by our track circuits."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.detection = Detection(world)
        self.circuits = [self.detection.initial() for _ in range(world.size)]
        self.present = np.zeros(world.size, dtype=np.bool_)
        self.entry_s: dict[tuple[str, int], float] = {}
        self.stays: dict[tuple[str, int], Stay] = {}

    def __call__(self, seen: Observation) -> None:
        self.present[list(seen.entered)] = True
        self.present[list(seen.left)] = False
        tail_m = seen.front_m - self.world.length_m
        for row, train in enumerate(self.world.timetable.trains):
            alone = self.present & (np.arange(self.world.size) == row)
            now = self.detection.look(seen.time_s, seen.front_m, tail_m, alone, self.circuits[row])
            self._note(train, seen.time_s, now.occupied)
            self.circuits[row] = now

    def _note(self, train: str, time_s: float, occupied: BoolArray) -> None:
        for block, held in enumerate(occupied.tolist()):
            key = train, block
            if held and key not in self.entry_s:
                self.entry_s[key] = time_s
            if not held and key in self.entry_s and key not in self.stays:
                self.stays[key] = Stay(self.entry_s[key], time_s)


@pytest.mark.parametrize("name", ["plain", "merge", "loop"])
def test_sumo_records_the_same_stays_in_every_block(
    files: Files, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    outputs = {
        "railsignal-block-output": str(tmp_path / "blocks.xml"),
        "railsignal-vehicle-output": str(tmp_path / "vehicles.xml"),
    }
    # Instead of ignoring the signals.
    monkeypatch.setattr(engine_module, "IGNORE_SIGNALS", outputs)
    scenario = SCENARIOS[name]
    ours = OurStays(world_of(scenario))
    assert run(scenario, files(scenario), ours, gui=False).completed.all()
    number = block_of_lane(scenario.line)
    theirs = {(train, number[lane]): stay for (train, lane), stay in recorded(tmp_path).items()}
    # SUMO names a step by its beginning, we observe its end.
    later = {key: Stay(stay.entry_s + STEP_S, stay.exit_s + STEP_S) for key, stay in theirs.items()}
    tail_only = {key: stay for key, stay in ours.stays.items() if key not in theirs}
    assert later == {key: stay for key, stay in ours.stays.items() if key not in tail_only}
    # SUMO knows nothing of a block in which only the tail stands when a train enters.
    for train, block in tail_only:
        service = next(one for one in scenario.timetable.services if one.train == train)
        assert scenario.line.blocks[block].end_m <= service.calls[0].stop_m


def test_signals_that_are_ignored_keep_no_record(
    files: Files, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    output = {"railsignal-vehicle-output": str(tmp_path / "vehicles.xml")}
    monkeypatch.setattr(engine_module, "IGNORE_SIGNALS", IGNORE_SIGNALS | output)
    scenario = SCENARIOS["plain"]
    run(scenario, files(scenario), lambda _: None, gui=False)
    root = ET.parse(tmp_path / "vehicles.xml").getroot()  # noqa: S314
    assert len(list(root.iter("driveWay"))) == 5
    assert list(root.iter("entry")) == []
