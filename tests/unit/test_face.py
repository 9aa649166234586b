"""The public face: what a notebook or a script calls, and how little importing it costs."""

import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint, version
from pathlib import Path

import pytest

import kankaku
from kankaku.controllers import registry
from kankaku.controllers.layers import PluginError, Registry
from tests.cli.command import PROJECT
from tests.unit.own_layers import Own, OwnOptions
from tests.unit.scenario_folder import write_scenario

HEAVY = {"numpy", "pandas", "scipy", "numba", "matplotlib", "libsumo", "pydantic", "typer"}


@pytest.fixture
def own() -> Iterator[str]:
    """Register an operation for a test."""
    kankaku.register_operation("own", Own, OwnOptions, "goes close up")
    yield "moving_block+own"
    del registry.OPERATIONS.data["own"]


def test_importing_it_reads_nothing_heavy() -> None:
    told = "import kankaku, sys; print(*(name for name in sys.modules if '.' not in name))"
    done = subprocess.run(  # noqa: S603 - our own arguments
        [sys.executable, "-c", told], cwd=PROJECT, capture_output=True, text=True, check=True
    )
    assert not HEAVY & set(done.stdout.split())


def test_everything_it_names_is_there_and_nothing_else() -> None:
    for name in kankaku.__all__:
        assert getattr(kankaku, name) is not None
    assert set(dir(kankaku)) == set(kankaku.__all__)
    assert kankaku.__version__ == version("kankaku")
    with pytest.raises(AttributeError, match="no attribute 'simulate_everything'"):
        kankaku.simulate_everything  # noqa: B018 - asked for on purpose


def test_a_shipped_scenario_is_read_by_its_name_and_a_folder_comes_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "rush_hour" in kankaku.shipped_scenarios()
    shipped = kankaku.load("eco_driving")
    assert shipped.name == "eco_driving"
    write_scenario(tmp_path / "eco_driving")
    monkeypatch.chdir(tmp_path)
    assert kankaku.load("eco_driving").title != shipped.title


def test_an_unknown_scenario_is_answered_with_the_likeliest_name() -> None:
    with pytest.raises(kankaku.KankakuError, match=r"'rush_hour' \(did you mean that\?\)"):
        kankaku.load("rush_hou")


def test_one_run_gives_tables(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    tables = kankaku.run_once(folder, "moving_block+close_up", seed=3)
    assert not len(tables.violations)
    assert tables.seed == 3
    assert tables.controller == "moving_block+close_up"
    assert tables.calls["arrival_s"].notna().any()


def test_an_own_operation_runs_here_and_in_worker_processes(tmp_path: Path, own: str) -> None:
    write_scenario(tmp_path / "small")
    here = kankaku.run_once(tmp_path / "small", own)
    study = kankaku.choose(tmp_path / "small", names=[own], settings=[f"{own}.slowest_kmh=5"])
    result = kankaku.run_study(study, tmp_path / "out")
    assert not result.failed
    (there,) = kankaku.read_results(result.folder).runs
    assert there.calls.equals(here.calls)
    assert "sources_sha256" in result.kept[0].told["controller"]


def test_an_operation_of_a_notebook_is_run_once_but_told_that_workers_cannot_read_it(
    tmp_path: Path, own: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_scenario(tmp_path / "small")
    study = kankaku.choose(tmp_path / "small", names=[own])
    monkeypatch.setattr(Own, "__module__", "__main__")
    monkeypatch.setattr(sys.modules["__main__"], "Own", Own, raising=False)
    monkeypatch.delattr(sys.modules["__main__"], "__file__", raising=False)
    with pytest.raises(kankaku.KankakuError, match="own: is defined in a notebook"):
        kankaku.run_study(study, tmp_path / "out")


@pytest.mark.parametrize("name", ["close_up", "two words", "own"])
def test_a_name_that_is_taken_or_no_name_is_refused(own: str, name: str) -> None:
    if name == "own":
        kankaku.register_operation(name, Own, OwnOptions, "again: a cell that is run twice")
        return
    with pytest.raises(PluginError, match=r"is there already|is no name"):
        kankaku.register_operation(name, Own, OwnOptions, "again")
    assert own


def offering(*points: EntryPoint) -> Registry:
    layers = Registry("operation", "kankaku.nothing", {"ours": registry.OPERATIONS["close_up"]})
    offered: dict[str, tuple[EntryPoint, ...]] = {}
    for point in points:
        offered[point.name] = (*offered.get(point.name, ()), point)
    layers.__dict__["offered"] = offered
    return layers


def test_layers_of_packages_are_found_and_broken_ones_name_the_package() -> None:
    group = "kankaku.nothing"
    layers = offering(
        EntryPoint("good", "kankaku.controllers.registry:Layer", group),
        EntryPoint("gone", "no_such_package:LAYER", group),
        EntryPoint("twice", "one:LAYER", group),
        EntryPoint("twice", "other:LAYER", group),
        EntryPoint("ours", "theirs:LAYER", group),
    )
    assert list(layers) == ["ours", "good", "gone", "twice"]
    assert layers["ours"] is registry.OPERATIONS["close_up"]
    with pytest.raises(PluginError, match=r"'gone' of no_such_package:LAYER: ModuleNotFoundError"):
        layers["gone"]
    with pytest.raises(PluginError, match="two packages have that name"):
        layers["twice"]
    with pytest.raises(PluginError, match=r"is a type; allowed: a kankaku\.Layer"):
        layers["good"]
    with pytest.raises(KeyError):
        layers["unheard_of"]
