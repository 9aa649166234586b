"""
Multi-step ATC: every block shows one of a few speed codes by the free blocks ahead of it.

A train that runs faster than the code of its block brakes, after an idle time, until it is
a little below the code; then the brake is released, until the next block shows less. The
idle time and the braking that is no curve but a staircase are paid at every step down
(Takaoka et al. 1991, section 3.1).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kankaku.controllers.ceiling import LineCeiling, ceiling_ahead_mps, figures_of
from kankaku.controllers.options import OptionError, require
from kankaku.controllers.protection.code_doubts import never_shown
from kankaku.controllers.protection.code_table import Braking, code_table
from kankaku.controllers.protection.fixed_block import detection_on
from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled, formula, plain
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
from kankaku.railway.wayside.tiling import Tiling, place_of, place_of_front


@dataclass(frozen=True, slots=True)
class MultiStepAtcOptions:
    """Options of the multi-step ATC."""

    codes_kmh: tuple[float, ...] = (90.0, 75.0, 65.0, 45.0, 25.0, 0.0)
    """The codes, falling to 0. [km/h]"""
    idle_time_s: float = 2.0
    """From a lower code until the brake takes effect. [s]"""
    release_below_kmh: float = 3.0
    """The brake is released so far below the code. [km/h]"""
    overlap_m: float = 25.0
    """Kept free before an occupied block. [m]"""
    counted_blocks: float = 8.0
    """Free blocks that are counted; more of them show the same code. [-]"""
    sighting_time_s: float = 0.0
    """Of lineside signals: a driver acts on one so long before it. 0 with cab signals. [s]"""
    overlap_beyond_m: float = 0.0
    """Beyond the end of a block: it counts as occupied until that is free, too. [m]"""

    def __post_init__(self) -> None:
        codes = self.codes_kmh
        if len(codes) < 2 or codes[-1] != 0.0 or any(np.diff(codes) >= 0.0) or codes[0] > 400.0:
            problem = f"codes_kmh is {', '.join(f'{code:g}' for code in codes)}"
            raise OptionError(problem, "falling speeds up to 400, the last one 0")
        require("idle_time_s", self.idle_time_s, 0.0, 10.0)
        require("release_below_kmh", self.release_below_kmh, 0.0, 20.0)
        require("overlap_m", self.overlap_m, 0.0, 1000.0)
        require("sighting_time_s", self.sighting_time_s, 0.0, 60.0)
        require("overlap_beyond_m", self.overlap_beyond_m, 0.0, 1000.0)
        require("counted_blocks", self.counted_blocks, 1.0, 100.0)
        if self.counted_blocks % 1.0:
            problem = f"counted_blocks is {self.counted_blocks:g}"
            raise OptionError(problem, "a whole number")


OBEYED_MPS, TAKES_EFFECT_S, BRAKING, ACTS_S = 0, 1, 2, 3
ROUNDING_M = 1e-6
"""A circuit that begins where an overlap ends does not belong to it. [m]"""


class Signals(NamedTuple):
    """What codes follow from; it stays for a whole run."""

    route: IntArray
    """Route of each train. shape (n_trains,)"""
    type_index: IntArray
    """Type of each train. shape (n_trains,)"""
    code_mps: FloatArray
    """See :attr:`MultiStepAtc.code_mps`."""
    idle_time_s: float
    below_mps: float
    """The brake is released so far below the code. [m/s]"""
    overlap_m: float
    beyond_m: float
    """See :attr:`MultiStepAtcOptions.overlap_beyond_m`. [m]"""
    sighting_time_s: float
    step_s: float
    far_m: float
    """Where nothing ends the way. [m]"""


class Shown(NamedTuple):
    """What trackside and trains remember."""

    sight: Sight
    onboard: FloatArray
    """
    The code that each train obeys [m/s], when the brake for a lower one takes effect [s],
    infinite where none is shown, and 1 from then until the brake is released, else 0; and when its
    driver acts on a lineside signal ahead [s], infinite where none in sight is lower.

    Shape (4, n_trains).
    """


class MultiStepAtc:
    """Speed codes by free blocks, from a table that is worked out for the line."""

    separation = Separation.BLOCKS

    def __init__(self, world: World, options: MultiStepAtcOptions) -> None:
        self._detection = detection_on(world)
        self._world = world
        self._options = options
        self.promises = Promises(options.overlap_m, idle_time_s=options.idle_time_s)
        self.profile = world.driven_profile
        self.delay_s = 0.0
        self.release_delay_s = world.line.release_delay_s
        self.idle_time_s = options.idle_time_s
        self.sighting_time_s = options.sighting_time_s
        self._beyond_m = max(options.overlap_beyond_m - ROUNDING_M, 0.0)
        self._codes_mps = np.array(options.codes_kmh) / 3.6
        self._braking = Braking(options.idle_time_s, options.overlap_m, world.step_s)
        counted = int(options.counted_blocks)
        self.code_mps = code_table(world, self._detection, self._codes_mps, self._braking, counted)
        """Codes by train type, block of a route, and free blocks ahead. [m/s]"""
        self._ceiling = LineCeiling(world, world.profile)
        blocks, ceiling = plain(self._detection.blocks), plain(self._ceiling.figures)
        signals = plain(
            Signals(
                self._detection.route,
                world.type_index,
                self.code_mps,
                options.idle_time_s,
                options.release_below_kmh / 3.6,
                options.overlap_m,
                self._beyond_m,
                options.sighting_time_s,
                world.step_s,
                world.far_m,
            )
        )
        delay_s = np.zeros(world.size)
        self._fields = self._detection.fields, (signals, blocks), ceiling, delay_s
        self._at_once = AtOnce(world.size)

    def warnings(self) -> tuple[str, ...]:
        """
        Return what is doubtful in how codes and blocks fit each other.

        Returns
        -------
        tuple[str, ...]
            Sentences.
        """
        return never_shown(
            self._world, self._detection, self._codes_mps, self._braking, self.code_mps
        )

    def initial(self) -> Shown:
        """Return the memory before the first step: no train has been shown anything."""
        onboard = np.zeros((4, self._world.size))
        onboard[TAKES_EFFECT_S] = onboard[ACTS_S] = np.inf
        return Shown(self._detection.blind(), onboard)

    def authorise(self, state: LineState, memory: Shown) -> tuple[Authority, Shown]:
        """Return the authority of every train."""
        sight = self._detection.look_ahead(state, memory.sight)
        told, onboard = self._untold(), memory.onboard.copy()
        danger = sight.danger_m, sight.danger_by
        _authorise(state.time_s, state.whereabouts, danger, onboard, self._fields[1:3], told)
        return authority_of(told, self._at_once.permission(told[0])), Shown(sight, onboard)

    def _untold(self) -> Plain:
        """Return the authority before any was told."""
        size, far_m = self._world.size, self._world.far_m
        nothing = np.full((2, size), NOTHING, dtype=np.intp)
        return np.full(size, far_m), np.zeros(size), self._fields[-1], nothing[0], nothing[1]

    def steps(self, state: LineState, memory: Shown) -> LayerSteps:
        """Return the compiled step."""
        del state
        remembered = plain_sight(memory.sight), memory.onboard
        return LayerSteps(_protect, self._fields, remembered, self._untold(), np.inf)

    def resumed(self, memory: Shown, after: Plain) -> Shown:
        """Return the memory after a bundle of steps."""
        del memory
        return Shown(sight_of(after[0]), after[1])

    def eoa_behind_m(
        self,
        row: int,
        call: int,  # noqa: ARG002 - the same whatever the call
        leader: int,
        leader_front_m: FloatArray,
        leader_speed_mps: FloatArray,  # noqa: ARG002 - the leader is taken as standing
    ) -> FloatArray:
        """Return the end of authority of a train behind its leader."""
        detection = self._detection
        tail_m = leader_front_m - self._world.length_m[leader]
        occupied_m = detection.boundary_m(row, detection.circuits, tail_m)
        boundary_m = detection.boundary_m(row, detection.blocks, occupied_m - self._beyond_m)
        return boundary_m - self._options.overlap_m

    def permitted_mps(self, row: int, front_m: FloatArray, eoa_m: FloatArray) -> FloatArray:
        """Return the code that a train is shown before an end of authority that stays."""
        codes_mps = _codes_mps(
            front_m,
            eoa_m + self._options.overlap_m,
            int(self._detection.route[row]),
            self._detection.blocks,
            self.code_mps[self._world.type_index[row]],
        )
        return np.minimum(codes_mps, self._ceiling.at_mps(row, front_m))


@formula
def _code_mps(
    front_m: float, danger_m: float, route: int, blocks: Tiling, code_mps: FloatArray
) -> tuple[float, float, float]:
    """Return the code that a front is shown, the block's highest, and where the way ends."""
    here = place_of_front(blocks, route, front_m)
    last = blocks.first[route + 1]
    most = code_mps.shape[1] - 1
    if danger_m >= blocks.end_m[last - 1]:
        return code_mps[here, most], code_mps[here, most], np.inf
    occupied = place_of(blocks, route, danger_m)
    free = occupied - here - 1
    code = code_mps[here, min(free, most)] if free >= 0 else 0.0
    return code, code_mps[here, most], blocks.start_m[occupied]


