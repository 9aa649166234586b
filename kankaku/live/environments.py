"""The door to the environments; what they need is looked for only when somebody asks."""

import sys
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from kankaku.railway.errors import KankakuError

if TYPE_CHECKING:
    from kankaku.live.train_environment import TrainEnvironment

LINE_ID = "Kankaku/Line-v0"
"""What ``gymnasium.make`` calls the environment with one agent."""


class MissingExtraError(KankakuError):
    """A package that an extra of Kankaku brings, and that is not installed."""


def register_environments() -> None:
    """
    Make ``Kankaku/Line-v0`` known to ``gymnasium.make``.

    Whoever imports Gymnasium first and Kankaku then need not call this.

    Raises
    ------
    MissingExtraError
        If Gymnasium is not installed.
    """
    _refuse_without("gymnasium")
    import gymnasium  # noqa: PLC0415 - an extra

    if LINE_ID not in gymnasium.registry:
        entry = "kankaku.live.line_environment:LineEnvironment"
        gymnasium.register(LINE_ID, entry)


def parallel_env(scenario: Any = "rush_hour", **choices: Any) -> "TrainEnvironment":  # noqa: ANN401 - as the link takes them
    """
    Return a PettingZoo parallel environment with an agent for every train.

    Parameters
    ----------
    scenario
        A scenario, its folder, or the name of a shipped one.
    choices
        As :class:`~kankaku.live.agent_link.AgentLink` takes them: ``controller``, ``interval_s``,
        ``step_s``, ``engine``, ``actions`` and ``rewards``.

    Returns
    -------
    TrainEnvironment
        Reset it first.

    Raises
    ------
    MissingExtraError
        If PettingZoo is not installed.
    KankakuError
        If a choice cannot be used.
    """
    _refuse_without("gymnasium", "pettingzoo")
    from kankaku.live.train_environment import TrainEnvironment  # noqa: PLC0415 - an extra

    return TrainEnvironment(scenario, **choices)


def _refuse_without(*packages: str) -> None:
    for package in packages:
        if package not in sys.modules and find_spec(package) is None:
            problem, allowed = "is not installed", "after pip install 'kankaku[env]'"
            raise MissingExtraError(package, problem, allowed)
