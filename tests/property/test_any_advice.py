"""No advice and no action makes a run unsafe: the monitor, which trusts nobody, finds nothing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kankaku
from kankaku.live.agent_spaces import ACTIONS
from kankaku.live.line_advice import LineAdvice
from kankaku.live.line_environment import LineEnvironment
from kankaku.live.simulation import Simulation
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.railway.step.state import NO_HOLD_S
from kankaku.studies.opening import NO_SUMO
from kankaku.testing.example_lines import merge_scenario
from tests.examples import all_if_deep, examples

PROTECTIONS = ("moving_block", "multi_step_atc", "atd", "digital_atc")
SCENARIOS = {name: kankaku.load(name) for name in ("branch", "single_track", "overtaking")}
EPISODES = [(name, seed) for seed in range(34) for name in SCENARIOS][:100]


@pytest.mark.parametrize(("name", "seed"), all_if_deep(EPISODES, EPISODES[:6]))
def test_episodes_of_random_actions_break_no_rule(name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    environment = LineEnvironment(
        SCENARIOS[name],
        interval_s=float(rng.choice([5.0, 10.0, 30.0])),
        step_s=0.5,
        actions=ACTIONS,
    )
    environment.action_space.seed(seed)
    environment.reset(seed=seed)
    over = False
    while not over:
        action = environment.action_space.sample()
        # Uniform speeds seldom let a train run at all.
        free = rng.random(action.shape[0]) < 0.5
        action[free, :2] = environment.action_space.high[free, :2]
        _, _, finished, cut_off, told = environment.step(action)
        over = finished or cut_off
    record = environment.link.simulation.record()
    assert record.violations == ()
    assert told["violations"] == 0
    assert record.train_steps > 1000


@examples(20)
@given(st.data(), st.sampled_from(PROTECTIONS), st.sampled_from([0.5, 4.0, 25.0]))
def test_any_advice_over_any_protection_breaks_no_rule(
    data: st.DataObject, protection: str, interval_s: float
) -> None:
    line = merge_scenario(3, 50.0, block_m=200.0, step_s=0.5)
    spec = ControllerSpec("test", protection, "close_up", {}, {})
    stepped = Simulation(line, spec, 1, interval_s=interval_s, engine=NO_SUMO)
    speeds = st.lists(st.sampled_from([0.0, 3.0, 15.0, 1e4, np.inf]), min_size=3, max_size=3)
    holds = st.lists(st.sampled_from([NO_HOLD_S, 0.0, 20.0, 90.0]), min_size=3, max_size=3)
    view, asked = stepped.reset(), 0
    while not stepped.over:
        advice = None
        if asked < 40:
            hold_s = np.array(data.draw(holds)) + view.time_s
            parts = (np.array(data.draw(speeds)), np.array(data.draw(speeds)))
            advice, asked = LineAdvice(*parts, hold_until_s=hold_s), asked + 1
        view = stepped.step(advice)
    assert stepped.record().violations == ()