@compiled
def _codes_mps(
    front_m: FloatArray, danger_m: FloatArray, route: int, blocks: Tiling, code_mps: FloatArray
) -> FloatArray:
    codes_mps = np.empty_like(front_m)
    for index in range(front_m.size):
        codes_mps[index] = _code_mps(front_m[index], danger_m[index], route, blocks, code_mps)[0]
    return codes_mps


@formula
def _authorise(
    time_s: float,
    whereabouts: Plain,
    danger: tuple[FloatArray, IntArray],
    onboard: FloatArray,
    fields: tuple[tuple[Plain, Plain], Plain],
    told: Plain,
) -> None:
    """Write ends and ceilings with what is behind them, and what trains remember."""
    (signal_fields, ceiling_fields), (danger_m, danger_by) = fields, danger
    trains, line_ceiling = Whereabouts(*whereabouts), figures_of(ceiling_fields)
    signals, blocks = Signals(*signal_fields[0]), Tiling(*signal_fields[1])
    eoa_m, ceiling_mps, _, eoa_by, ceiling_by = told
    for train in trains.rows:
        front_m, speed_mps = trains.front_m[train], trains.speed_mps[train]
        code_mps = signals.code_mps[signals.type_index[train]]
        kept_m = danger_m[train] - signals.beyond_m
        shown, highest, occupied_m = _code_mps(
            front_m, kept_m, signals.route[train], blocks, code_mps
        )
        # A train that stands closer to an occupied block than the overlap stays there.
        eoa_m[train] = min(max(occupied_m - signals.overlap_m, front_m), signals.far_m)
        eoa_by[train] = danger_by[train] if occupied_m < np.inf else NOTHING
        ceiling_by[train] = NOTHING
        bound_mps = _bound_mps(time_s, shown, speed_mps, onboard[:, train], signals)
        line_mps = ceiling_ahead_mps(line_ceiling, train, front_m, speed_mps)
        ceiling_mps[train] = min(line_mps, bound_mps)
        # The highest code of a block is the line's own, whatever is ahead.
        if bound_mps < line_mps and min(shown, onboard[OBEYED_MPS, train]) < highest:
            ceiling_by[train] = danger_by[train]
        if signals.sighting_time_s > 0.0:
            brake_mps2 = 0.0
            if occupied_m < np.inf:
                ways = signals.route[train], blocks, code_mps
                brake_mps2 = _ahead_mps2(front_m, speed_mps, occupied_m, ways, signals)
            acted_mps = _acted_mps(time_s, speed_mps, brake_mps2, onboard[:, train], signals)
            if acted_mps < ceiling_mps[train]:
                ceiling_mps[train], ceiling_by[train] = acted_mps, danger_by[train]


