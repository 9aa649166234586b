"""
ATD, automatic train deceleration: one braking curve over fixed blocks, as a fine staircase.

The same blocks and track circuits as under multi-step ATC, but a train is sent a pattern of
many fine steps that approximates one braking curve to its stop point, so that it brakes
once and pays the idle time once. There are two patterns: the *control pattern*, which an
on-board fuzzy controller follows smoothly, and above it the *emergency pattern*, which
applies the emergency brake until the train stands. Circuits within a block release the
train behind as soon as the leader's tail has left each of them (Takaoka et al. 1991,
section 3.1).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kankaku.controllers.ceiling import LineCeiling, ceiling_ahead_mps, figures_of
from kankaku.controllers.options import OptionError, require
from kankaku.controllers.protection.atd_patterns import (
    Patterns,
    control_mps,
    control_patterns_mps,
    emergency_mps,
    patterns_of,
    step_end_m,
)
from kankaku.controllers.protection.fixed_block import detection_on
from kankaku.controllers.protection.fuzzy import RuleBase, infer, rule_base
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, formula, plain
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

KMH_PER_MPS = 3.6
LEAST_AHEAD_S, LEAST_AHEAD_M = 0.5, 0.5
"""A step of the pattern that ends nearer is aimed at as if it ended there. [s], [m]"""


@dataclass(frozen=True, slots=True)
class AtdOptions:
    """Options of ATD; those of the fuzzy controller are its membership functions and rules."""

    step_m: float = 20.0
    """Length of a step of the patterns. [m]"""
    control_brake_percent: float = 90.0
    """Deceleration of the control pattern, of the service brake. [%]"""
    idle_time_s: float = 1.5
    """From a lower step until the brake takes effect. [s]"""
    emergency_idle_time_s: float = 1.0
    """From passing the emergency pattern until the emergency brake takes effect. [s]"""
    overlap_m: float = 25.0
    """Kept free before an occupied circuit. [m]"""
    lack_kmhps: tuple[float, ...] = (-2.0, -0.5, 0.0, 0.5, 2.0)
    """Peaks of "the brake is (much) too strong, right, (much) too weak". [km/h/s]"""
    need_kmhps: tuple[float, ...] = (0.0, 1.5, 3.0)
    """Peaks of "little, some, much deceleration is needed". [km/h/s]"""
    change_kmhps2: tuple[float, ...] = (
        *(-3.0, -2.0, -1.5),
        *(-1.0, -0.5, -0.5),
        *(0.0, 0.0, 0.0),
        *(0.0, 0.5, 1.0),
        *(0.5, 2.0, 3.0),
    )
    """Change of deceleration by lack (rows) and need (columns). [km/h/s2]"""

    def __post_init__(self) -> None:
        require("overlap_m", self.overlap_m, 0.0, 1000.0)
        require("step_m", self.step_m, 1.0, 200.0)
        if self.step_m > self.overlap_m:
            # Else a train within its last step could not be told where the overlap begins.
            problem, allowed = f"step_m is {self.step_m:g}", f"up to overlap_m, {self.overlap_m:g}"
            raise OptionError(problem, allowed)
        require("control_brake_percent", self.control_brake_percent, 10.0, 100.0)
        require("idle_time_s", self.idle_time_s, 0.0, 10.0)
        require("emergency_idle_time_s", self.emergency_idle_time_s, 0.0, 10.0)
        for key in ("lack_kmhps", "need_kmhps"):
            peaks = getattr(self, key)
            if len(peaks) < 2 or any(np.diff(peaks) <= 0.0):
                problem = f"{key} is {', '.join(f'{peak:g}' for peak in peaks)}"
                raise OptionError(problem, "two rising numbers or more")
        rules = len(self.lack_kmhps) * len(self.need_kmhps)
        if len(self.change_kmhps2) != rules:
            problem = f"change_kmhps2 has {len(self.change_kmhps2)} rules"
            allowed = f"{rules}: one by each of lack_kmhps and need_kmhps"
            raise OptionError(problem, allowed)

    @property
    def rules(self) -> RuleBase:
        """The rule base in SI units."""
        lack, need, change = (
            tuple(value / KMH_PER_MPS for value in values)
            for values in (self.lack_kmhps, self.need_kmhps, self.change_kmhps2)
        )
        return rule_base(lack, need, change)


class Control(NamedTuple):
    """What the on-board controllers follow; it stays for a whole run."""

    rules: RuleBase
    step_s: float
    far_m: float
    """Where nothing ends the way. [m]"""


class Braked(NamedTuple):
    """What trackside and trains remember."""

    sight: Sight
    brake_mps2: FloatArray
    """Deceleration that the fuzzy controller commands. [m/s2], shape (n_trains,)"""
    tripped: BoolArray
    """The emergency pattern was passed, and the train has not come to a stand. (n_trains,)"""


class Atd:
    """One braking curve over fixed blocks, sent as a staircase and followed smoothly."""

    separation = Separation.CIRCUITS
    sighting_time_s = 0.0
    idle_time_s = 0.0
    """The patterns have the idle time in them. [s]"""

    def __init__(self, world: World, options: AtdOptions) -> None:
        self._detection = detection_on(world)
        self._world = world
        self._options = options
        self.promises = Promises(options.overlap_m)
        self.profile = world.driven_profile
        self.delay_s = 0.0
        self.release_delay_s = world.line.release_delay_s
        self._ceiling = LineCeiling(world, world.profile)
        self._at_once = AtOnce(world.size)
        self._patterns = plain(
            Patterns(
                world.braking,
                world.of_type("emergency_brake_mps2"),
                world.line.start_m,
                options.step_m,
                options.control_brake_percent / 100.0,
                options.idle_time_s,
                options.emergency_idle_time_s,
                options.overlap_m,
            )
        )
        followed = plain(Control(options.rules, world.step_s, world.far_m))
        ceiling = plain(self._ceiling.figures)
        known = self._detection.fields, self._patterns
        self._fields = *known, followed, ceiling, np.zeros(world.size)

    def initial(self) -> Braked:
        """Return the memory before the first step: no brake is applied."""
        size = self._world.size
        return Braked(self._detection.blind(), np.zeros(size), np.zeros(size, dtype=np.bool_))

    def authorise(self, state: LineState, memory: Braked) -> tuple[Authority, Braked]:
        """Return the authority of every train."""
        sight = self._detection.look_ahead(state, memory.sight)
        told, brakes = self._untold(), (memory.brake_mps2.copy(), memory.tripped.copy())
        danger = sight.danger_m, sight.danger_by
        _authorise(state.whereabouts, danger, brakes, self._fields[1:4], told)
        return authority_of(told, self._at_once.permission(told[0])), Braked(sight, *brakes)

    def _untold(self) -> Plain:
        """Return the authority before any was told."""
        size, far_m = self._world.size, self._world.far_m
        nothing = np.full((2, size), NOTHING, dtype=np.intp)
        return np.full(size, far_m), np.zeros(size), self._fields[-1], nothing[0], nothing[1]

    def steps(self, state: LineState, memory: Braked) -> LayerSteps:
        """Return the compiled step."""
        del state
        remembered = plain_sight(memory.sight), memory.brake_mps2, memory.tripped
        return LayerSteps(_protect, self._fields, remembered, self._untold(), np.inf)

    def resumed(self, memory: Braked, after: Plain) -> Braked:
        """Return the memory after a bundle of steps."""
        del memory
        return Braked(sight_of(after[0]), *after[1:])

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
        return detection.boundary_m(row, detection.circuits, tail_m) - self._options.overlap_m

    def permitted_mps(self, row: int, front_m: FloatArray, eoa_m: FloatArray) -> FloatArray:
        """Return the control pattern that a train is sent before an end of authority that stays."""
        stop_m = np.minimum(eoa_m, self._world.far_m)
        pattern_mps = control_patterns_mps(row, front_m, stop_m, self._patterns)
        return np.minimum(pattern_mps, self._ceiling.at_mps(row, front_m))


@formula
def _next_brake_mps2(
    brake_mps2: float,
    speeds_mps: tuple[float, float],
    ahead_m: float,
    strongest_mps2: float,
    control: Control,
) -> float:
    """Return the deceleration that the fuzzy controller commands next."""
    speed_mps, pattern_mps = speeds_mps
    way_m = max(ahead_m, speed_mps * LEAST_AHEAD_S, LEAST_AHEAD_M)
    need_mps2 = 0.5 * (speed_mps * speed_mps - pattern_mps * pattern_mps) / way_m
    change_mps3 = infer(control.rules, need_mps2 - brake_mps2, need_mps2)
    return min(max(brake_mps2 + control.step_s * change_mps3, 0.0), strongest_mps2)


@formula
def _followed_mps(
    train: int,
    speeds_mps: tuple[float, float],
    ahead_m: float,
    brake_mps2: FloatArray,
    strongest_mps2: float,
    control: Control,
) -> float:
    """Return the speed at the end of the step by the fuzzy controller, and write its brake."""
    speed_mps, pattern_mps = speeds_mps
    if speed_mps <= 0.0:
        brake_mps2[train] = 0.0
    else:
        brake_mps2[train] = _next_brake_mps2(
            brake_mps2[train], speeds_mps, ahead_m, strongest_mps2, control
        )
    if brake_mps2[train] > 0.0:
        return float(max(speed_mps - brake_mps2[train] * control.step_s, 0.0))
    return max(speed_mps, pattern_mps)


@formula
def _authorise(
    whereabouts: Plain,
    danger: tuple[FloatArray, IntArray],
    memory: tuple[FloatArray, BoolArray],
    fields: tuple[Plain, Plain, Plain],
    told: Plain,
) -> None:
    """Write ends and ceilings with what is behind them, and what trains remember."""
    pattern_fields, control_fields, ceiling_fields = fields
    trains, line_ceiling = Whereabouts(*whereabouts), figures_of(ceiling_fields)
    patterns, (rules, step_s, far_m) = patterns_of(pattern_fields), control_fields
    control = Control(RuleBase(*rules), step_s, far_m)
    (danger_m, danger_by), (brake_mps2, tripped) = danger, memory
    eoa_m, ceiling_mps, _, eoa_by, ceiling_by = told
    for train in trains.rows:
        front_m, speed = trains.front_m[train], trains.speed_mps[train]
        ceiling_mps[train] = ceiling_ahead_mps(line_ceiling, train, front_m, speed)
        eoa_m[train], eoa_by[train], ceiling_by[train] = far_m, NOTHING, NOTHING
        if danger_m[train] >= far_m:
            brake_mps2[train], tripped[train] = 0.0, False
            continue
        eoa_by[train] = danger_by[train]
        # A train that stands closer to an occupied circuit than the overlap stays there.
        stop_m = max(danger_m[train] - patterns.overlap_m, front_m)
        end_m = step_end_m(front_m, patterns)
        most = emergency_mps(train, end_m, danger_m[train], patterns)
        tripped[train] = speed > most or (tripped[train] and speed > 0.0)
        if tripped[train]:
            eoa_m[train] = front_m
            continue
        eoa_m[train] = stop_m
        speeds = speed, control_mps(train, end_m, stop_m, patterns)
        service = patterns.braking.service_mps2[train]
        followed = _followed_mps(train, speeds, end_m - front_m, brake_mps2, service, control)
        if followed < ceiling_mps[train]:
            ceiling_mps[train], ceiling_by[train] = followed, danger_by[train]


@formula
def _protect(instant: Plain, fields: Plain, memory: Plain, after: Plain, told: Plain) -> None:
    now_s, whereabouts, _, lasting = instant
    (circuits, patterns, control, ceiling, _), known = fields, Lasting(*lasting)
    granted, sight = (known.granted_to_m, known.granted_by), after[0]
    look(now_s, whereabouts, granted, circuits, (memory[0], sight))
    brakes = after[1], after[2]
    for train in range(after[1].size):
        after[1][train], after[2][train] = memory[1][train], memory[2][train]
    danger = sight[3], sight[4]
    _authorise(whereabouts, danger, brakes, (patterns, control, ceiling), told)
