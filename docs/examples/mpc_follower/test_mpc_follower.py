"""The operation keeps the contract of Kankaku, and does what its programme is to do."""

from dataclasses import replace
from typing import Any

import pytest

import kankaku
from kankaku.controllers import registry
from kankaku.controllers.options import OptionError
from kankaku.testing import check_controller, failures


def test_it_keeps_the_contract() -> None:
    """Run what ``kankaku check-controller mpc_follower`` runs."""
    assert not failures(check_controller("mpc_follower"))


def test_trains_stand_less_between_stations() -> None:
    """Compare the first half of a morning with the same one under close-up running."""
    whole = kankaku.load("rush_hour")
    first = replace(whole.timetable, services=whole.timetable.services[:20])
    morning = replace(whole, timetable=first)
    usual, own = (
        kankaku.run_once(morning, f"moving_block+{name}", seed=1, step_s=0.5)
        for name in ("close_up", "mpc_follower")
    )
    assert own.violations.empty
    assert own.energy["completed"].all()
    stops_s, own_s = (run.interstation_stops["duration_s"].sum() for run in (usual, own))
    assert own_s < 0.5 * stops_s


def test_options_that_make_no_sense_are_refused() -> None:
    """A gap is a time, and plans are not made without end."""
    options: Any = registry.OPERATIONS["mpc_follower"].options
    with pytest.raises(OptionError, match="replan_s"):
        options(replan_s=0.0)
