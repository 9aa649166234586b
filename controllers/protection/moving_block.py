"""
Moving block: every train may go up to its leader's rear, taken as standing.

The end of authority is the leader's tail (or the fouling point of a turnout that is not
granted) less a safety margin; the ceiling is the lowest line limit over the whole train,
the braking curves to lower limits ahead included.

With communication-based train control, safety buffers that grow with the distance from the
last balise surround every train, the front counts as further on by the delay of the radio,
and the platform section may be kept for one train at a time (Sakai et al. 2020, section 3.1).
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
from kankaku.controllers.options import OptionError, require
from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import Plain, compiled, count_up_to, formula, plain
from kankaku.railway.plan.buffers import Buffers, drifted_buffer_m, reaching_front_m
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import Lasting, LayerSteps
from kankaku.railway.step.control import Separation
from kankaku.railway.step.promises import Promises
from kankaku.railway.step.state import (
    NO_VERSION,
    NOTHING,
    AtOnce,
    Authority,
    LineState,
    Whereabouts,
    authority_of,
)

ENTERED_M = 1.0
"""A front this far in a platform section has entered it; one at its start may be off a bit. [m]"""


@dataclass(frozen=True, slots=True)
class MovingBlockOptions:
    """Options of the moving block; those of the buffers are off by default."""

    margin_m: float = 25.0
    """Safety margin between the end of authority and the obstacle. [m]"""
    position_error_percent: float = 0.0
    """Drift of the measured position over the distance from the last balise. [%]"""
    position_resolution_m: float = 0.0
    """Resolution of the measured position, at both ends of a train. [m]"""
    communication_delay_s: float = 0.0
    """Delay of the radio. [s]"""
    exclusive_platform: bool = False
    """Only one train at a time in a platform section, for trains that call there."""

    def __post_init__(self) -> None:
        require("margin_m", self.margin_m, 0.0, 1000.0)
        require("position_error_percent", self.position_error_percent, 0.0, 10.0)
        require("position_resolution_m", self.position_resolution_m, 0.0, 100.0)
        require("communication_delay_s", self.communication_delay_s, 0.0, 10.0)

    def buffers(self, world: World) -> Buffers:
        """
        Return the buffers on a line.

        Parameters
        ----------
        world
            The line.

        Returns
        -------
        Buffers
            In SI units.
        """
        return Buffers.on(
            world.line,
            self.position_error_percent / 100.0,
            self.communication_delay_s,
            self.position_resolution_m,
        )


class Spacing(NamedTuple):
    """How far before whatever is ahead an authority ends; it stays for a whole run."""

    margin_m: float
    error_ratio: float
    """Drift of the measured position. [-]"""
    resolution_m: float
    exclusive: bool
    """Platform sections are for one train at a time."""
    balise_m: FloatArray
    """Where positions are corrected. [m], shape (n_balises,)"""
    buffered_at_balise_m: FloatArray
    """See :attr:`kankaku.railway.plan.buffers.Buffers.buffered_at_balise_m`. [m], same shape"""


class Ahead(NamedTuple):
    """The platform section at every train's next call; it stays until calls change."""

    calls_version: int
    section_m: FloatArray
    """Start and end. [m], shape (2, n_trains)"""


class MovingBlock:
    """Moving block with a constant margin, buffers, and platform sections for one train."""

    separation = Separation.STANDING
    release_delay_s = 0.0
    idle_time_s = 0.0
    sighting_time_s = 0.0

    def __init__(self, world: World, options: MovingBlockOptions) -> None:
        buffers = options.buffers(world)
        if buffers.error_ratio and world.line.network:
            problem = "positions drift from balise to balise, which only a chain has in one row"
            raise OptionError(problem, "position_error_percent = 0")
        self.promises = Promises(options.margin_m, buffers, options.exclusive_platform)
        self._world = world
        enforced, self.profile = world.profile, world.driven_profile
        if not buffers.none:
            enforced, self.profile = world.tabulated(buffers), world.driven(buffers)
        self.delay_s = buffers.delay_s
        self._delays_s = np.full(world.size, buffers.delay_s)
        self._at_once = AtOnce(world.size)
        self._own_ceiling = np.full(world.size, NOTHING, dtype=np.intp)
        self.ceiling = LineCeiling(world, enforced)
        self._line_ceiling = plain(self.ceiling.figures)
        self._spacing = plain(
            Spacing(
                options.margin_m,
                buffers.error_ratio,
                buffers.resolution_m,
                options.exclusive_platform,
                buffers.balise_m,
                buffers.buffered_at_balise_m,
            )
        )

    def initial(self) -> Ahead:
        """Return the memory before the first step: nothing is known of any call."""
        return Ahead(NO_VERSION, np.zeros((2, 0)))

    def authorise(self, state: LineState, memory: Ahead) -> tuple[Authority, Ahead]:
        """Return the authority of every train."""
        if state.calls_version != memory.calls_version:
            rows = np.flatnonzero(state.present)
            section_m = np.zeros((2, self._world.size))
            section_m[:, rows] = self._world.platform_m[:, rows, state.next_call[rows]]
            memory = Ahead(state.calls_version, section_m)
        told = self._untold(state)
        _protect(state.instant, self._fields(memory), (), (), told)
        return authority_of(told, self._at_once.permission(told[0])), memory

    def _fields(self, memory: Ahead) -> Plain:
        return memory.section_m, self._spacing, self._line_ceiling

    def _untold(self, state: LineState) -> Plain:
        """Return the authority before any was told."""
        eoa_m, eoa_by = state.clear_to_m.copy(), state.granted_by.copy()
        return eoa_m, np.zeros(self._world.size), self._delays_s, eoa_by, self._own_ceiling

    def steps(self, state: LineState, memory: Ahead) -> LayerSteps:
        """Return the compiled step."""
        return LayerSteps(_protect, self._fields(memory), (), self._untold(state), np.inf)

    def resumed(self, memory: Ahead, after: Plain) -> Ahead:
        """Return the memory after a bundle of steps."""
        del after
        return memory

    def eoa_behind_m(
        self,
        row: int,
        call: int,
        leader: int,
        leader_front_m: FloatArray,
        leader_speed_mps: FloatArray,  # noqa: ARG002 - the leader is taken as standing
    ) -> FloatArray:
        """
        Return the end of authority that a train outside the platform will have.

        It counts on the balises before the end of authority, which the train will have passed.
        """
        start_m, end_m = self._world.platform_m[:, row, call]
        if call > 0 and self._world.stop_m[row, call - 1] > start_m + ENTERED_M:
            # Platforms overlap: at the stop before, the train has entered this section already.
            start_m = end_m
        length_m = self._world.length_m[leader]
        return _eoas_behind_m(leader_front_m, length_m, (start_m, end_m), self._spacing)

    def permitted_mps(self, row: int, front_m: FloatArray, eoa_m: FloatArray) -> FloatArray:
        """Return the speed from which the service brake keeps an end of authority that stays."""
        braked_mps = braked_to_mps(self._world, row, (front_m, eoa_m), self.delay_s)
        return np.minimum(braked_mps, self.ceiling.at_mps(row, front_m))


