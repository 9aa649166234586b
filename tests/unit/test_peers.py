"""Peers: named in a scenario file in place of layers, built to decide nothing."""

from pathlib import Path

import numpy as np
import pytest

from kankaku.controllers.protection.moving_block import MovingBlockOptions
from kankaku.controllers.registry import PEERS, ControllerError, build, options_of
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError
from kankaku.testing.example_lines import merge_scenario, world_of
from tests.unit.scenario_folder import replace, write_scenario

LAYERS = 'protection = "moving_block"\noperation = "close_up"\n'
OPTIONS = "\n[controllers.plain.protection_options]\nmargin_m = 10.0\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_scenario(tmp_path / "small")


def faults_of(folder: Path) -> list[tuple[str, str, str]]:
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    assert all(isinstance(mistake, Mistake) for mistake in caught.value.mistakes)
    return [(mistake.where, mistake.problem, mistake.allowed) for mistake in caught.value.mistakes]


def peer_spec(peer: str) -> ControllerSpec:
    return ControllerSpec("them", "", "", {}, {}, peer)


@pytest.mark.parametrize("peer", PEERS)
def test_a_controller_may_be_a_peer(folder: Path, peer: str) -> None:
    replace(folder, "scenario.toml", LAYERS, f'peer = "{peer}"\n')
    replace(folder, "scenario.toml", OPTIONS, "")
    (spec,) = load(folder).controllers
    assert spec == ControllerSpec("plain", "", "", {}, {}, peer)
    assert options_of(spec) == {}


@pytest.mark.parametrize(
    ("written", "keys"),
    [
        ('peer = "sumo_native_fixed"\nprotection = "moving_block"\n', ["protection"]),
        ('peer = "sumo_native_fixed"\noperation = "close_up"\n', ["operation"]),
        (f'peer = "sumo_native_fixed"\n{LAYERS}', ["protection", "operation"]),
        ('peer = "sumo_native_fixed"\nsupervision = "none"\n', ["supervision"]),
    ],
)
def test_a_peer_stands_alone(folder: Path, written: str, keys: list[str]) -> None:
    replace(folder, "scenario.toml", OPTIONS, "")
    replace(folder, "scenario.toml", LAYERS, written)
    allowed = "both protection and operation, or peer alone"
    assert faults_of(folder) == [
        (f"controllers.plain.{key}", "stands beside peer", allowed) for key in keys
    ]


def test_a_peer_has_no_options(folder: Path) -> None:
    replace(folder, "scenario.toml", LAYERS, 'peer = "sumo_native_fixed"\n')
    ((where, problem, _),) = faults_of(folder)
    assert (where, problem) == ("controllers.plain.protection_options", "stands beside peer")


@pytest.mark.parametrize(
    ("kept", "missing"), [("protection", ["operation"]), ("", ["protection", "operation"])]
)
def test_half_a_pair_is_refused(folder: Path, kept: str, missing: list[str]) -> None:
    replace(folder, "scenario.toml", LAYERS, f'{kept} = "moving_block"\n' if kept else "")
    mistakes = faults_of(folder)
    assert [(where, problem) for where, problem, _ in mistakes] == [
        (f"controllers.plain.{key}", "is missing") for key in missing
    ]
    assert all("peer alone" in allowed for *_, allowed in mistakes)


def test_a_peer_that_is_no_name_is_refused(folder: Path) -> None:
    replace(folder, "scenario.toml", OPTIONS, "")
    replace(folder, "scenario.toml", LAYERS, 'peer = "sumo native"\n')
    ((where, _, allowed),) = faults_of(folder)
    assert where == "controllers.plain.peer"
    assert "letters a-z and A-Z, digits" in allowed


def test_an_unknown_peer_is_refused() -> None:
    with pytest.raises(ControllerError) as caught:
        build(peer_spec("openbve"), world_of(merge_scenario(1)))
    assert caught.value.where == "controllers.them.peer"
    assert caught.value.allowed == ", ".join(PEERS)


def test_fixed_blocks_need_blocks_and_moving_ones_do_not() -> None:
    without, with_blocks = merge_scenario(1), merge_scenario(1, block_m=400.0)
    with pytest.raises(ControllerError, match="needs blocks") as caught:
        build(peer_spec("sumo_native_fixed"), world_of(without))
    assert "blocks.csv" in caught.value.allowed
    for scenario, peer in (
        (with_blocks, "sumo_native_fixed"),
        (without, "sumo_native_moving"),
    ):
        assert build(peer_spec(peer), world_of(scenario)).peer


def test_our_own_controllers_are_no_peers() -> None:
    spec = ControllerSpec("ours", "moving_block", "close_up", {}, {})
    assert not build(spec, world_of(merge_scenario(1))).peer
    assert options_of(spec)["protection"]["margin_m"] == MovingBlockOptions().margin_m


def test_what_stands_in_for_the_layers_binds_nothing() -> None:
    world = world_of(merge_scenario(2))
    layers = build(peer_spec("sumo_native_moving"), world)
    assert layers.protection.initial() is layers.operation.initial() is None
    authority, _ = layers.protection.authorise(None, None)  # type: ignore[arg-type]
    advice, _ = layers.operation.advise(None, authority, None)  # type: ignore[arg-type]
    assert np.array_equal(authority.eoa_m, np.full(2, world.far_m))
    assert min(authority.ceiling_mps.min(), advice.ceiling_mps.min()) > 500.0
