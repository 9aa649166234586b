"""What both kinds of environment stand on: a simulation that takes actions."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kankaku.live.agent_rewards import DEFAULT_REWARDS, chosen_rewards, measures_of, rewards
from kankaku.live.agent_spaces import (
    FEATURES,
    advice_of,
    chosen_actions,
    highest_actions,
    observed,
)
from kankaku.live.line_view import LineView
from kankaku.live.simulation import DEFAULT_INTERVAL_S, Simulation
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.studies.opening import NO_SUMO

DEFAULT_ACTIONS = ("ceiling", "hold")


class AgentLink:
    """
    A simulation as agents see it.

    Parameters
    ----------
    scenario, controller, interval_s, step_s, engine
        As :class:`kankaku.Simulation` takes them; without SUMO by default.
    actions
        What agents may do, of :data:`~kankaku.live.agent_spaces.ACTIONS`.
    rewards
        Weights of indicators, of :data:`~kankaku.live.agent_rewards.INDICATORS`.
    """

    def __init__(
        self,
        scenario: str | Path | Scenario,
        controller: str | ControllerSpec = "moving_block+close_up",
        *,
        interval_s: float = DEFAULT_INTERVAL_S,
        step_s: float | None = None,
        engine: str = NO_SUMO,
        actions: Sequence[str] = DEFAULT_ACTIONS,
        rewards: Mapping[str, float] = DEFAULT_REWARDS,
    ) -> None:
        self.actions, self.weights = chosen_actions(actions), chosen_rewards(rewards)
        self.simulation = Simulation(
            scenario,
            controller,
            interval_s=interval_s,
            step_s=step_s,
            engine=engine,
            measures=measures_of(self.weights),
        )
        world = self.simulation.world
        self.trains = world.timetable.trains
        self.highest = highest_actions(world, self.actions)
        shape = len(self.trains), len(FEATURES)
        self.least: NDArray[np.float32] = np.broadcast_to(
            np.array([feature.least for feature in FEATURES], dtype=np.float32), shape
        )
        self.most: NDArray[np.float32] = np.broadcast_to(
            np.array([feature.most for feature in FEATURES], dtype=np.float32), shape
        )

    def begin(self, seed: int) -> tuple[NDArray[np.float32], LineView]:
        """
        Begin an episode.

        Parameters
        ----------
        seed
            Seed of the dwell delays.

        Returns
        -------
        tuple[NDArray[np.float32], LineView]
            What agents see, shape (n_trains, n_features), and the line.
        """
        view = self.simulation.reset(seed)
        return observed(view), view

    def act(self, table: FloatArray) -> tuple[NDArray[np.float32], FloatArray, LineView]:
        """
        Act upon the line until the next decision.

        Parameters
        ----------
        table
            The action of every train. shape (n_trains, n_actions)

        Returns
        -------
        tuple[NDArray[np.float32], FloatArray, LineView]
            What agents see, shape (n_trains, n_features), their rewards, shape (n_trains,), and
            the line.
        """
        before = self.simulation.state
        advice = advice_of(table, self.actions, self.highest, before.time_s)
        view = self.simulation.step(advice)
        report = self.simulation.report
        reward: FloatArray = np.zeros(len(self.trains))
        if report is not None:
            reward = rewards(self.weights, before, view, report)
        return observed(view), reward, view

    def told(self) -> dict[str, Any]:
        """
        Return what an environment tells beside what is seen.

        Returns
        -------
        dict[str, Any]
            The time, [s]; what protection cut off the last action, [m/s], and for how long it was
            why trains were slower, [s], shape (n_trains,); how many violations of safety are
            known, of the whole run when it is over.
        """
        report, nobody = self.simulation.report, np.zeros(len(self.trains))
        return {
            "time_s": self.simulation.state.time_s,
            "cut_mps": nobody if report is None else report.cut_mps,
            "shield_s": nobody if report is None else report.shield_s,
            "violations": self.simulation.violations,
        }
