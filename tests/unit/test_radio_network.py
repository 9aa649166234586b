"""Frames, slots and cells: closed forms and the figures of the published network."""

import numpy as np
import pytest

from kankaku.railway.radio.cells import Cells, fragments_bytes
from tests.unit.radio_systems import CENTRAL, CONVENTIONAL, changed


def test_a_short_message_fills_the_shortest_frame() -> None:
    # 64 bytes from header to checksum, 8 of preamble and 12 of gap.
    assert fragments_bytes(1) == (84,)
    assert fragments_bytes(18) == (84,)
    assert fragments_bytes(19) == (85,)


def test_the_published_packet_takes_six_frames() -> None:
    # 7740 + 8 bytes in fragments of 1480, each with 20 of IP and 38 of Ethernet.
    frames = fragments_bytes(7740)
    assert frames == (1538,) * 5 + (7748 - 5 * 1480 + 58,)
    assert sum(frames) == 8096


@pytest.mark.parametrize("size", [1471, 1472, 1498, 2952, 2978])
def test_fragments_hold_the_message_and_no_frame_is_too_long(size: int) -> None:
    frames = fragments_bytes(size)
    assert max(frames) <= 1538
    assert sum(frames) - 58 * len(frames) == size + 8


def test_slots_of_the_published_radios() -> None:
    # 180 bytes at 64 kbit/s: 22.5 ms, 44 of them in a second; 72 bytes at 9.6 kbit/s: 60 ms, 16.
    assert pytest.approx(0.0225) == CENTRAL.airtime_s
    assert CENTRAL.slots_per_update == 22
    assert CENTRAL.telegrams_per_packet == 43
    assert pytest.approx(0.060) == CONVENTIONAL.airtime_s
    assert CONVENTIONAL.slots_per_update == 16


def test_trains_per_cell_by_counting_slots() -> None:
    # 44 slots less 1 of its own, 4 broadcasts and 3 trackside devices, two for each train.
    assert CENTRAL.trains_per_cell == (44 - 1 - 4 - 3) // 2 == 18
    assert changed(CENTRAL, trackside_devices=20).trains_per_cell == 9
    assert CONVENTIONAL.trains_per_cell == 16


def test_the_published_greatest_cell_needs_one_command_a_second() -> None:
    # 16 trains and 20 trackside devices do not fit at two commands a second.
    full = changed(CENTRAL, trackside_devices=20, updates_per_cycle=1)
    assert full.trains_per_cell >= 16
    assert changed(CENTRAL, trackside_devices=20).trains_per_cell < 16


def test_a_short_wired_packet_limits_a_cell() -> None:
    # Room for 6 telegrams: 2 broadcasts, 2 of 3 trackside devices in one update, 2 trains.
    assert changed(CENTRAL, wired_packet_bytes=6 * 180).trains_per_cell == 2


def test_near_a_border_two_units_serve_a_train_and_none_off_the_line() -> None:
    cells = Cells(np.array([0.0, 1000.0, 2000.0]), 200.0)
    front_m = np.array([-50.0, 899.0, 901.0, 1099.0, 1101.0, 2100.0, np.nan])
    served = cells.serving(front_m)
    assert served[:, 0].tolist() == [True, True, True, True, False, False, False]
    assert served[:, 1].tolist() == [False, False, True, True, True, True, False]
