"""Environments: what their libraries ask of them, seeds, refusals, and what the shield tells."""

import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test, parallel_seed_test

import kankaku
from kankaku.live.agent_rewards import INDICATORS
from kankaku.live.agent_spaces import ACTIONS, FEATURES, LONGEST_HOLD_S
from kankaku.live.environments import LINE_ID, MissingExtraError
from kankaku.live.line_environment import LineEnvironment
from kankaku.railway.errors import KankakuError
from kankaku.testing.example_lines import merge_scenario

LINE = merge_scenario(3, 50.0, step_s=0.5)
EVERYTHING = dict.fromkeys(INDICATORS, 1.0)


def line_environment(**choices: Any) -> LineEnvironment:  # noqa: ANN401
    kankaku.register_environments()
    made = gymnasium.make(LINE_ID, scenario=LINE, **choices)
    assert isinstance(made.unwrapped, LineEnvironment)
    return made.unwrapped


def test_gymnasium_finds_nothing_wrong() -> None:
    with warnings.catch_warnings():
        # It advises spaces from -1 to 1; ours have units.
        warnings.filterwarnings("ignore", message=".*symmetric and normalized.*")
        check_env(line_environment(actions=ACTIONS, rewards=EVERYTHING))


def test_pettingzoo_finds_nothing_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    parallel_api_test(kankaku.parallel_env(LINE, actions=ACTIONS), num_cycles=200)
    assert "Passed" in capsys.readouterr().out
    parallel_seed_test(lambda: kankaku.parallel_env(LINE), num_cycles=60)


def episode(environment: LineEnvironment, seed: int) -> tuple[bytes, float, dict[str, Any]]:
    environment.action_space.seed(seed)
    seen, told = environment.reset(seed=seed)
    whole, total, over = seen.tobytes(), 0.0, False
    while not over:
        seen, reward, finished, cut_off, told = environment.step(environment.action_space.sample())
        whole, total, over = whole + seen.tobytes(), total + reward, finished or cut_off
    return whole, total, told


def test_seeds_reproduce_episodes_byte_by_byte() -> None:
    one = kankaku.load("branch")
    choices = {"scenario": one, "interval_s": 30.0, "step_s": 0.5}
    first, second = LineEnvironment(**choices), LineEnvironment(**choices)
    whole, total, _ = episode(first, 7)
    assert episode(second, 7)[:2] == (whole, total)
    assert episode(first, 8)[0] != whole
    assert episode(first, 7)[:2] == (whole, total)
    one_text, other_text = (
        made.link.simulation.tables().trajectory.to_csv() for made in (first, second)
    )
    assert one_text == other_text


def test_episodes_without_a_seed_follow_from_the_last_one() -> None:
    environment = line_environment()
    drawn = []
    for _ in range(2):
        environment.reset(seed=3)
        drawn.append([environment.reset()[1]["seed"] for _ in range(3)])
    assert drawn[0] == drawn[1]
    assert len(set(drawn[0])) == 3


def test_the_reward_of_delay_adds_up_to_the_lateness_at_the_end() -> None:
    environment = line_environment(actions=("hold",), rewards={"delay": 1.0})
    environment.reset(seed=1)
    total, over, steps = 0.0, False, 0
    while not over:
        # Who is held at every decision is held for good.
        hold_s = LONGEST_HOLD_S if steps < 20 else 0.0
        _, reward, over, _, told = environment.step(np.full((3, 1), hold_s, dtype=np.float32))
        total, steps = total + reward, steps + 1
    late_s = environment.link.simulation.state.delay_s
    assert total == pytest.approx(-late_s.sum() / 60.0)
    assert late_s.min() > 60.0
    assert told["violations"] == 0


def test_rewards_are_the_indicators_of_the_run() -> None:
    totals = {}
    for name in ("stops", "standing", "energy"):
        environment = line_environment(actions=("ceiling",), rewards={name: 1.0})
        environment.reset(seed=1)
        total, over = 0.0, False
        while not over:
            _, reward, over, _, _ = environment.step(environment.action_space.high)
            total -= reward
        totals[name] = total
    record = environment.link.simulation.record()
    net_j = record.energy.consumed_j - record.energy.recovered_j
    assert totals["stops"] == record.standstills.row.size
    assert totals["standing"] == pytest.approx(record.standstills.duration_s.sum() / 60.0)
    assert totals["energy"] == pytest.approx(net_j.sum() / 3.6e6)


