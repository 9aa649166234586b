"""The network and the other files: the right railway, the same bytes, fit for the bare SUMO."""

import subprocess
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from kankaku.railway.plan.earth import EARTH_RADIUS_M
from kankaku.railway.plan.line import Block, Gradient, Line
from kankaku.railway.plan.scenario import Scenario
from kankaku.sumo_net import edge_cuts, names, plain_xml, routes_xml
from kankaku.sumo_net.build import SumoFiles, build, network, sumo_binary
from kankaku.sumo_net.engine import SumoEngine
from kankaku.sumo_net.geometry import TRACK_SPACING_M, centre_line
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of

READY_S = 25_200.0


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("KANKAKU_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def built(scenario: Scenario, folder: Path, *, signals: bool = True) -> SumoFiles:
    delay_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
    return build(scenario, world_of(scenario), delay_s, folder, signals=signals)


def without_header(path: Path) -> str:
    text = path.read_text()
    return text[: text.index("<!--")] + text[text.index("-->") + 3 :]


def elements(text: str, tag: str) -> Iterator[ET.Element]:
    return ET.fromstring(text).iter(tag)  # noqa: S314


def lane_lengths_m(path: Path) -> dict[str, float]:
    edges = elements(path.read_text(), "edge")
    return {edge.attrib["id"]: float(edge.findall("lane")[0].attrib["length"]) for edge in edges}


def test_network_built_twice_is_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    line = merge_scenario(2, block_m=200.0).line
    texts = []
    for cache in ("one", "two"):
        monkeypatch.setenv("KANKAKU_CACHE", str(tmp_path / cache))
        texts.append(without_header(network(line)))
    assert texts[0] == texts[1]
    assert str(tmp_path) not in texts[0]


def test_network_in_the_cache_is_not_built_again(monkeypatch: pytest.MonkeyPatch) -> None:
    line = two_station_scenario(1).line
    first = network(line)

    def refuse(*_: object, **__: object) -> None:
        pytest.fail("netconvert was run although the cache holds the network")

    monkeypatch.setattr(subprocess, "run", refuse)
    assert network(line) == first
    kept = sorted(path.name for path in first.parent.iterdir())
    assert kept == [first.with_suffix(".sha256").name, first.name]


@pytest.mark.parametrize("length", [0, 1000, None])
def test_a_damaged_network_is_built_again(length: int | None) -> None:
    line = two_station_scenario(1).line
    kept = network(line)
    good = kept.read_bytes()
    damaged = good[:length] if length is not None else good.replace(b"length", b"lenght", 1)
    kept.write_bytes(damaged)
    # The date in its head may be another one.
    assert len(network(line).read_bytes()) == len(good)
    assert without_header(kept) == good.decode()[: good.index(b"<!--")] + "".join(
        good.decode().partition("-->")[2:]
    )


def test_a_network_without_its_digest_is_built_again() -> None:
    line = two_station_scenario(1).line
    digest = network(line).with_suffix(".sha256")
    digest.unlink()
    network(line)
    assert digest.is_file()


def test_a_chosen_cache_that_cannot_be_written_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("KANKAKU_CACHE", str(tmp_path / "file"))
    with pytest.raises(OSError, match="KANKAKU_CACHE"):
        built(two_station_scenario(1), tmp_path / "run")


def test_without_any_cache_the_network_is_built_for_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kankaku.sumo_net.build.cache_folder", lambda: None)
    assert built(two_station_scenario(1), tmp_path / "run").network.stat().st_size > 0


def test_another_line_is_another_network() -> None:
    assert network(two_station_scenario(1).line) != network(merge_scenario(1).line)


@pytest.mark.parametrize("block_m", [None, 200.0, 333.3])
def test_edges_of_a_track_follow_each_other_and_have_its_length(block_m: float | None) -> None:
    line = merge_scenario(1, block_m=block_m).line
    lengths_m = lane_lengths_m(network(line))
    for track, edges in edge_cuts.cut_tracks(line).items():
        assert edges[0].start_m == line.track_by_id[track].start_m
        assert edges[-1].end_m == line.track_by_id[track].end_m
        for edge, following in pairwise(edges):
            assert (edge.end_m, edge.to_node) == (following.start_m, following.from_node)
        total_m = sum(lengths_m[edge.id] for edge in edges)
        assert total_m == pytest.approx(edges[-1].end_m - edges[0].start_m, abs=1e-9)


def test_tracks_are_cut_at_their_signals_only() -> None:
    assert len(edge_cuts.cut_tracks(merge_scenario(1).line)["main"]) == 1
    edges = edge_cuts.cut_tracks(merge_scenario(1, block_m=400.0).line)
    assert [edge.start_m for edge in edges["main"]] == [400.0, 800.0, 1200.0, 1600.0]
    assert len(edges["north"]) == len(edges["south"]) == 1


def test_signals_stand_between_blocks_and_not_at_the_ends_of_the_line() -> None:
    nodes = elements(network(merge_scenario(1, block_m=400.0).line).read_text(), "junction")
    kinds = {node.attrib["id"]: node.attrib["type"] for node in nodes}
    assert kinds.pop("section#0") == kinds.pop("section#2") == "dead_end"
    assert len(kinds) == 4
    assert set(kinds.values()) == {"rail_signal"}


def test_signal_at_a_stop_position_stands_a_metre_beyond_it() -> None:
    line = two_station_scenario(1).line
    blocks = (Block("a", "main", 0.0, 300.0), Block("b", "main", 300.0, 1800.0))
    first, second = edge_cuts.cut_tracks(replace(line, blocks=blocks))["main"]
    assert first.end_m == second.start_m == 301.0


def test_stop_position_at_the_very_end_of_a_track_is_refused() -> None:
    line = two_station_scenario(1).line
    edges = edge_cuts.cut_tracks(line)
    with pytest.raises(ValueError, match=r"1799\.80 m on track main"):
        edge_cuts.edge_of_stop(edges, "main", 1799.8)


def test_front_of_an_entering_train_is_at_its_stop_position() -> None:
    scenario = two_station_scenario(1, block_m=250.0)
    kinds = scenario.train_types.values()
    routes = routes_xml.routes_xml(scenario.line, kinds, scenario.timetable, np.zeros((1, 2)), 0.5)
    (train,) = elements(routes, "vehicle")
    assert train.attrib["departPos"] == "50.000"
    assert next(elements(routes, "route")).attrib["edges"].split()[0] == "main#1"
    first, second = elements(routes, "stop")
    assert (first.attrib["lane"], first.attrib["startPos"], first.attrib["endPos"]) == (
        "main#1_0",
        "49.500",
        "50.500",
    )
    assert (second.attrib["duration"], second.attrib["until"]) == ("25.000", f"{READY_S + 149.5}00")


def test_nodes_lie_at_the_height_of_the_track() -> None:
    gradients = (Gradient(200.0, 700.0, 0.010), Gradient(900.0, 1000.0, -0.020))
    line = two_station_scenario(1, gradients=gradients, block_m=900.0).line
    heights = {
        n.attrib["id"]: float(n.attrib["z"]) for n in elements(plain_xml.nodes_xml(line), "node")
    }
    assert heights == {"section#0": 0.0, "signal#main#1": 5.0, "section#1": 3.0}


def curved_line() -> Line:
    line = merge_scenario(1).line
    points = ((100.0, 139.620, 35.900), (1100.0, 139.631, 35.900), (2000.0, 139.631, 35.892))
    return replace(line, geometry_lon_lat_deg=points)


def test_line_is_drawn_where_it_lies_on_the_ground() -> None:
    drawn = centre_line(curved_line())
    x_m, y_m = drawn.at(np.array([100.0, 1100.0, 2000.0]))
    per_degree_m = np.radians(EARTH_RADIUS_M)
    east_m = per_degree_m * np.cos(np.radians(35.896)) * 0.011
    assert np.diff(x_m) == pytest.approx([east_m, 0.0], abs=1e-6)
    assert np.diff(y_m) == pytest.approx([0.0, -0.008 * per_degree_m], abs=1e-6)
    before_x_m, before_y_m = drawn.at(np.array([0.0]))
    assert x_m[0] - before_x_m[0] == pytest.approx(0.1 * east_m, abs=1e-6)
    assert before_y_m[0] == pytest.approx(y_m[0])


def test_parallel_tracks_are_drawn_side_by_side_and_meet_at_their_ends() -> None:
    shapes = {
        edge.attrib["id"]: np.array(
            [[float(value) for value in point.split(",")] for point in edge.attrib["shape"].split()]
        )
        for edge in elements(plain_xml.edges_xml(curved_line()), "edge")
    }
    north, south = shapes["north#0"], shapes["south#0"]
    assert north[0].tolist() == south[0].tolist()
    assert north[-1].tolist() == south[-1].tolist()
    apart_m = np.hypot(*(north - south)[1:-1, :2].T)
    assert apart_m == pytest.approx(TRACK_SPACING_M, abs=0.01)


@pytest.mark.parametrize(
    "name", ["plain", "京浜東北線", "two words", "100%", "a,b;c|d", ":internal", "50%20"]
)
def test_names_are_fit_for_sumo_and_stay_different(name: str) -> None:
    identifier = names.safe(name)
    assert not set(identifier) & set(" \t\n\r|\\'\";,<>&")
    assert not identifier.startswith(":")
    assert names.safe(identifier) != identifier or identifier == name


@pytest.mark.parametrize("signals", [True, False])
@pytest.mark.parametrize("step_s", [0.1, 1.0])
def test_bare_sumo_brings_every_train_to_the_end(
    tmp_path: Path, step_s: float, *, signals: bool
) -> None:
    scenario = merge_scenario(5, headway_s=120.0, block_m=400.0, step_s=step_s)
    files = built(scenario, tmp_path / "run", signals=signals)
    report = tmp_path / "statistics.xml"
    command = [str(sumo_binary("sumo")), "-c", str(files.config), "--statistic-output", str(report)]
    subprocess.run(command, check=True, capture_output=True, timeout=300)  # noqa: S603
    text = report.read_text()
    (vehicles,), (safety,) = elements(text, "vehicles"), elements(text, "safety")
    counts = [vehicles.attrib[key] for key in ("loaded", "inserted", "running", "waiting")]
    assert counts == ["5", "5", "0", "0"]
    assert safety.attrib["collisions"] == "0"


def test_trains_with_odd_names_run(tmp_path: Path) -> None:
    scenario = two_station_scenario(1)
    (service,) = scenario.timetable.services
    odd = replace(scenario.timetable, services=(replace(service, train="普通 651,B <x>"),))
    scenario = replace(scenario, timetable=odd)
    with SumoEngine(built(scenario, tmp_path / "run"), world_of(scenario)) as engine:
        for _ in range(4):
            engine.apply(np.zeros(1))
            engine.advance()
            seen = engine.observe()
    assert seen.entered == (0,)


def test_files_name_each_other_without_their_folder(tmp_path: Path) -> None:
    files = built(two_station_scenario(1), tmp_path / "run")
    for path in (tmp_path / "run").iterdir():
        text = path.read_text() if path != files.network else without_header(path)
        assert str(tmp_path) not in text


def test_window_is_driven_through_the_same_interface(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The command line of sumo takes the options of sumo-gui, and needs no display.
    monkeypatch.setattr("kankaku.sumo_net.door.sumo_binary", lambda _: sumo_binary("sumo"))
    scenario = two_station_scenario(1, block_m=400.0)
    with SumoEngine(built(scenario, tmp_path / "run"), world_of(scenario), gui=True) as engine:
        seen = engine.observe()
        while seen.time_s < READY_S + 34.0:
            engine.apply(np.full(1, 10.0))
            engine.advance()
            seen = engine.observe()
    assert seen.front_m.tolist() == [337.5]
    assert seen.speed_mps.tolist() == [10.0]
