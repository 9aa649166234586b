"""What SUMO is told when it drives the trains: signals, limits, train types, order and times."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from kankaku.railway.plan.line import Block, Line, SpeedLimit
from kankaku.railway.plan.scenario import Scenario
from kankaku.sumo_net import edge_cuts, names, native_xml, plain_xml, routes_xml
from kankaku.testing.example_lines import commuter_train, merge_scenario, two_station_scenario

READY_S = 25_200.0
FOULING_M, POINTS_M = 340.0, 400.0


def elements(text: str, tag: str) -> Iterator[ET.Element]:
    return ET.fromstring(text).iter(tag)  # noqa: S314


def signal_kinds(line: Line) -> dict[str, str]:
    nodes = elements(plain_xml.nodes_xml(line), "node")
    return {node.attrib["id"]: node.attrib["type"] for node in nodes}


def limited(*limits: tuple[float, float, float]) -> Line:
    return two_station_scenario(1, limits=[SpeedLimit(*limit) for limit in limits]).line


def speeds_mps(line: Line) -> list[tuple[float, float]]:
    """Return the limit from each place on."""
    edges = edge_cuts.cut_tracks(line)["main"]
    kept = [edges[0], *(e for before, e in pairwise(edges) if e.limit_mps != before.limit_mps)]
    return [(edge.start_m, edge.limit_mps) for edge in kept]


def test_tracks_are_cut_where_the_limit_changes_and_run_on_without_a_signal() -> None:
    line = limited((400.0, 900.0, 20.0), (900.0, 1200.0, 15.0))
    none = edge_cuts.EDGE_SPEED_MPS
    assert speeds_mps(line) == [(0.0, none), (400.0, 20.0), (900.0, 15.0), (1200.0, none)]
    assert set(signal_kinds(line).values()) == {"priority"}
    written = [float(edge.attrib["speed"]) for edge in elements(plain_xml.edges_xml(line), "edge")]
    assert written == [none, 20.0, 15.0, none]


def test_limit_that_changes_at_a_signal_needs_no_second_cut() -> None:
    line = limited((300.4, 1800.0, 20.0))
    blocks = (Block("a", "main", 0.0, 300.0), Block("b", "main", 300.0, 1800.0))
    edges = edge_cuts.cut_tracks(replace(line, blocks=blocks))["main"]
    assert [(edge.start_m, edge.at_signal) for edge in edges] == [(0.0, False), (301.0, True)]
    assert edges[1].limit_mps == 20.0


@pytest.mark.parametrize(
    ("before_mps", "after_mps", "changes_m"), [(25.0, 20.0, 299.0), (20.0, 25.0, 301.0)]
)
def test_limit_that_changes_at_a_stop_position_changes_on_the_slow_side_of_it(
    before_mps: float, after_mps: float, changes_m: float
) -> None:
    line = limited((0.0, 300.0, before_mps), (300.0, 1800.0, after_mps))
    native = native_xml.native_line(line, moving_block=True)
    assert speeds_mps(native) == [(0.0, before_mps), (changes_m, after_mps)]
    stop = edge_cuts.edge_of_stop(edge_cuts.cut_tracks(native), "main", 300.0)
    assert stop.limit_mps == min(before_mps, after_mps)


@pytest.mark.parametrize("at_m", [POINTS_M, FOULING_M])
def test_signals_stand_at_the_fouling_point_wherever_the_blocks_end(at_m: float) -> None:
    line = merge_scenario(1).line
    blocks = [Block(f"{track}-1", track, 0.0, at_m) for track in ("north", "south")]
    if at_m < POINTS_M:
        blocks += [Block(f"{track}-2", track, at_m, POINTS_M) for track in ("north", "south")]
    blocks += [Block("a", "main", POINTS_M, 1200.0), Block("b", "main", 1200.0, 2000.0)]
    native = native_xml.native_line(replace(line, blocks=tuple(blocks)), moving_block=False)
    cuts = edge_cuts.cut_tracks(native)
    assert [edge.start_m for edge in cuts["north"] if edge.at_signal] == [FOULING_M]
    assert [edge.start_m for edge in cuts["main"] if edge.at_signal] == [1200.0]
    assert signal_kinds(native)["section#1"] == "priority"


def test_moving_block_needs_signals_before_points_only() -> None:
    native = native_xml.native_line(merge_scenario(1, block_m=100.0).line, moving_block=True)
    signals = [kind for kind in signal_kinds(native).values() if kind == "rail_signal"]
    assert len(signals) == 2
    assert not any(edge.at_signal for edge in edge_cuts.cut_tracks(native)["main"])


def test_points_without_room_before_them_have_their_signal_at_the_points() -> None:
    line = merge_scenario(1).line
    (turnout,) = line.turnouts
    near = replace(line, turnouts=(replace(turnout, fouling_start_m=POINTS_M - 0.7),))
    native = native_xml.native_line(near, moving_block=True)
    assert signal_kinds(native)["section#1"] == "rail_signal"


def test_train_type_has_our_forces_in_kilonewtons() -> None:
    kind = commuter_train()
    told = native_xml.rail_attributes(kind)
    speeds = np.array([float(value) for value in told["speedTable"].split()])
    forces = np.array([float(value) for value in told["tractionTable"].split()])
    assert {*kind.traction.bends_mps} <= {*speeds}
    assert speeds[-1] >= kind.maximum_speed_mps - 0.5
    between = np.linspace(0.0, kind.maximum_speed_mps, 500)
    exact_n = kind.traction.force_n(between)
    assert 1000.0 * np.interp(between, speeds, forces) == pytest.approx(exact_n, rel=1e-3)
    coefficients = [float(told[f"resCoef_{term}"]) for term in ("quadratic", "linear", "constant")]
    resisting_n = 1000.0 * np.polyval(coefficients, between)
    assert resisting_n == pytest.approx(kind.resistance.force_n(between), rel=1e-6)
    inertial_kg = float(told["mass"]) * float(told["massFactor"])
    assert inertial_kg == pytest.approx(kind.inertial_mass_kg)
    assert float(told["decel"]) == kind.service_brake_mps2


def test_only_trains_that_change_the_track_wait_for_another_one() -> None:
    scenario = merge_scenario(3, block_m=400.0)
    native = native_xml.native_line(scenario.line, moving_block=False)
    north, south = (
        next(edge.from_node for edge in edge_cuts.cut_tracks(native)[track] if edge.at_signal)
        for track in ("north", "south")
    )
    second, third = elements(
        native_xml.order_xml(native, scenario.timetable), "railSignalConstraints"
    )
    assert second.attrib == {"id": south}
    assert second[0].attrib == {"tripId": "T2", "tl": north, "foes": "T1"}
    assert third.attrib == {"id": north}
    assert third[0].attrib == {"tripId": "T3", "tl": south, "foes": "T2"}


def test_trains_of_one_track_need_no_order() -> None:
    scenario = two_station_scenario(3, block_m=200.0)
    native = native_xml.native_line(scenario.line, moving_block=False)
    assert not list(native_xml.precedences(native, scenario.timetable))


def routes(scenario: Scenario, driver: routes_xml.Driver | None = None) -> str:
    kinds = scenario.train_types.values()
    delay_s = np.full((1, 2), 7.0)
    return routes_xml.routes_xml(scenario.line, kinds, scenario.timetable, delay_s, 0.5, driver)


def test_stops_end_a_step_later_in_the_file_than_under_our_commands() -> None:
    scenario = two_station_scenario(1)
    ours, natives = (
        [stop.attrib for stop in elements(routes(scenario, driver), "stop")]
        for driver in (None, native_xml.NATIVE)
    )
    for own, native in zip(ours, natives, strict=True):
        for key in ("duration", "until"):
            assert float(native[key]) == float(own[key]) + 0.5
    assert [float(stop["until"]) for stop in natives] == [READY_S + 30.0, READY_S + 150.0]
    assert [float(stop["endPos"]) for stop in natives] == [300.0, 1300.0]


def test_trains_enter_by_the_rules_of_sumo() -> None:
    (train,) = elements(routes(two_station_scenario(1), native_xml.NATIVE), "vehicle")
    assert "insertionChecks" not in train.attrib
    assert train.attrib["id"] == names.vehicle("T1")
    assert float(train.attrib["depart"]) == READY_S - 0.5
