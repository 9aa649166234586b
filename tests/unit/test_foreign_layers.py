"""Layers of other packages: what is wrong with one is a sentence, and harms no other."""

from collections.abc import Mapping
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from kankaku.controllers.choosing import named, with_settings
from kankaku.controllers.layers import PluginError
from kankaku.controllers.registry import OPERATIONS, ControllerError, build, options_of, warnings
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.store.fingerprint import foreign_sha256
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.cli.command import BAD_INPUT, kankaku
from tests.unit.scenario_folder import write_scenario

MODULE = "tests.unit.foreign_layers"
REFUSED = ("whole", "required", "unheard", "no_options", "no_build", "no_summary")
NAMES = ("good", *REFUSED, "falls", "silent")


@pytest.fixture(autouse=True)
def offered(monkeypatch: pytest.MonkeyPatch) -> Mapping[str, tuple[EntryPoint, ...]]:
    """Offer what a package would by its entry points."""
    points = [EntryPoint(name, f"{MODULE}:{name.upper()}", OPERATIONS.group) for name in NAMES]
    points.append(EntryPoint("eco", f"{MODULE}:GOOD", OPERATIONS.group))
    found = {point.name: (point,) for point in points}
    monkeypatch.setitem(OPERATIONS.__dict__, "offered", found)
    return found


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("whole", "Whole.blocks is of type int; allowed: float, bool or tuple[float, ...]"),
        ("required", "Required.slowest_kmh has no default"),
        ("unheard", "NameError: name 'Kilometres' is not defined"),
        ("no_options", "has None for options; allowed: a frozen dataclass"),
        ("no_summary", "tells of itself otherwise; allowed: a text"),
        ("no_build", "is built by None; allowed: a class or a function"),
    ],
)
def test_a_layer_that_is_made_wrongly_is_refused_by_the_name_of_its_package(
    name: str, told: str
) -> None:
    with pytest.raises(PluginError) as caught:
        OPERATIONS[name]
    assert str(caught.value).startswith(f"operation '{name}' of {MODULE}:{name.upper()}: {told}")


@pytest.mark.parametrize(
    ("name", "told"), [("falls", "KeyError: 'speeds'"), ("silent", "has no advise")]
)
def test_a_layer_that_cannot_be_built_is_refused_by_the_name_of_its_package(
    name: str, told: str
) -> None:
    spec = ControllerSpec("test", "moving_block", name, {}, {})
    with pytest.raises(PluginError, match=f"operation '{name}' of {MODULE}.*: {told}"):
        build(spec, world_of(two_station_scenario(1)))


def test_options_may_be_declared_by_texts() -> None:
    spec = named((), "moving_block+good")
    (changed,) = with_settings(
        [spec], [f"{spec.name}.steps_kmh=[60, 15]", f"{spec.name}.early=true"]
    )
    assert options_of(changed)["operation"] == {
        "slowest_kmh": 10.0,
        "steps_kmh": (60.0, 15.0),
        "early": True,
    }
    with pytest.raises(ControllerError, match="a list of numbers"):
        with_settings([spec], [f"{spec.name}.steps_kmh=60"])


def test_a_package_that_takes_one_of_our_names_is_left_out_and_told() -> None:
    world = world_of(two_station_scenario(1))
    specs = [ControllerSpec(name, "moving_block", name, {}, {}) for name in ("eco", "close_up")]
    told = f"operation 'eco' of {MODULE}:GOOD is left out: Kankaku has one of that name"
    assert warnings(specs, world) == (f"eco: {told}",)
    assert OPERATIONS["eco"].summary != OPERATIONS["good"].summary


def test_others_run_and_are_listed_beside_packages_that_cannot_be_used(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    chosen = ("--controller", "plain", "--controller", "moving_block+good")
    assert kankaku("run", folder, *chosen, "--jobs", "1", "--out", tmp_path / "out").status == 0
    listed = kankaku("--list-controllers", width=400)
    assert listed.status == 0
    for name in REFUSED:
        assert f"operation '{name}' of {MODULE}:{name.upper()}:" in listed.answers
    assert f"goes close up (package {MODULE}:GOOD)" in listed.answers
    assert "operation 'eco'" in listed.answers
    refused = kankaku("run", folder, "--controller", "moving_block+falls", "--out", tmp_path / "o")
    assert refused.status == BAD_INPUT
    assert f"operation 'falls' of {MODULE}:FALLS: KeyError: 'speeds'" in refused.complaints
    assert not (tmp_path / "o").exists()


def test_every_module_of_a_foreign_package_counts_for_what_a_run_was_made_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "strangers"
    package.mkdir()
    (package / "__init__.py").write_text("from strangers.own import Own\n", "utf-8")
    (package / "own.py").write_text("class Own: ...\n", "utf-8")
    (package / "physics.py").write_text("SLOW_MPS = 3.0\n", "utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    from strangers import Own  # type: ignore[import-not-found]  # noqa: PLC0415 - written above

    before = foreign_sha256(Own)
    (package / "physics.py").write_text("SLOW_MPS = 4.0\n", "utf-8")
    assert before != foreign_sha256(Own)
