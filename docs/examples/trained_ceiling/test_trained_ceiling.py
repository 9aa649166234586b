"""The operation keeps the contract of Kankaku, and its weights are what training said."""

import json
from dataclasses import replace
from importlib import import_module
from importlib.resources import files
from typing import Any

import pytest

import kankaku
from kankaku.controllers import registry
from kankaku.controllers.options import OptionError
from kankaku.testing import check_controller, failures

OPTIONS: Any = registry.OPERATIONS["trained_ceiling"].options
TOLD = json.loads(files("kankaku_trained_ceiling").joinpath("weights.json").read_text("utf-8"))


def test_it_keeps_the_contract() -> None:
    """Run what ``kankaku check-controller trained_ceiling`` runs."""
    assert not failures(check_controller("trained_ceiling"))


def test_a_seed_that_was_not_trained_on_gives_the_figures_that_the_weights_tell() -> None:
    """Run the first of the mornings that training was tried on once more."""
    tried = TOLD["tried"][0]
    assert tried["seed"] not in TOLD["trained"]["seeds"]
    run = kankaku.run_once(
        "rush_hour", "moving_block+trained_ceiling", seed=tried["seed"], step_s=0.5
    )
    assert run.violations.empty
    assert run.interstation_stops["duration_s"].sum() == pytest.approx(tried["own"]["stops_s"])
    assert run.energy["net_kwh"].mean() == pytest.approx(tried["own"]["energy_kwh"])


def searched(scenario: kankaku.Scenario) -> tuple[Any, list[Any]]:
    """Return what a search among two tables finds, and both."""
    train: Any = import_module("kankaku_trained_ceiling.train")
    search, tables = train.Search(scenario), []
    cost_of = search.cost

    def noted(table: Any) -> Any:  # noqa: ANN401 - options of the operation
        tables.append(table)
        return cost_of(table)

    search.cost = noted
    return search.found(1, 2), tables


def test_a_search_tries_and_finds_the_same_tables_another_time() -> None:
    """Search on the first two trains of the morning, twice."""
    whole = kankaku.load("rush_hour")
    few = replace(whole.timetable, services=whole.timetable.services[:2])
    one, other = (searched(replace(whole, timetable=few)) for _ in range(2))
    assert one == other
    (best, _), tables = one
    assert len(best.ceiling_kmh) == 9
    assert best in tables
    assert tables[0] != tables[1]


def test_tables_that_make_no_sense_are_refused() -> None:
    """Knots rise, and the table has a number for each pair of them."""
    with pytest.raises(OptionError, match="gap_m"):
        OPTIONS(gap_m=(5.0, 5.0))
    with pytest.raises(OptionError, match="ceiling_kmh has 2 numbers"):
        OPTIONS(ceiling_kmh=(5.0, 5.0))
