"""The operation keeps the contract of Kankaku, matches speeds, and what it risks is told."""

import runpy
from pathlib import Path

import numpy as np

import kankaku
from kankaku.testing import check_controller, failures


def test_it_keeps_the_contract_over_relative_braking_too() -> None:
    """Run what ``kankaku check-controller virtual_coupling`` runs, and over relative braking."""
    assert not failures(check_controller("virtual_coupling"))
    assert not failures(check_controller("relative_braking+virtual_coupling"))


def test_it_couples_and_breaks_no_rule_that_protection_declares() -> None:
    """Its word stands in the trajectory only behind trains that run."""
    run = kankaku.run_once("yizhuang", "relative_braking+virtual_coupling", step_s=0.5)
    assert run.violations.empty
    coupled = run.trajectory[run.trajectory["plan"] == "virtual_coupling"]
    assert not coupled.empty
    speeds = run.trajectory.set_index(["time_s", "train"])["speed_mps"]
    ahead_mps = speeds.reindex(list(zip(coupled["time_s"], coupled["cause"], strict=True)))
    assert np.nanmin(ahead_mps) > 0.0


def test_a_leader_that_stops_dead_is_what_it_does_not_cover() -> None:
    """The monitor finds nothing by the declared rule, and much behind a brick wall."""
    shown = runpy.run_path(str(Path(__file__).with_name("brick_wall.py")))
    found = shown["judged"]("yizhuang")
    assert found["relative_braking"].empty
    assert "band" in set(found["brick_wall"]["kind"])
