"""On board under the control map: the band that a train keeps, and the speed it is commanded."""

from collections.abc import Sequence

import numpy as np
import pytest

from kankaku.controllers.control_map.onboard import (
    CREEP_MPS,
    HEADROOM_MPS,
    Held,
    Tempo,
    keep_bands,
)
from kankaku.controllers.control_map.telegrams import nothing_sent
from kankaku.railway.compiled import plain
from kankaku.railway.plan.brake_table import BrakeTable
from kankaku.railway.step.state import Whereabouts

STEP_S, MOMENT_S = 0.1, 0.5
BRAKE_MPS2 = 1.0
GRID_M = np.arange(0.0, 5000.0)
LEVEL = 2.0 * BRAKE_MPS2 * GRID_M
"""Twice the brake potential of a level line. [m2/s2]"""
FRONT_M = 1000.0


def keep(
    *,
    since_s: float = 0.0,
    speed_mps: float = 10.0,
    eoas_m: Sequence[float] = (1200.0,) * 11,
    planned_mps: Sequence[float] = (10.0,) * 11,
    free_m: float = 3000.0,
    held_m: float = -np.inf,
    to_stop_m: float = 2000.0,
    meant: bool = True,
) -> tuple[float, float, float]:
    """Ask one train that has heard a telegram sent at 100 s; it went by one of 99 s before."""
    one, front_m = np.ones(1, dtype=np.bool_), np.array([FRONT_M])
    sent = nothing_sent(1)._replace(
        cycle=np.array([100, 99]),
        sent_s=np.array([100.0, 99.0]),
        eoa_m=np.array([[eoas_m], [(1100.0,) * 11]]),
        speed_mps=np.array([[planned_mps], [(5.0,) * 11]]),
        free_m=np.array([[free_m], [3000.0]]),
        furthest_m=np.array([[100.0 if meant else -np.inf], [100.0]]),
    )
    held = Held(
        clock_s=np.array([100.0 + since_s]),
        to_stop_m=np.array([to_stop_m]),
        heard=np.array([100]),
        held=np.array([99]),
        held_m=np.array([held_m]),
    )
    first = np.zeros(1, dtype=np.intp)
    eoa_m, commanded_mps, goes_by_s = keep_bands(
        plain(Whereabouts(front_m, front_m - 200.0, np.array([speed_mps]), one, one, first)),
        plain(held),
        plain(sent),
        plain(Tempo(STEP_S, MOMENT_S)),
        plain(BrakeTable(LEVEL, np.zeros(1), np.array([BRAKE_MPS2]))),
    )
    return float(eoa_m[0]), float(commanded_mps[0]), float(goes_by_s[0])


def test_limits_and_speeds_are_those_of_the_moment() -> None:
    eoas_m = [1200.0 + 10.0 * moment for moment in range(11)]
    planned_mps = [10.0 + moment for moment in range(11)]
    eoa_m, commanded_mps, goes_by_s = keep(since_s=1.25, eoas_m=eoas_m, planned_mps=planned_mps)
    assert eoa_m == pytest.approx(1225.0)
    # At the end of the step, 1.35 s after the telegram.
    assert commanded_mps == pytest.approx(12.7 + HEADROOM_MPS)
    assert goes_by_s == 100.0


def test_past_the_last_moment_the_last_one_stays() -> None:
    eoas_m = [1200.0 + 10.0 * moment for moment in range(11)]
    assert keep(since_s=7.0, eoas_m=eoas_m)[0] == pytest.approx(1300.0)


def test_a_telegram_without_commands_leaves_the_old_ones() -> None:
    eoa_m, commanded_mps, goes_by_s = keep(meant=False)
    assert (eoa_m, goes_by_s) == (1100.0, 99.0)
    assert commanded_mps == pytest.approx(5.0 + HEADROOM_MPS)


def test_a_band_that_shrinks_is_kept_with_the_service_brake() -> None:
    # It stops 50 m ahead; the new command asks for 40 m, the old one allowed 200 m.
    eoas_m = (FRONT_M + 40.0,) * 11
    assert keep(eoas_m=eoas_m, held_m=1200.0)[0] == pytest.approx(FRONT_M + 50.0)
    # Not beyond what the old one allowed, though.
    assert keep(eoas_m=eoas_m, held_m=1045.0)[0] == pytest.approx(1045.0)


def test_what_is_not_free_any_more_is_kept_in_emergency() -> None:
    eoas_m = (FRONT_M + 40.0,) * 11
    found_m = keep(eoas_m=eoas_m, held_m=1200.0, free_m=FRONT_M + 40.0)[0]
    assert found_m == pytest.approx(FRONT_M + 40.0)


def test_short_of_its_stop_a_train_goes_on_to_it() -> None:
    stands = (0.0,) * 11
    assert keep(speed_mps=0.0, planned_mps=stands, to_stop_m=0.7)[1] == CREEP_MPS
    assert keep(speed_mps=0.0, planned_mps=stands, to_stop_m=300.0)[1] == 0.0
