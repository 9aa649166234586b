"""A line as a parallel environment of PettingZoo: every train is an agent."""

from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from kankaku.asking import SEED_MAX
from kankaku.live.agent_link import AgentLink
from kankaku.live.line_view import LineView

if TYPE_CHECKING:
    from kankaku.railway.arrays import FloatArray

Seen = NDArray[np.float32]


class TrainEnvironment(ParallelEnv):  # type: ignore[misc]
    """
    An agent for every train, from the first decision until it has left the line.

    Each sees :data:`~kankaku.live.agent_spaces.FEATURES` of its own train and acts upon that; an
    agent without an action asks for nothing. The protection of the controller is a shield.

    Parameters
    ----------
    scenario, choices
        As :class:`~kankaku.live.agent_link.AgentLink` takes them.
    """

    metadata = {"render_modes": [], "name": "kankaku_trains_v0"}  # noqa: RUF012 - as above

    def __init__(self, scenario: Any = "rush_hour", **choices: Any) -> None:  # noqa: ANN401 - as the link takes them
        self._link = link = AgentLink(scenario, **choices)
        self.possible_agents = list(link.trains)
        self.agents: list[str] = []
        self._row_of = {train: row for row, train in enumerate(link.trains)}
        highest = link.highest.astype(np.float32)
        self.observation_spaces = {
            train: Box(link.least[row], link.most[row], dtype=np.float32)
            for train, row in self._row_of.items()
        }
        self.action_spaces = {
            train: Box(np.zeros_like(highest[row]), highest[row], dtype=np.float32)
            for train, row in self._row_of.items()
        }
        self._random = np.random.default_rng()
        self._entered = np.zeros(len(link.trains), dtype=np.bool_)

    @property
    def link(self) -> AgentLink:
        """The simulation below, for its record when an episode is over."""
        return self._link

    def observation_space(self, agent: str) -> Box:
        """
        Return what an agent may see.

        Parameters
        ----------
        agent
            The train.

        Returns
        -------
        Box
            Always the same object.
        """
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Box:
        """
        Return what an agent may do.

        Parameters
        ----------
        agent
            The train.

        Returns
        -------
        Box
            Always the same object.
        """
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Seen], dict[str, dict[str, Any]]]:
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
        tuple[dict[str, Seen], dict[str, dict[str, Any]]]
            What each agent sees, and what it is told beside it.
        """
        del options
        if seed is not None:
            self._random = np.random.default_rng(seed)
        drawn = int(self._random.integers(SEED_MAX)) if seed is None else seed
        seen, view = self._link.begin(drawn)
        self.agents = self.possible_agents[:]
        self._entered = view.present.copy()
        return self._by_agent(seen), self._told()

    def step(
        self, actions: dict[str, Seen]
    ) -> tuple[
        dict[str, Seen],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """
        Act upon the line until the next decision.

        Parameters
        ----------
        actions
            By agent. shape (n_actions,) each

        Returns
        -------
        tuple
            By agent: what it sees, its reward, whether it has left the line, whether the run is
            over for another reason, and what it is told beside that.

        Raises
        ------
        KeyError
            If an agent is no train.
        KankakuError
            If an action has another shape, or something in it is no number.
        """
        table: FloatArray = self._link.highest.copy()
        if "hold" in self._link.actions:
            table[:, self._link.actions.index("hold")] = 0.0
        for agent, action in actions.items():
            table[self._row_of[agent]] = action
        seen, reward, view = self._link.act(table)
        left, over = self._left(view), self._link.simulation.over
        rows = [(agent, self._row_of[agent]) for agent in self.agents]
        found = (
            self._by_agent(seen),
            {agent: float(reward[row]) for agent, row in rows},
            {agent: bool(left[row]) for agent, row in rows},
            {agent: bool(over and not left[row]) for agent, row in rows},
            self._told(),
        )
        self.agents = [] if over else [agent for agent, row in rows if not left[row]]
        return found

    def close(self) -> None:
        """End the engine."""
        self._link.simulation.close()

    def _left(self, view: LineView) -> NDArray[np.bool_]:
        """Return who has been on the line and is there no more."""
        self._entered |= view.present | (view.next_call > 0)
        return self._entered & ~view.present

    def _by_agent(self, seen: Seen) -> dict[str, Seen]:
        return {agent: seen[self._row_of[agent]] for agent in self.agents}

    def _told(self) -> dict[str, dict[str, Any]]:
        told = self._link.told()
        cut_mps, shield_s = told["cut_mps"].tolist(), told["shield_s"].tolist()
        rest = {name: told[name] for name in ("time_s", "violations")}
        found = {}
        for agent in self.agents:
            row = self._row_of[agent]
            found[agent] = {**rest, "cut_mps": cut_mps[row], "shield_s": shield_s[row]}
        return found
