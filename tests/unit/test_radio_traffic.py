"""Radio traffic: utilisations and round trips in closed form, overload, losses, repeats."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kankaku.railway.radio.cells import Cells, Link, RadioSystem, fragments_bytes
from kankaku.railway.radio.traffic import busy_shares
from kankaku.telecom import simulate
from tests.unit.radio_systems import CENTRAL, CONVENTIONAL, ONE_CELL, changed, standing

SEED = 7
SLOT_S = 0.5 / 22
PACKET_S = 8.0 * 8096 / 10e6
LONGEST_FRAME_S = 8.0 * 1538 / 10e6


@pytest.mark.parametrize("trains", [0, 1, 5, 18])
def test_utilisation_is_slots_times_airtime(trains: int) -> None:
    traffic = simulate(CENTRAL, ONE_CELL, standing(CENTRAL, trains, 20.0), SEED)
    # The first commands are sent in the second update, so the first second is left out.
    down, up = (
        traffic.busy[[link.kind for link in traffic.links].index(kind)][2:].mean()
        for kind in (Link.ANTENNA_TRAIN, Link.TRAIN_ANTENNA)
    )
    assert down == pytest.approx((2 * trains + 3 + 4 + 1) * 0.0225)
    assert up == pytest.approx((2 * trains + 3) * 0.0225, abs=1e-9)


def test_wired_utilisation_is_one_packet_per_update() -> None:
    cells = Cells(np.linspace(0.0, 10_000.0, 11), 0.0)
    traffic = simulate(CENTRAL, cells, standing(CENTRAL, 3, 60.0), SEED)
    assert traffic.utilisation(Link.CONTROLLER_SWITCH) == pytest.approx(20 * PACKET_S)
    assert traffic.utilisation(Link.SWITCH_UNIT) == pytest.approx(2 * PACKET_S)
    # The first answers of a unit are on their way after more than an update.
    assert traffic.utilisation(Link.UNIT_SWITCH) == pytest.approx(2 * PACKET_S, rel=0.03)
    assert sum(fragments_bytes(CENTRAL.wired_packet_bytes)) == 8096


def test_the_round_trip_of_a_lone_train() -> None:
    traffic = simulate(CENTRAL, ONE_CELL, standing(CENTRAL, 1, 30.0), SEED)
    # Made at 0; on the wire until the second update begins; answers are gathered until six slots
    # after its end; then on the wire again.
    wire_s = PACKET_S + LONGEST_FRAME_S
    assert traffic.round_trips_s == pytest.approx(1.0 + 6 * SLOT_S + wire_s)
    # Two broadcasts come first, in every other update a slot of the unit's own, too.
    arrived_s = traffic.delays_s
    assert np.unique(arrived_s.round(6)) == pytest.approx(
        [0.5 + 2 * SLOT_S + 0.0225, 0.5 + 3 * SLOT_S + 0.0225], abs=1e-6
    )


def test_a_base_unit_answers_from_its_own_slots() -> None:
    traffic = simulate(CONVENTIONAL, ONE_CELL, standing(CONVENTIONAL, 16, 30.0), SEED)
    assert traffic.delays_s.max() == pytest.approx(15 / 16 + 0.060)
    assert traffic.round_trips_s.min() == pytest.approx(1 / 16 + 0.060)
    assert all(link.kind is not Link.CONTROLLER_SWITCH for link in traffic.links)


def test_base_units_tell_each_other_of_trains_at_their_border_only() -> None:
    cells = Cells(np.array([0.0, 1000.0, 2000.0]), 200.0)
    far = simulate(CONVENTIONAL, cells, np.full((60, 4), 500.0), SEED)
    near = simulate(CONVENTIONAL, cells, np.full((60, 4), 1000.0), SEED)
    assert far.utilisation(Link.UNIT_SWITCH) == 0.0
    # Four frames of 72 + 8 + 20 + 38 bytes from each of the two base units in each second.
    assert near.utilisation(Link.UNIT_SWITCH) == pytest.approx(4 * 8 * 138 / 10e6)
    assert near.utilisation(Link.SWITCH_UNIT) == pytest.approx(4 * 8 * 138 / 10e6, rel=0.01)
    assert near.made_s.size == 2 * far.made_s.size


@pytest.mark.parametrize(("devices", "carried"), [(3, 18), (20, 9)])
def test_commands_are_left_over_from_the_train_on_that_the_slots_cannot_carry(
    devices: int, carried: int
) -> None:
    system = changed(CENTRAL, trackside_devices=devices)
    assert system.trains_per_cell == carried
    fits = simulate(system, ONE_CELL, standing(system, carried, 30.0), SEED)
    over = simulate(system, ONE_CELL, standing(system, carried + 1, 30.0), SEED)
    assert np.isfinite(fits.delays_s).all()
    assert 0.01 < np.isinf(over.delays_s).mean() < 0.2
    # A newer command takes the place of one that waits, so none is ever old.
    assert over.delays_s[np.isfinite(over.delays_s)].max() < 1.2


def test_what_a_wired_packet_has_no_room_for_never_arrives() -> None:
    system = changed(CENTRAL, wired_packet_bytes=6 * 180, trackside_devices=0)
    traffic = simulate(system, ONE_CELL, standing(system, 6, 30.0), SEED)
    assert np.isinf(traffic.delays_s).mean() == pytest.approx(2 / 6)


@pytest.mark.parametrize(("loss", "repeats"), [(0.1, 0), (0.3, 1), (0.3, 2)])
def test_losses_and_repeats_are_as_probable_as_they_should_be(loss: float, repeats: int) -> None:
    system = changed(CENTRAL, loss=loss, repeats=repeats, trackside_devices=0)
    traffic = simulate(system, ONE_CELL, standing(system, 2, 3000.0), SEED)
    failed = 1.0 - (1.0 - loss) ** 2
    lost, unanswered = np.isinf(traffic.delays_s).mean(), np.isnan(traffic.returned_s).mean()
    # 12 000 commands: five standard errors are 0.023 at the most.
    assert lost == pytest.approx(loss ** (repeats + 1), abs=0.023)
    assert unanswered == pytest.approx(failed ** (repeats + 1), abs=0.023)
    tries = sum(failed**k for k in range(repeats + 1))
    assert traffic.tries.mean() == pytest.approx(tries, abs=0.04)


def test_the_same_seed_gives_the_same_traffic_and_another_one_other_losses() -> None:
    system = changed(CENTRAL, loss=0.2)
    first, again, other = (
        simulate(system, ONE_CELL, standing(system, 3, 60.0), seed) for seed in (1, 1, 2)
    )
    assert np.array_equal(first.returned_s, again.returned_s, equal_nan=True)
    assert np.array_equal(first.busy, again.busy)
    assert not np.array_equal(first.returned_s, other.returned_s, equal_nan=True)


SYSTEMS = st.builds(
    changed,
    st.just(CENTRAL),
    central=st.booleans(),
    trackside_devices=st.integers(0, 30),
    updates_per_cycle=st.integers(1, 4),
    answer_slots=st.integers(1, 8),
    loss=st.sampled_from([0.0, 0.2]),
)


@settings(max_examples=60, deadline=None)
@given(SYSTEMS, st.integers(0, 30), st.integers(1, 4))
def test_whatever_the_system_no_channel_is_overfull_and_nothing_comes_before_its_time(
    system: RadioSystem, trains: int, cells: int
) -> None:
    place = Cells(np.linspace(0.0, 4000.0, cells + 1), 300.0)
    updates = 10 * system.updates_per_cycle
    front_m = np.random.default_rng(SEED).uniform(0.0, 4000.0, (updates, trains))
    traffic = simulate(system, place, front_m, SEED)
    assert traffic.busy.min(initial=0.0) >= 0.0
    assert traffic.busy.max(initial=0.0) <= 1.0 + 1e-9
    taken_s = traffic.arrived_s - traffic.made_s
    assert not (taken_s < system.airtime_s - 1e-9).any()
    assert not (traffic.returned_s < traffic.arrived_s).any()
    assert traffic.tries.max(initial=0) <= 1 + system.repeats
    if system.loss == 0.0:
        assert np.array_equal(np.isnan(traffic.returned_s), np.isnan(traffic.arrived_s))


@given(
    st.lists(st.floats(0.0, 2.5), max_size=20).map(sorted),
)
def test_the_shares_of_the_seconds_add_up_to_the_time_sent(times_s: list[float]) -> None:
    pairs = list(pairwise(times_s))[::2]
    starts_s, ends_s = np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])
    shares = busy_shares(starts_s, ends_s, 3)
    assert shares.sum() == pytest.approx(float((ends_s - starts_s).sum()), abs=1e-9)
    assert (shares <= 1.0 + 1e-9).all()
