"""The radio: how much it loses, how long it takes, and what nobody can know sooner."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kankaku.railway.arrays import BoolArray
from kankaku.railway.plan.radio_spec import Outage, RadioSpec
from kankaku.railway.plan.world import World
from kankaku.railway.radio.data_link import Radio
from kankaku.railway.step.state import RadioState
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.property.runs import READY_S

START_S = READY_S + 1000.0
"""All trains stand ready by then."""
AT_ONCE = RadioSpec(delay_least_s=0.0, delay_most_s=0.0)


@pytest.fixture(scope="module")
def world() -> World:
    return world_of(two_station_scenario(4))


def everybody(world: World) -> BoolArray:
    return np.ones(world.size, dtype=np.bool_)


def run(
    world: World, spec: RadioSpec, seconds: float, step_s: float, seed: int = 1
) -> list[tuple[float, RadioState]]:
    """Return what had arrived at every step, with everybody on the line."""
    radio, present = Radio(world, spec, seed), everybody(world)
    times_s = START_S + step_s * np.arange(round(seconds / step_s))
    return [(time_s, radio.update(time_s, present)) for time_s in times_s.tolist()]


def losses(world: World, spec: RadioSpec, cycles: int, seed: int = 1) -> tuple[BoolArray, ...]:
    """Return who lost which report and which telegram, of a radio that takes no time."""
    seen = run(world, replace(spec, delay_least_s=0.0, delay_most_s=0.0), cycles, 0.5, seed)
    up = [state.reported_s != time_s for time_s, state in seen[::2]]
    down = [state.heard_s != time_s for time_s, state in seen[1::2]]
    return np.array(up), np.array(down)


def row_lengths(lost: BoolArray) -> list[int]:
    """Return the lengths of all rows of losses that begin and end."""
    edges = np.flatnonzero(np.diff(lost.astype(np.int8)))
    first = 0 if not lost[0] else 1
    starts, ends = edges[first::2], edges[first + 1 :: 2]
    lengths: list[int] = (ends - starts[: ends.size]).tolist()
    return lengths


@pytest.mark.parametrize(("loss", "burst"), [(0.1, 1.0), (0.2, 3.0), (0.5, 6.0)])
def test_share_and_rows_of_losses_are_those_of_the_gilbert_chain(
    world: World, loss: float, burst: float
) -> None:
    cycles = 6000
    for lost in losses(world, RadioSpec(loss_ratio=loss, burst_factor=burst), cycles):
        # Draws are correlated by 1 - 1/f, so 2 f - 1 of them say as much as one alone.
        error = np.sqrt(loss * (1.0 - loss) * (2.0 * burst - 1.0) / lost.size)
        assert abs(lost.mean() - loss) < 4.0 * error
        rows = np.array([length for train in lost.T for length in row_lengths(train)])
        ends = (1.0 - loss) / burst
        error = np.sqrt((1.0 - ends) / rows.size) / ends
        assert abs(rows.mean() - 1.0 / ends) < 4.0 * error
        # Trains do not lose together.
        together = np.mean(lost[:, 0] & lost[:, 1])
        assert abs(together - loss**2) < 4.0 * np.sqrt(loss**2 * (2.0 * burst - 1.0) / cycles)


def test_delays_lie_evenly_between_least_and_most(world: World) -> None:
    spec, step_s = RadioSpec(delay_least_s=0.2, delay_most_s=0.8), 0.01
    seen = run(world, spec, 400.0, step_s)
    taken = []
    for (_, before), (time_s, state) in pairwise(seen):
        for was_s, is_s in (
            (before.reported_s, state.reported_s),
            (before.heard_s, state.heard_s),
        ):
            taken += (time_s - is_s[is_s > was_s]).tolist()
    delays_s = np.array(taken)
    assert delays_s.size > 2500
    assert delays_s.min() >= 0.2 - 1e-6
    assert delays_s.max() <= 0.8 + step_s
    # It is seen half a step late in the mean.
    error = 0.6 / np.sqrt(12.0 * delays_s.size)
    assert abs(delays_s.mean() - 0.5 - 0.5 * step_s) < 4.0 * error
    assert delays_s.std() == pytest.approx(0.6 / np.sqrt(12.0), rel=0.05)


def test_reports_go_out_at_whole_cycles_and_commands_half_a_cycle_later(world: World) -> None:
    for cycle_s in (0.5, 1.0, 1.6):
        spec = replace(AT_ONCE, cycle_s=cycle_s)
        for time_s, state in run(world, spec, 20.0, 0.1)[20:]:
            assert 0.0 <= time_s + 1e-6 - state.reported_s[0] < cycle_s
            assert state.reported_s[0] / cycle_s == pytest.approx(
                round(state.reported_s[0] / cycle_s), abs=1e-6
            )
            offset = (state.heard_s[0] - state.reported_s[0]) / cycle_s
            assert abs(offset) == pytest.approx(0.5, abs=1e-6)


radios = st.builds(
    lambda cycle_s, least_s, range_s, loss, burst: RadioSpec(
        cycle_s, least_s, min(least_s + range_s, 2.0), loss, burst
    ),
    st.sampled_from([0.4, 1.0, 2.0]),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.5),
    st.floats(0.0, 0.9),
    st.floats(1.0, 8.0),
)


@settings(max_examples=40, deadline=None)
@given(radios, st.integers(0, 99), st.lists(st.integers(0, 400), min_size=8, max_size=8))
def test_nobody_knows_what_has_not_arrived(
    spec: RadioSpec, seed: int, comes_and_goes: Sequence[int]
) -> None:
    world = world_of(two_station_scenario(4))
    radio, step_s = Radio(world, spec, seed), 0.1
    before = radio.update(START_S - step_s, np.zeros(4, dtype=np.bool_))
    heard_then: dict[float, list[float]] = {}
    kept: list[tuple[RadioState, list[list[float]]]] = []
    for step in range(400):
        time_s = START_S + step_s * step
        present = np.array([min(p) <= step < max(p) for p in np.reshape(comes_and_goes, (4, 2))])
        state = radio.update(time_s, present)
        if state is not before:
            kept.append((state, [np.array(values).tolist() for values in state]))
        for was, now in zip(before, state, strict=True):
            assert np.all(np.array(now) >= np.array(was))
        assert not np.any((state.heard_s > before.heard_s) & ~present)
        assert np.all(state.reported_s <= time_s - spec.delay_least_s + 1e-5)
        assert np.all(state.heard_s <= time_s - spec.delay_least_s + 1e-5)
        # What is acknowledged is what the train had when it made the report that arrived last.
        made_s = spec.report_s(spec.report_cycle(time_s))
        heard_then.setdefault(made_s, state.heard_s.tolist())
        for row in np.flatnonzero(np.isfinite(state.reported_s)).tolist():
            had_s = heard_then[state.reported_s[row]][row]
            if spec.delay_least_s > 0.0:
                assert state.acknowledged_s[row] == had_s
            assert state.acknowledged_s[row] <= state.heard_s[row]
        before = state
    for state, values in kept:
        assert [np.array(now).tolist() for now in state] == values


def test_between_arrivals_the_same_arrays_come_back(world: World) -> None:
    seen = [state for _, state in run(world, RadioSpec(), 10.0, 0.01)]
    changes = sum(one is not other for one, other in pairwise(seen))
    # Four trains, two directions, ten cycles.
    assert 60 <= changes <= 80
    reports = [state.reports_version for state in seen]
    assert 30 <= sum(one != other for one, other in pairwise(reports)) <= 40


def test_a_train_loses_the_same_whatever_else_runs(world: World) -> None:
    spec, cycles = RadioSpec(loss_ratio=0.3, burst_factor=2.0), 1500
    four = losses(world, spec, cycles)
    two = losses(world_of(two_station_scenario(2)), spec, cycles)
    for more, less in zip(four, two, strict=True):
        assert np.array_equal(more[:, :2], less)
    assert not np.array_equal(four[0][:, 0], four[0][:, 1])
    assert not np.array_equal(four[0], four[1])
    assert not np.array_equal(four[0], losses(world, spec, cycles, seed=2)[0])


def test_a_train_loses_the_same_whenever_it_is_on_the_line(world: World) -> None:
    spec = replace(AT_ONCE, loss_ratio=0.3, burst_factor=2.0)
    always, now_and_then = Radio(world, spec, 1), Radio(world, spec, 1)
    present, compared = everybody(world), 0
    for step in range(600):
        time_s = START_S + 0.5 * step
        there = present & (np.arange(4) * 50 <= step % 300)
        full, part = always.update(time_s, present), now_and_then.update(time_s, there)
        fresh_s = spec.report_s(spec.report_cycle(time_s))
        if fresh_s == time_s:
            assert np.array_equal(
                (full.reported_s == fresh_s)[there], (part.reported_s == fresh_s)[there]
            )
            assert not np.any((part.reported_s == fresh_s)[~there])
            compared += int(np.count_nonzero(there))
    assert compared > 700


def test_outages_lose_what_is_sent_within_them_and_nothing_else(world: World) -> None:
    from_s = START_S + 10.0
    outages = (
        Outage(("T2",), up=True, down=False, from_s=from_s, until_s=from_s + 5.0),
        Outage((), up=False, down=True, from_s=from_s + 20.0, until_s=from_s + 23.0),
    )
    spec = RadioSpec(loss_ratio=0.2)
    usual = losses(world, spec, 60)
    up, down = losses(world, replace(spec, outages=outages), 60)
    assert up[10:15, 1].all()
    up[10:15, 1] = usual[0][10:15, 1]
    assert np.array_equal(up, usual[0])
    assert down[30:33].all()
    down[30:33] = usual[1][30:33]
    assert np.array_equal(down, usual[1])
