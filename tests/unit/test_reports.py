"""What a centre knows by reports is what was true when they were made."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kankaku.controllers.centre.reports import emergency, no_reports, radio_of, take_reports
from kankaku.railway.plan.radio_spec import RadioSpec
from kankaku.railway.radio.data_link import Radio
from kankaku.railway.step.state import LineState
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.states import behind

WORLD = world_of(two_station_scenario(2))
START_S = 26_000.0


def going(time_s: float) -> LineState:
    """Two trains that have gone at 20 m/s and 10 m/s."""
    gone_s = time_s - START_S
    return behind(
        WORLD, 900.0 + 20.0 * gone_s, 300.0 + 10.0 * gone_s, 10.0, leader_mps=20.0, time_s=time_s
    )


@settings(max_examples=30, deadline=None)
@given(
    st.sampled_from([0.5, 1.0, 2.0]),
    st.floats(0.0, 2.0),
    st.floats(0.0, 2.0),
    st.floats(0.0, 0.8),
    st.integers(0, 99),
)
def test_reports_say_what_was_true_when_they_were_made(
    cycle_s: float, one_s: float, other_s: float, loss: float, seed: int
) -> None:
    spec = RadioSpec(cycle_s, min(one_s, other_s), max(one_s, other_s), loss, 3.0)
    radio, reports = Radio(WORLD, spec, seed), no_reports(WORLD, spec)
    for step in range(300):
        state = going(START_S + 0.1 * step)
        state = state._replace(radio=radio.update(state.time_s, state.present))
        arrived = radio_of(state)
        after = take_reports(reports, state, arrived, spec)
        assert take_reports(after, state, arrived, spec) is after
        reports = after
        assert np.array_equal(reports.known_s, arrived.reported_s)
        for row in range(2):
            if np.isfinite(reports.known_s[row]):
                then = going(float(reports.known_s[row]))
                assert reports.front_m[row] == pytest.approx(then.front_m[row], abs=1e-4)
                assert reports.speed_mps[row] == then.speed_mps[row]
            else:
                assert reports.front_m[row] == WORLD.stop_m[row, 0]
        # Nobody is ever believed to be further on than it is.
        assert np.all(reports.front_m <= state.front_m + 1e-4)


def test_a_run_without_a_radio_is_refused() -> None:
    with pytest.raises(ValueError, match="without one"):
        radio_of(going(START_S))


def test_commands_run_out_after_the_horizon() -> None:
    nobody, state = np.zeros(2, dtype=np.bool_), going(START_S)
    heard_s = START_S - np.array([5.0, 5.1])
    assert emergency(nobody, state, heard_s, 5.0).tolist() == [False, True]
    never = np.full(2, -np.inf)
    assert emergency(nobody, state, never, 5.0).tolist() == [True, True]


def test_a_train_brakes_until_it_stands_and_has_commands_again() -> None:
    both, fresh_s = np.ones(2, dtype=np.bool_), np.full(2, START_S)
    moving = going(START_S)
    assert emergency(both, moving, fresh_s, 5.0).tolist() == [True, True]
    standing = moving._replace(speed_mps=np.array([0.0, 3.0]))
    assert emergency(both, standing, fresh_s, 5.0).tolist() == [False, True]
    assert emergency(both, standing, fresh_s - 6.0, 5.0).tolist() == [True, True]


def test_a_train_that_a_stop_holds_does_not_brake() -> None:
    both, never = np.ones(2, dtype=np.bool_), np.full(2, -np.inf)
    held = going(START_S)._replace(running=np.array([False, True]), speed_mps=np.zeros(2))
    assert emergency(both, held, never, 5.0).tolist() == [False, True]
