"""
Training a policy
=================

A policy of two weights learns, in some ten seconds, when to slow down behind a leader. Then it
meets mornings that it never saw: what did it gain, and what did it lose?
"""

from dataclasses import replace

import gymnasium
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

import kankaku
from kankaku.analysis.figures.time_distance import time_distance_figure
from kankaku.analysis.results import stations_frame
from kankaku.analysis.tables.compare import half_width
from kankaku.live.agent_spaces import FEATURES
from kankaku.railway.plan.dwell import DwellDelays

# %%
# Where it learns
# ---------------
#
# ``branch`` is small: two branches, their trunk and twelve trains. Here three dwells of ten take
# 10 to 150 s too long, other ones with every seed. Every 20 s the agent gives each train a ceiling.
# A stop between stations costs it 1, and so does a minute of lateness.

kankaku.register_environments()
branch = replace(kankaku.load("branch"), dwell_delays=DwellDelays((0.0, 0.7, 1.0), (0, 10, 150)))
line = gymnasium.make(
    "Kankaku/Line-v0",
    scenario=branch,
    controller="moving_block+close_up",
    step_s=0.5,
    interval_s=20.0,
    actions=("ceiling",),
    rewards={"stops": 1.0, "delay": 1.0},
)
column = {feature.name: number for number, feature in enumerate(FEATURES)}
free_mps = line.action_space.high[:, 0]

# %%
# The policy
# ----------
#
# If a train's authority ends before its next stop, somebody is in the way. Then the train shall
# spend so many *seconds* on the room that it has, but not be slower than a *least* speed.
# All others may go as fast as they can.


def ceilings(seen, weights):
    """Return the action for all trains."""
    seconds, least_mps = weights
    room_m, to_stop_m = seen[:, column["room_m"]], seen[:, column["to_stop_m"]]
    behind = (seen[:, column["running"]] == 1.0) & (room_m < to_stop_m)
    wanted_mps = np.maximum(room_m / seconds, least_mps)
    return np.where(behind, np.minimum(wanted_mps, free_mps), free_mps)[:, None]


def play(weights, seed):
    """Play an episode; return its reward and what is told at its end."""
    seen, told = line.reset(seed=seed)
    total, over = 0.0, False
    while not over:
        seen, reward, finished, cut_off, told = line.step(ceilings(seen, weights))
        total, over = total + reward, finished or cut_off
    return total, told


# %%
# Protection stands below every action. So all weights may be tried: bad ones make trains late, and
# none makes them collide.
#
# Train it
# --------
#
# A cross-entropy search draws weights, keeps the best two, and draws the next ones around them.

TRAINED_ON, GENERATIONS, DRAWN, KEPT = (101, 102, 103), 4, 5, 2


def mean_reward(weights):
    """Return the mean reward of the mornings to train on."""
    return np.mean([play(weights, seed)[0] for seed in TRAINED_ON])


random = np.random.default_rng(1)
middle, spread = np.array([30.0, 8.0]), np.array([20.0, 5.0])
tried = []
for generation in range(GENERATIONS):
    drawn = np.clip(random.normal(middle, spread, (DRAWN, 2)), (1.0, 1.0), (120.0, 25.0))
    rewards = [mean_reward(weights) for weights in drawn]
    tried += zip(rewards, drawn, strict=True)
    best = drawn[np.argsort(rewards)[-KEPT:]]
    middle, spread = best.mean(axis=0), best.std(axis=0) + np.array([2.0, 0.5])
    print(f"generation {generation}: best {max(rewards):.2f}, mean {np.mean(rewards):.2f}")

NOTHING = (1e-3, 1.0)
reward, learnt = max(tried, key=lambda pair: pair[0])
print(f"learnt: {learnt[0]:.0f} s for the room ahead, at least {3.6 * learnt[1]:.0f} km/h")
print(f"reward {reward:.2f}; without a policy {mean_reward(NOTHING):.2f}")

# %%
# Better than nothing, it seems. But these are the mornings that the weights were chosen by.
#
# Try it
# ------
#
# Fifteen other mornings, each with and without the policy: the same seed, the same delays.

TRIED_ON = range(1, 16)


def figures(weights, seed):
    """Return what a morning is judged by, and its tables."""
    reward, told = play(weights, seed)
    run = line.unwrapped.link.simulation.tables()
    return {
        "reward [-]": reward,
        "stops between stations [-]": len(run.interstation_stops),
        "stop time [s]": run.interstation_stops.duration_s.sum(),
        "mean lateness of arrivals [s]": run.calls.arrival_delay_s.clip(lower=0.0).mean(),
        "net energy per train [kWh]": run.energy.net_kwh.mean(),
        "violations [-]": told["violations"],
    }, run


without, learned = (
    pd.DataFrame([figures(weights, seed)[0] for seed in TRIED_ON], index=TRIED_ON)
    for weights in (NOTHING, learnt)
)
change = learned - without
half = change.apply(lambda values: half_width(values.to_numpy()))
print(f"{'mean of a morning':32}{'without':>9}{'learnt':>9}{'change':>9}  95 % interval")
for name, mean in change.mean().items():
    means = f"{without[name].mean():9.2f}{learned[name].mean():9.2f}{mean:+9.2f}"
    print(f"{name:32}{means}  {mean - half[name]:+.2f} to {mean + half[name]:+.2f}")

# %%
figure = Figure(figsize=(8.5, 3.4), layout="constrained")
left, right = figure.subplots(1, 2)
seconds, least_mps = np.array([weights for _, weights in tried]).T
dots = left.scatter(seconds, 3.6 * least_mps, c=[reward for reward, _ in tried], s=45)
left.plot(learnt[0], 3.6 * learnt[1], "o", markersize=13, color="black", fillstyle="none")
left.set(xlabel="seconds for the room ahead", ylabel="least speed [km/h]", title="What was tried")
figure.colorbar(dots, label="reward of the mornings to train on")
right.axhline(0.0, color="grey", linewidth=0.8)
right.plot(change.index, change["reward [-]"], "o")
right.errorbar(
    17, change["reward [-]"].mean(), half["reward [-]"], fmt="s", capsize=4, label="mean, 95 %"
)
right.set(xlabel="seed", ylabel="reward gained by the policy", title="Mornings never seen")
legend = right.legend()

# %%
# The interval of the reward includes 0: what training had gained cannot be shown elsewhere. What
# can be shown is a trade. Stops became fewer and shorter, trains later, and energy more.
#
# Look
# ----
#
# The morning that had the most stops.

worst = without["stops between stations [-]"].idxmax()
runs = [
    replace(figures(weights, worst)[1], controller=name)
    for name, weights in (("without", NOTHING), ("learnt", learnt))
]
figure = time_distance_figure(runs, stations_frame(branch.line), title=f"Seed {worst}")

# %%
# What to change next
# -------------------
#
# - ``rewards={"stops": 3.0, "delay": 1.0}``: what does it learn if stops cost more?
# - ``TRAINED_ON = range(101, 121)``: more mornings, less luck, and a minute instead of seconds.
# - A third weight in ``ceilings``: ``leader_mps`` and ``delay_s`` are columns, too.
# - Another search, or a library of reinforcement learning: ``line`` is an environment of Gymnasium.
