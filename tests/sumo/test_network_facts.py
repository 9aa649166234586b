"""What SUMO does with networks, as far as our engine relies on it; a new release may change it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeAlias
from xml.etree import ElementTree as ET

import libsumo
import pytest

from kankaku.scenarios.loading.load import load
from kankaku.scenarios.shipped import folder_of
from kankaku.sumo_net.build import SumoFiles, build, network
from kankaku.sumo_net.door import disarm
from kankaku.sumo_net.network_xml import edge_of, twins
from kankaku.sumo_net.witness_xml import route_names
from kankaku.testing.example_lines import world_of

NETWORKS = ("branch", "loop_line", "overtaking", "single_track", "terminal", "whole_line")
Add: TypeAlias = Callable[[str, tuple[str, ...], float], None]

RISING = ("a2", "down", "c2")
INTO_A1 = ("c2~", "up", "a1~")
OUT_OF_A1 = ("a1", "down", "c1")
OUT_OF_C1 = ("c1~", "up", "a2~")


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> SumoFiles:
    monkeypatch.setenv("KANKAKU_CACHE", str(tmp_path / "cache"))
    scenario = load(folder_of("terminal"))
    world = world_of(scenario)
    delay_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
    return build(scenario, world, delay_s, tmp_path / "run")


@contextmanager
def sumo(files: SumoFiles, *options: str) -> Iterator[Add]:
    libsumo.start(["sumo", "-c", str(files.config), "--no-warnings", *options])
    try:
        disarm(libsumo, "emu")
        named = route_names(load(folder_of("terminal")).timetable.services)

        def add(train: str, route: tuple[str, ...], at_m: float) -> None:
            libsumo.vehicle.add(train, named[route], "emu", departPos=repr(at_m), departSpeed="0")
            libsumo.vehicle.setSpeedMode(train, 0)

        yield add
    finally:
        libsumo.close()


def jump(train: str, distance_m: float) -> None:
    """Move a standing train by a distance in one step, at the end of which it stands."""
    libsumo.vehicle.setPreviousSpeed(train, 2.0 * distance_m)
    libsumo.vehicle.setSpeed(train, 0.0)
    libsumo.simulationStep()


def to_end_m(track: str, from_m: float) -> float:
    """Return how far it is to the end of a track."""
    return float(libsumo.lane.getLength(f"{edge_of(track)}_0")) - from_m


def place(train: str) -> tuple[str, float]:
    return libsumo.vehicle.getRoadID(train), libsumo.vehicle.getLanePosition(train)


@pytest.mark.parametrize("name", NETWORKS)
def test_both_edges_of_a_two_way_track_are_one_and_no_others(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KANKAKU_CACHE", str(tmp_path))
    line = load(folder_of(name)).line
    edges = ET.parse(network(line)).getroot().iter("edge")  # noqa: S314
    told = {edge.attrib["id"]: edge.attrib.get("bidi") for edge in edges}
    both_ways = dict(twins(line))
    both_ways |= {falling: rising for rising, falling in both_ways.items()}
    assert told == {
        edge_of(track.id): edge_of(both_ways[track.id]) if track.id in both_ways else None
        for track in line.network
    }


def test_train_appears_in_the_next_step_exactly_where_it_is_put(files: SumoFiles) -> None:
    with sumo(files) as add:
        add("T1", RISING, 287.654321)
        libsumo.simulationStep()
        assert place("T1") == (edge_of("a2"), 287.654321)
        assert libsumo.vehicle.getDistance("T1") == 0.0
        libsumo.simulationStep()
        assert libsumo.vehicle.getDistance("T1") == 0.0


@pytest.mark.parametrize(("begin_s", "steps"), [(25_167.0, 1), (25_168.0, 2)])
def test_train_appears_a_step_late_where_the_begin_is_no_multiple_of_the_step(
    files: SumoFiles, begin_s: float, steps: int
) -> None:
    with sumo(files, "--step-length=0.3", f"--begin={begin_s}") as add:
        add("T1", RISING, 300.0)
        for _ in range(steps):
            assert libsumo.vehicle.getIDList() == ()
            libsumo.simulationStep()
        assert libsumo.vehicle.getIDList() == ("T1",)


@pytest.mark.parametrize(("checks", "appears"), [("all", False), ("none", True)])
def test_a_train_opposite_keeps_others_out_where_sumo_checks(
    files: SumoFiles, checks: str, *, appears: bool
) -> None:
    with sumo(files, f"--insertion-checks={checks}") as add:
        add("T1", INTO_A1, 300.0)
        libsumo.simulationStep()
        jump("T1", to_end_m("c2~", 300.0) + to_end_m("up", 0.0) + 210.0)
        add("T2", OUT_OF_A1, 210.0)
        libsumo.simulationStep()
        assert ("T2" in libsumo.vehicle.getIDList()) == appears
        assert libsumo.simulation.getCollisions() == ()


def test_stock_turns_round_between_two_steps(files: SumoFiles) -> None:
    with sumo(files) as add:
        add("T1", OUT_OF_C1, 300.0)
        libsumo.simulationStep()
        libsumo.vehicle.remove("T1")
        add("T2", OUT_OF_C1, 310.0)
        libsumo.simulationStep()
        assert libsumo.vehicle.getIDList() == ("T2",)
        assert libsumo.simulation.getCollisions() == ()
        assert place("T2") == (edge_of("c1~"), 310.0)
        jump("T2", 123.4567)
        assert libsumo.vehicle.getDistance("T2") == pytest.approx(123.4567, abs=1e-9)


def test_any_distance_is_the_mean_of_two_speeds_that_are_not_negative(files: SumoFiles) -> None:
    with sumo(files) as add:
        add("T1", RISING, 300.0)
        libsumo.simulationStep()
        gone_m = 0.0
        for before, after in ((0.0, 0.0), (0.0, 0.5), (7.0, 3.0), (31.0, 30.0), (60.0, 0.0)):
            libsumo.vehicle.setPreviousSpeed("T1", before)
            libsumo.vehicle.setSpeed("T1", after)
            libsumo.simulationStep()
            gone_m += 0.5 * (before + after)
            assert libsumo.vehicle.getDistance("T1") == pytest.approx(gone_m, abs=1e-9)
        libsumo.vehicle.setPreviousSpeed("T1", -2.0)
        libsumo.vehicle.setSpeed("T1", 3.0)
        libsumo.simulationStep()
        assert libsumo.vehicle.getDistance("T1") == pytest.approx(gone_m + 1.5, abs=1e-9)


@pytest.mark.parametrize(("apart_m", "seen"), [(1.0, False), (-1.0, True)])
def test_trains_that_meet_head_on_are_seen(files: SumoFiles, apart_m: float, *, seen: bool) -> None:
    with sumo(files) as add:
        add("T1", OUT_OF_A1, 300.0)
        add("T2", INTO_A1, 300.0)
        libsumo.simulationStep()
        to_a1_m = to_end_m("c2~", 300.0) + to_end_m("up", 0.0)
        jump("T2", to_a1_m + to_end_m("a1~", 300.0) - apart_m)
        met = libsumo.simulation.getCollisions()
        assert [{one.collider, one.victim} for one in met] == ([{"T1", "T2"}] if seen else [])


def test_trains_that_only_cross_are_not_seen(files: SumoFiles) -> None:
    """Diamonds are the monitor's; if SUMO sees them one day, the text about it has to change."""
    with sumo(files) as add:
        add("T1", RISING, 300.0)
        add("T2", INTO_A1, 300.0)
        libsumo.simulationStep()
        jump("T1", to_end_m("a2", 300.0) + 100.0)
        jump("T2", to_end_m("c2~", 300.0) + to_end_m("up", 0.0) + 100.0)
        assert (place("T1")[0], place("T2")[0]) == (edge_of("down"), edge_of("a1~"))
        assert libsumo.simulation.getCollisions() == ()