def test_what_the_shield_cuts_off_is_told() -> None:
    environment = line_environment(actions=("ceiling",))
    environment.reset(seed=1)
    cut_mps, shield_s, over = 0.0, 0.0, False
    # Just below the top speed, which would ask for nothing.
    action = (0.99 * environment.action_space.high).astype(np.float32)
    while not over:
        _, _, over, _, told = environment.step(action)
        cut_mps = max(cut_mps, told["cut_mps"].max())
        shield_s += told["shield_s"].sum()
    assert cut_mps > 1.0
    assert shield_s > 1.0
    assert told["violations"] == 0


def test_every_train_is_an_agent_until_it_has_left() -> None:
    parallel = kankaku.parallel_env(LINE)
    _, told = parallel.reset(seed=1)
    assert parallel.agents == ["T1", "T2", "T3"] == list(told)
    left = []
    while parallel.agents:
        _, _, finished, cut_off, told = parallel.step({})
        left += [agent for agent, gone in finished.items() if gone]
        assert not any(cut_off.values())
        assert set(told["T3"]) == {"time_s", "violations", "cut_mps", "shield_s"}
    assert left == ["T1", "T2", "T3"]
    with pytest.raises(KeyError):
        parallel.step({"T9": np.zeros(2, dtype=np.float32)})


def test_processes_of_their_own_run_episodes_side_by_side() -> None:
    kankaku.register_environments()
    made = gymnasium.make_vec(
        LINE_ID, num_envs=2, vectorization_mode="async", scenario="sakai_case1", step_s=0.1
    )
    alone = LineEnvironment("sakai_case1", step_s=0.1)
    try:
        seen, _ = made.reset(seed=5)
        stepped = made.step(made.action_space.sample() * 0.0)
    finally:
        made.close()
    assert seen.shape == (2, 2, len(FEATURES))
    np.testing.assert_array_equal(seen[0], alone.reset(seed=5)[0])
    np.testing.assert_array_equal(stepped[0][0], alone.step(np.zeros((2, 2), dtype=np.float32))[0])


@pytest.mark.parametrize(
    ("choices", "told"),
    [
        ({"actions": ("fly",)}, "actions: fly; allowed: some of ceiling, target, hold"),
        ({"actions": ()}, "actions: none"),
        ({"rewards": {"joy": 1.0}}, "rewards: 'joy'; allowed: delay, stops"),
        ({"rewards": {"delay": float("nan")}}, "rewards: delay: nan; allowed: a finite number"),
    ],
)
def test_choices_that_are_none_are_refused(choices: dict[str, Any], told: str) -> None:
    with pytest.raises(KankakuError, match=told):
        LineEnvironment(LINE, **choices)


def test_actions_that_are_no_numbers_are_refused_and_others_taken_to_the_range() -> None:
    environment = line_environment()
    environment.reset(seed=1)
    for wrong in (np.full((3, 2), np.nan), np.zeros((2, 2))):
        with pytest.raises(KankakuError, match=r"action: .*allowed: numbers of shape"):
            environment.step(wrong.astype(np.float32))
    wild = np.full((3, 2), np.inf, dtype=np.float32)
    wild[0] = -np.inf
    over = False
    while not over:
        _, _, finished, cut_off, told = environment.step(wild)
        over = finished or cut_off
    assert told["violations"] == 0


def test_a_missing_package_is_told_with_what_brings_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kankaku.live.environments.find_spec", lambda _: None)
    monkeypatch.delitem(__import__("sys").modules, "gymnasium")
    with pytest.raises(MissingExtraError, match=r"pip install 'kankaku\[env\]'"):
        kankaku.register_environments()


def test_the_guide_tells_every_column_and_indicator_as_it_is() -> None:
    guide = (Path(__file__).parents[2] / "docs" / "guide" / "live.md").read_text("utf-8")
    for feature in FEATURES:
        least, most = f"{feature.least:g}", f"{feature.most:,.0f}"
        row = (f"`{feature.name}`", feature.unit, least, most, feature.meaning)
        assert f"| {' | '.join(row)} |" in guide
    for name, indicator in INDICATORS.items():
        assert f"| `{name}` | {indicator.unit} | {indicator.meaning} |" in guide
    for name in ACTIONS:
        assert f"| `{name}` |" in guide
