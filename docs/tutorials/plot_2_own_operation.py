"""
An own operation
================

An operation says how a train uses its permission; it can only lower. This one slows a train down
while its leader stands, so that it may arrive when the way is free again instead of standing in
front of it.
"""

from dataclasses import dataclass

import numpy as np

import kankaku
from kankaku.railway.step.state import NO_REASON, Advice
from kankaku.testing import check_controller

# %%
# Write it
# --------
#
# Options are a frozen dataclass; units stand in their names.


@dataclass(frozen=True, slots=True)
class HoldBackOptions:
    """Options of holding back."""

    slow_kmh: float = 30.0
    """Speed while the leader stands. [km/h]"""


class HoldBack:
    """Slow while the leader stands."""

    reasons = ("hold_back",)
    """Why it lowers a speed; what it did then stands in the trajectory."""

    def __init__(self, world, options, foresight):
        self._slow_mps = options.slow_kmh / 3.6

    def initial(self):
        """Return the memory before the first step: none is needed."""

    def advise(self, state, authority, memory):
        """Return a ceiling for every train, why, and because of which train."""
        stands = state.speed_mps[state.leader] < 0.1
        waits = state.running & state.follows & stands
        ceiling_mps = np.where(waits, self._slow_mps, 1000.0)
        reason = np.where(waits, 0, NO_REASON)
        return Advice(ceiling_mps, reason, state.leader), memory


# %%
# Make it known
# -------------
#
# From here on it has a name, like the operations that come with Kankaku.

kankaku.register_operation("hold_back", HoldBack, HoldBackOptions, "slow while the leader stands")

# %%
# Run it
# ------
#
# Any operation runs over any protection: ``moving_block+hold_back`` is the moving block with
# ours. In the scenario ``control_map`` points fail for three and a half minutes, and trains queue
# in front of them.

runs = {
    name: kankaku.run_once("control_map", name)
    for name in ("close_up", "moving_block+hold_back", "moving_block+two_stage")
}
for name, run in runs.items():
    stops = run.interstation_stops
    last = run.calls.groupby("train").tail(1)
    print(
        f"{name:26} {len(stops)} stops between stations, {stops.duration_s.sum():6.1f} s; "
        f"mean delay at the end {last.arrival_delay_s.mean():6.1f} s; "
        f"violations {len(run.violations)}"
    )

# %%
# It stands less than ``close_up``, and pays with delay: it slows down for every leader that
# stands, however far ahead, and does not ask for how long. ``two_stage`` slows down only where it
# costs little. That is what an operation has to find out, and ``foresight`` and the booked times
# in ``world`` are there to help.
#
# Did it do what it should?
# -------------------------
#
# The trajectory tells its own word, and the train for which it was said.

own = runs["moving_block+hold_back"].trajectory
print(own[own.reason == "plan"].groupby(["train", "plan", "cause"]).size().rename("samples"))

# %%
# Is it right?
# ------------
#
# The contract asks what every shipped layer is asked. On the command line this is
# ``kankaku check-controller hold_back``, for an operation that has an entry point; see the guide.

for finding in check_controller("hold_back"):
    print(f"{finding.check:36} {finding.problem or 'holds'}")