@formula
def _eoa_m(
    front_m: float,
    entered: bool,
    clear_to_m: float,
    leader_m: tuple[float, float],
    section_m: tuple[float, float],
    spacing: Spacing,
) -> tuple[float, bool]:
    """Return the end of authority behind an obstacle and a leader, and whether by the leader."""
    leader_tail_m, leader_front_m = leader_m
    start_m, end_m = section_m
    margin_m, ratio, resolution_m = spacing.margin_m, spacing.error_ratio, spacing.resolution_m
    exclusive, balise_m = spacing.exclusive, spacing.balise_m
    last = count_up_to(balise_m, front_m) - 1
    balise = max(count_up_to(balise_m, leader_front_m) - 1, 0)
    buffer_m = drifted_buffer_m(leader_front_m, balise_m[balise], ratio, resolution_m)
    rear_m = leader_tail_m - float(buffer_m)
    if exclusive and not entered and start_m < rear_m < end_m:
        rear_m = start_m
    place_m = min(rear_m, clear_to_m) - margin_m
    # Eq. (3) without the delay, which the drive counts. A balise corrects nothing before the
    # train has passed it.
    passed = min(count_up_to(spacing.buffered_at_balise_m, place_m), max(last, 0))
    eoa_m = float(reaching_front_m(place_m, balise_m[passed], ratio, resolution_m))
    return eoa_m, rear_m <= clear_to_m


@formula
def _protect(instant: Plain, fields: Plain, _memory: Plain, _after: Plain, told: Plain) -> None:
    """Write ends of authority, ceilings, and what is behind the ends."""
    _, whereabouts, clear_to_m, lasting = instant
    (section_m, spacing_fields, ceiling_fields), (eoa_m, ceiling_mps, _, eoa_by, _) = fields, told
    trains, known = Whereabouts(*whereabouts), Lasting(*lasting)
    spacing, line_ceiling = Spacing(*spacing_fields), figures_of(ceiling_fields)
    front_m, speed_mps = trains.front_m, trains.speed_mps
    for train in trains.rows:
        leader, leader_tail_m, leader_front_m = known.leader[train], np.inf, 0.0
        if known.follows[train]:
            leader_tail_m, leader_front_m = trains.tail_m[leader], front_m[leader]
        eoa_m[train], by_leader = _eoa_m(
            front_m[train],
            front_m[train] > section_m[0, train] + ENTERED_M,
            clear_to_m[train],
            (leader_tail_m, leader_front_m),
            (section_m[0, train], section_m[1, train]),
            spacing,
        )
        behind_leader = known.follows[train] and by_leader
        eoa_by[train] = leader if behind_leader else known.granted_by[train]
        ceiling_mps[train] = ceiling_ahead_mps(
            line_ceiling, train, front_m[train], speed_mps[train]
        )


@compiled
def _eoas_behind_m(
    leader_front_m: FloatArray,
    leader_length_m: float,
    section_m: tuple[float, float],
    spacing_fields: Plain,
) -> FloatArray:
    spacing, eoa_m = Spacing(*spacing_fields), np.empty_like(leader_front_m)
    for place in range(leader_front_m.size):
        leader_m = leader_front_m[place] - leader_length_m, leader_front_m[place]
        eoa_m[place] = _eoa_m(np.inf, False, np.inf, leader_m, section_m, spacing)[0]
    return eoa_m
