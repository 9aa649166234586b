"""The operation keeps the contract of Kankaku, and does something."""

import kankaku
from kankaku.testing import check_controller, failures


def test_it_keeps_the_contract() -> None:
    """Run what ``kankaku check-controller mpc_follower`` runs."""
    assert not failures(check_controller("mpc_follower"))


def test_it_changes_how_trains_run() -> None:
    """Compare a morning with the same one under close-up running."""
    usual, own = (
        kankaku.run_once("yizhuang", f"moving_block+{name}", step_s=0.5)
        for name in ("close_up", "mpc_follower")
    )
    assert own.violations.empty
    assert own.trajectory["speed_mps"].sum() != usual.trajectory["speed_mps"].sum()
