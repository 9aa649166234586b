"""A line as an environment of Gymnasium: one agent controls all trains."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from kankaku.asking import SEED_MAX
from kankaku.live.agent_link import AgentLink


class LineEnvironment(gymnasium.Env[Any, Any]):
    """
    One agent, which is the line.

    It sees a row of :data:`~kankaku.live.agent_spaces.FEATURES` for every train, and acts with a
    row for every train. The protection of the controller is a shield: actions only lower.

    Parameters
    ----------
    scenario, choices
        As :class:`~kankaku.live.agent_link.AgentLink` takes them.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 - as the class above has it

    observation_space: Box
    action_space: Box

    def __init__(self, scenario: Any = "rush_hour", **choices: Any) -> None:  # noqa: ANN401 - as the link takes them
        self._link = AgentLink(scenario, **choices)
        self.observation_space = Box(self._link.least, self._link.most, dtype=np.float32)
        highest = self._link.highest.astype(np.float32)
        self.action_space = Box(np.zeros_like(highest), highest, dtype=np.float32)

    @property
    def trains(self) -> tuple[str, ...]:
        """Names of the trains, in the order of rows."""
        return self._link.trains

    @property
    def link(self) -> AgentLink:
        """The simulation below, for its record when an episode is over."""
        return self._link

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """
        Begin an episode.

        Parameters
        ----------
        seed
            Seed of the dwell delays, and of those of the episodes that follow it without one.
        options
            Not used.

        Returns
        -------
        tuple[NDArray[np.float32], dict[str, Any]]
            What is seen, shape (n_trains, n_features), and what is told beside it.
        """
        del options
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(SEED_MAX)) if seed is None else seed
        seen, _ = self._link.begin(drawn)
        return seen, {**self._link.told(), "seed": drawn}

    def step(
        self, action: NDArray[Any]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """
        Act upon the line until the next decision.

        Parameters
        ----------
        action
            For every train. shape (n_trains, n_actions)

        Returns
        -------
        tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]
            What is seen; the sum of the rewards of all trains; every train has left; the run is
            over for another reason; what is told beside it.

        Raises
        ------
        KankakuError
            If the action has another shape, or something in it is no number.
        """
        seen, reward, view = self._link.act(np.asarray(action, dtype=np.float64))
        over = self._link.simulation.over
        finished = over and not view.present.any()
        return seen, float(reward.sum()), finished, over and not finished, self._link.told()

    def close(self) -> None:
        """End the engine."""
        self._link.simulation.close()
