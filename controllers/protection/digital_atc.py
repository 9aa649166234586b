"""
Digital ATC: one brake pattern, worked out on board, to a stop point over fixed track circuits.

The track tells a train by a telegram through the rails where it has to stop at last: before the
first track circuit that is not free. The train knows where it is and how it brakes, and works
out one continuous pattern to that point; where it would run faster, its brake is applied. There
is no staircase, and the time until the brake takes effect is paid once (Matsumoto et al. 2002).

References
----------
.. [1] Matsumoto, Mizukami, Kawata, Ichihara, Nagatsugu, *Automatic Train Control With On-board
   Computers*, WIT Transactions on the Built Environment 61, 2002, doi:10.2495/CR020101.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kankaku.controllers.ceiling import (
    LineCeiling,
    braked_to_mps,
    ceiling_ahead_mps,
    figures_of,
)
from kankaku.controllers.options import require
from kankaku.controllers.protection.brake_pattern import brake_pattern_mps, pattern_v2_m2ps2
from kankaku.controllers.protection.fixed_block import detection_on
from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled, formula, naming, plain
from kankaku.railway.motion.kinematics import next_speed_mps
from kankaku.railway.plan.brake_table import BrakeTable, braking_loss_mps
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import Lasting, LayerSteps
from kankaku.railway.step.control import Separation
from kankaku.railway.step.promises import Promises
from kankaku.railway.step.state import (
    NOTHING,
    AtOnce,
    Authority,
    LineState,
    Whereabouts,
    authority_of,
)
from kankaku.railway.wayside.detection import Sight, look, plain_sight, sight_of


@dataclass(frozen=True, slots=True)
class DigitalAtcOptions:
    """Options of the digital ATC."""

    pattern_brake_percent: float = 90.0
    """Deceleration of the pattern, of the service brake. [%]"""
    idle_time_s: float = 2.0
    """From exceeding the pattern until the brake takes effect. [s]"""
    overlap_m: float = 25.0
    """Kept free before an occupied circuit. [m]"""

    def __post_init__(self) -> None:
        require("pattern_brake_percent", self.pattern_brake_percent, 10.0, 100.0)
        require("idle_time_s", self.idle_time_s, 0.0, 10.0)
        require("overlap_m", self.overlap_m, 0.0, 1000.0)


class Pattern(NamedTuple):
    """What the pattern follows from; it stays for a whole run."""

    braking: BrakeTable
    share: float
    """Deceleration of the pattern over the service brake. [-]"""
    idle_time_s: float
    overlap_m: float
    step_s: float
    far_m: float
    """Where nothing ends the way. [m]"""


class DigitalAtc:
    """One brake pattern over fixed circuits, worked out on board."""

    separation = Separation.CIRCUITS
    sighting_time_s = 0.0
    idle_time_s = 0.0
    """The pattern has the idle time in it. [s]"""

    def __init__(self, world: World, options: DigitalAtcOptions) -> None:
        self._detection = detection_on(world)
        self._world = world
        self._overlap_m = options.overlap_m
        self.promises = Promises(options.overlap_m)
        self.profile = world.driven_profile
        self.delay_s = 0.0
        self.release_delay_s = world.line.release_delay_s
        self._ceiling = LineCeiling(world, world.profile)
        self._at_once = AtOnce(world.size)
        share = options.pattern_brake_percent / 100.0
        figures = options.idle_time_s, options.overlap_m, world.step_s, world.far_m
        self._pattern = plain(Pattern(world.braking, share, *figures))
        ceiling = plain(self._ceiling.figures)
        self._fields = self._detection.fields, self._pattern, ceiling, np.zeros(world.size)

    def initial(self) -> Sight:
        """Return the memory before the first step: nothing has been looked at."""
        return self._detection.blind()

    def authorise(self, state: LineState, memory: Sight) -> tuple[Authority, Sight]:
        """Return the authority of every train."""
        sight = self._detection.look_ahead(state, memory)
        told = self._untold()
        danger = sight.danger_m, sight.danger_by
        _authorise(state.whereabouts, danger, self._fields[1:3], told)
        return authority_of(told, self._at_once.permission(told[0])), sight

    def _untold(self) -> Plain:
        """Return the authority before any was told."""
        size, far_m = self._world.size, self._world.far_m
        nothing = np.full((2, size), NOTHING, dtype=np.intp)
        return np.full(size, far_m), np.zeros(size), self._fields[-1], nothing[0], nothing[1]

    def steps(self, state: LineState, memory: Sight) -> LayerSteps:
        """Return the compiled step."""
        del state
        return LayerSteps(_protect, self._fields, plain_sight(memory), self._untold(), np.inf)

    def resumed(self, memory: Sight, after: Plain) -> Sight:
        """Return the memory after a bundle of steps."""
        del memory
        return sight_of(after)

    def eoa_behind_m(
        self,
        row: int,
        call: int,  # noqa: ARG002 - the same whatever the call
        leader: int,
        leader_front_m: FloatArray,
        leader_speed_mps: FloatArray,  # noqa: ARG002 - the leader is taken as standing
    ) -> FloatArray:
        """Return the end of authority of a train behind its leader."""
        tail_m = leader_front_m - self._world.length_m[leader]
        detection = self._detection
        return detection.boundary_m(row, detection.circuits, tail_m) - self._overlap_m

    def permitted_mps(self, row: int, front_m: FloatArray, eoa_m: FloatArray) -> FloatArray:
        """Return the pattern of a train before an end of authority that stays."""
        stop_m = np.minimum(eoa_m, self._world.far_m)
        patterns_mps = _patterns_mps(row, front_m, stop_m, self._pattern)
        # A train with a safety factor of its own brakes earlier than the pattern asks for.
        kept_mps = braked_to_mps(self._world, row, (front_m, stop_m))
        return np.minimum(np.minimum(patterns_mps, kept_mps), self._ceiling.at_mps(row, front_m))


@naming
def _pattern_of(fields: Plain) -> Pattern:
    braking, share, idle_time_s, overlap_m, step_s, far_m = fields
    return Pattern(BrakeTable(*braking), share, idle_time_s, overlap_m, step_s, far_m)


@formula
def _followed_mps(
    train: int, front_m: float, speed_mps: float, stop_m: float, pattern: Pattern
) -> float:
    """Return the greatest speed at the end of the step that is on the pattern there."""
    if front_m >= stop_m:
        return 0.0
    braking, share = pattern.braking, pattern.share
    brake_mps2 = braking.service_mps2[train]
    w = pattern_v2_m2ps2(braking, train, front_m, stop_m, share)
    loss = braking_loss_mps(braking, train, front_m, speed_mps, pattern.step_s)
    softer = loss - (1.0 - share) * brake_mps2 * pattern.step_s
    return float(next_speed_mps(speed_mps, w, softer, share * brake_mps2 * pattern.idle_time_s))


@formula
def _authorise(
    whereabouts: Plain,
    danger: tuple[FloatArray, IntArray],
    fields: tuple[Plain, Plain],
    told: Plain,
) -> None:
    """Write ends and ceilings with what is behind them."""
    trains, line_ceiling = Whereabouts(*whereabouts), figures_of(fields[1])
    pattern, (danger_m, danger_by) = _pattern_of(fields[0]), danger
    eoa_m, ceiling_mps, _, eoa_by, ceiling_by = told
    for train in trains.rows:
        front_m, speed_mps = trains.front_m[train], trains.speed_mps[train]
        ceiling_mps[train] = ceiling_ahead_mps(line_ceiling, train, front_m, speed_mps)
        eoa_m[train], eoa_by[train], ceiling_by[train] = pattern.far_m, NOTHING, NOTHING
        if danger_m[train] >= pattern.far_m:
            continue
        # A train that stands closer to an occupied circuit than the overlap stays there.
        stop_m = max(danger_m[train] - pattern.overlap_m, front_m)
        eoa_m[train], eoa_by[train] = stop_m, danger_by[train]
        followed = _followed_mps(train, front_m, speed_mps, stop_m, pattern)
        if followed < ceiling_mps[train]:
            ceiling_mps[train], ceiling_by[train] = followed, danger_by[train]


@formula
def _protect(instant: Plain, fields: Plain, memory: Plain, after: Plain, told: Plain) -> None:
    now_s, whereabouts, _, lasting = instant
    (circuits, pattern, ceiling, _), known = fields, Lasting(*lasting)
    granted = known.granted_to_m, known.granted_by
    look(now_s, whereabouts, granted, circuits, (memory, after))
    _authorise(whereabouts, (after[3], after[4]), (pattern, ceiling), told)


@compiled
def _patterns_mps(train: int, front_m: FloatArray, stop_m: FloatArray, fields: Plain) -> FloatArray:
    pattern, patterns_mps = _pattern_of(fields), np.empty_like(front_m)
    brake = pattern.share, pattern.idle_time_s
    for place in range(front_m.size):
        patterns_mps[place] = brake_pattern_mps(
            pattern.braking, train, front_m[place], stop_m[place], brake
        )
    return patterns_mps
