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


def test_a_search_finds_the_same_table_another_time() -> None:
    """Search among few tables on the first trains of the morning, twice."""
    train: Any = import_module("kankaku_trained_ceiling.train")
    whole = kankaku.load("rush_hour")
    few = replace(whole.timetable, services=whole.timetable.services[:4])
    one, other = (train.Search(replace(whole, timetable=few)).found(1, 3) for _ in range(2))
    assert one == other
    assert len(one[0].ceiling_kmh) == 9


def test_tables_that_make_no_sense_are_refused() -> None:
    """Knots rise, and the table has a number for each pair of them."""
    with pytest.raises(OptionError, match="gap_m"):
        OPTIONS(gap_m=(5.0, 5.0))
    with pytest.raises(OptionError, match="ceiling_kmh has 2 numbers"):
        OPTIONS(ceiling_kmh=(5.0, 5.0))