@formula
def _protect(instant: Plain, fields: Plain, memory: Plain, after: Plain, told: Plain) -> None:
    now_s, whereabouts, _, lasting = instant
    (circuits, signals, ceiling, _), known = fields, Lasting(*lasting)
    granted, sight = (known.granted_to_m, known.granted_by), after[0]
    look(now_s, whereabouts, granted, circuits, (memory[0], sight))
    before, onboard = memory[1], after[1]
    for kept in range(onboard.shape[0]):
        for train in range(onboard.shape[1]):
            onboard[kept, train] = before[kept, train]
    danger = sight[3], sight[4]
    _authorise(now_s, whereabouts, danger, onboard, (signals, ceiling), told)


@formula
def _ahead_mps2(
    front_m: float,
    speed_mps: float,
    occupied_m: float,
    ways: tuple[int, Tiling, FloatArray],
    signals: Signals,
) -> float:
    """Return the even brake that the signals in sight ask for: to their codes, in their blocks."""
    route, blocks, code_mps = ways
    here, occupied = place_of_front(blocks, route, front_m), place_of(blocks, route, occupied_m)
    seen_m, most = front_m + speed_mps * signals.sighting_time_s, code_mps.shape[1] - 1
    brake_mps2 = 0.0
    for place in range(here + 1, occupied):
        if blocks.start_m[place] > seen_m:
            break
        code = code_mps[place, min(occupied - place - 1, most)]
        if code < speed_mps and code < code_mps[place, most]:
            end_m = blocks.end_m[place] - (signals.overlap_m if code <= 0.0 else 0.0)
            way_m = max(end_m, blocks.start_m[place]) - front_m
            brake_mps2 = max(brake_mps2, 0.5 * (speed_mps * speed_mps - code * code) / way_m)
    return float(brake_mps2)


