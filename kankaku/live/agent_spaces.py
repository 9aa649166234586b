"""What agents see and do, with units and ranges, as plain arrays."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kankaku.live.line_advice import LineAdvice
from kankaku.live.line_view import LineView
from kankaku.railway.arrays import FloatArray
from kankaku.railway.errors import KankakuError
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NO_HOLD_S

FARTHEST_M = 10_000.0
"""What is farther ahead than this looks as far. [m]"""
LATEST_S = 3600.0
"""What is later, or further in the future, than this looks as late, or as far. [s]"""
LONGEST_HOLD_S = 120.0
"""An action holds a train for so long at most. [s]"""


class EnvError(KankakuError):
    """An environment that is made from, or acted upon with, what cannot be used."""


class Feature(NamedTuple):
    """What is seen of each train."""

    name: str
    unit: str
    least: float
    most: float
    meaning: str


FEATURES = (
    Feature("present", "-", 0.0, 1.0, "1 for a train on the line; else all but its delay is 0"),
    Feature("running", "-", 0.0, 1.0, "1 for a train that no stop holds"),
    Feature("speed_mps", "m/s", 0.0, 100.0, "speed"),
    Feature("permitted_mps", "m/s", 0.0, 100.0, "what protection permits, whatever is asked for"),
    Feature("room_m", "m", 0.0, FARTHEST_M, "from the front to the end of authority"),
    Feature("to_stop_m", "m", 0.0, FARTHEST_M, "from the front to the next stop position"),
    Feature("gone_m", "m", 0.0, 1e6, "from the origin of the service to the front"),
    Feature("delay_s", "s", -LATEST_S, LATEST_S, "how late the train is known to be"),
    Feature("until_arrival_s", "s", -LATEST_S, LATEST_S, "to the booked arrival at the next stop"),
    Feature("until_departure_s", "s", -LATEST_S, LATEST_S, "to the booked departure from there"),
    Feature("to_leader_m", "m", 0.0, FARTHEST_M, "from the front to that of the train ahead"),
    Feature("leader_mps", "m/s", 0.0, 100.0, "speed of the train ahead"),
)
"""The columns of an observation; whatever is out of its range looks like the range's end."""
_LEAST = np.array([feature.least for feature in FEATURES])
_MOST = np.array([feature.most for feature in FEATURES])

ACTIONS = ("ceiling", "target", "hold")
"""
What an agent may do.

A speed ceiling, kept by the service brake if need be, [m/s]; a target speed, come down to gently,
[m/s]; both from 0 to the top speed of the train, which asks for nothing. A hold: no stop of the
train ends before so much time, from now on, is over, [s], from 0 to :data:`LONGEST_HOLD_S`.
"""


def chosen_actions(actions: Sequence[str]) -> tuple[str, ...]:
    """
    Return which actions an agent has.

    Parameters
    ----------
    actions
        Of :data:`ACTIONS`, each once.

    Returns
    -------
    tuple[str, ...]
        In that order.

    Raises
    ------
    EnvError
        If there is none, or one that there is not, or one twice.
    """
    chosen, allowed = tuple(actions), f"some of {', '.join(ACTIONS)}, each once"
    if not chosen or not set(chosen) <= set(ACTIONS) or len(set(chosen)) < len(chosen):
        where, problem = "actions", f"{', '.join(map(str, chosen)) or 'none'}"
        raise EnvError(where, problem, allowed)
    return chosen


def highest_actions(world: World, actions: tuple[str, ...]) -> FloatArray:
    """
    Return the greatest action of every train; the least one is 0.

    Parameters
    ----------
    world
        The trains.
    actions
        From :func:`chosen_actions`.

    Returns
    -------
    FloatArray
        [m/s] or [s], shape (n_trains, n_actions)
    """
    top_mps = world.of_type("maximum_speed_mps")
    hold_s = np.full(world.size, LONGEST_HOLD_S)
    return np.stack([hold_s if name == "hold" else top_mps for name in actions], axis=1)


def observed(view: LineView) -> NDArray[np.float32]:
    """
    Return what agents see of the line.

    Parameters
    ----------
    view
        The line.

    Returns
    -------
    NDArray[np.float32]
        A row for each train, a column for each of :data:`FEATURES`. (n_trains, n_features)
    """
    front_m, leads = view.front_m, view.leader >= 0
    leader = np.where(leads, view.leader, 0)
    # On other tracks before points, chainages of the two are not of one way; it is a hint.
    apart_m = np.where(leads, front_m[leader] - front_m, FARTHEST_M)
    columns = (
        view.present,
        view.running,
        view.speed_mps,
        view.permitted_mps,
        view.eoa_m - front_m,
        view.next_stop_m - front_m,
        front_m - view.world.stop_m[:, 0],
        view.delay_s,
        view.booked_arrival_s - view.time_s,
        view.booked_departure_s - view.time_s,
        apart_m,
        np.where(leads, view.speed_mps[leader], 0.0),
    )
    table = np.stack(columns, axis=1).astype(np.float64)
    np.clip(table, _LEAST, _MOST, out=table)
    delay_s = table[:, 7].copy()
    table[~view.present] = 0.0
    table[:, 7] = delay_s
    return table.astype(np.float32)


def advice_of(
    table: FloatArray, actions: tuple[str, ...], highest: FloatArray, now_s: float
) -> LineAdvice:
    """
    Return what an action asks for.

    Parameters
    ----------
    table
        The action; what is out of range is taken to its end. shape (n_trains, n_actions)
    actions
        From :func:`chosen_actions`.
    highest
        From :func:`highest_actions`. shape (n_trains, n_actions)
    now_s
        The time of the decision. [s]

    Returns
    -------
    LineAdvice
        The top speed of a train asks for nothing, nor does a hold of 0.

    Raises
    ------
    EnvError
        If it has another shape, or something in it is no number.
    """
    if table.shape != highest.shape or np.isnan(table).any():
        where = "action"
        problem = f"has shape {table.shape}" if table.shape != highest.shape else "is no number"
        raise EnvError(where, problem, f"numbers of shape {highest.shape}")
    table = np.clip(table, 0.0, highest)
    found: dict[str, FloatArray] = {}
    for column, name in enumerate(actions):
        asked, most = table[:, column], highest[:, column]
        if name == "hold":
            found["hold_until_s"] = np.where(asked > 0.0, now_s + asked, NO_HOLD_S)
        else:
            # Spaces are of single precision, in which the top speed may be a little lower.
            free = asked >= most * (1.0 - 1e-6)
            found[f"{name}_mps"] = np.where(free, np.inf, asked)
    return LineAdvice(found.get("ceiling_mps"), found.get("target_mps"), found.get("hold_until_s"))