@formula
def _acted_mps(
    time_s: float, speed_mps: float, brake_mps2: float, onboard: FloatArray, signals: Signals
) -> float:
    """Return what a driver runs who sees signals ahead, and write since when he acts on them."""
    if brake_mps2 <= 0.0:
        onboard[ACTS_S] = np.inf
        return np.inf
    if onboard[ACTS_S] == np.inf:
        onboard[ACTS_S] = time_s + signals.idle_time_s
    if time_s < onboard[ACTS_S]:
        return np.inf
    return max(speed_mps - brake_mps2 * signals.step_s, 0.0)


@formula
def _bound_mps(
    time_s: float, shown: float, speed_mps: float, onboard: FloatArray, signals: Signals
) -> float:
    """Return what a train that is shown a code may run, and write what it remembers."""
    obeyed, takes_effect_s, braking, acts_s = onboard
    if shown >= obeyed:
        braking = braking if shown == obeyed else 0.0
        obeyed, takes_effect_s = shown, np.inf
    elif takes_effect_s == np.inf:
        # Who brakes already for what he has seen does not react once more.
        takes_effect_s = time_s if acts_s <= time_s else time_s + signals.idle_time_s
    if time_s >= takes_effect_s:
        obeyed, takes_effect_s = shown, np.inf
        braking = 1.0 if speed_mps > shown else 0.0
    released_mps = max(obeyed - signals.below_mps, 0.0)
    if speed_mps <= released_mps:
        braking = 0.0
    onboard[OBEYED_MPS] = obeyed
    onboard[TAKES_EFFECT_S] = takes_effect_s
    onboard[BRAKING] = braking
    return float(released_mps if braking > 0.0 else obeyed)
