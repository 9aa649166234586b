"""
Relative braking: up to where the leader's rear comes to a stand if it brakes its hardest.

The method of Takaoka et al. 1991, section 2.3 (level C), for comparison with absolute braking
distances. It is *not* safe against a leader that stops shorter than its brakes can stop it,
such as one that derails or collides; that is what the method does not cover. A leader whose
emergency brake is stronger than the one assumed is refused: behind it the authority ends at its
rear, taken as standing.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kankaku.controllers.ceiling import LineCeiling, braked_to_mps, ceiling_ahead_mps, figures_of
from kankaku.controllers.options import require
from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.compiled import Plain, compiled, formula, naming, plain
from kankaku.railway.plan.brake_table import SPACING_M, BrakeTable, braking_v2_at
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

EXACT_M = 0.01
"""How exactly the place of a stand is found, on the near side. [m]"""
MOST_M = 2000.0
"""No train runs further than this while it brakes. [m]"""


@dataclass(frozen=True, slots=True)
class RelativeBrakingOptions:
    """Options of relative braking."""

    margin_m: float = 25.0
    """Safety margin between the end of authority and the leader's rear at a stand. [m]"""
    leader_brake_kmhps: float = 6.0
    """The hardest that a leader is assumed to brake. [km/h/s]"""

    def __post_init__(self) -> None:
        require("margin_m", self.margin_m, 0.0, 1000.0)
        require("leader_brake_kmhps", self.leader_brake_kmhps, 0.5, 20.0)


class LeadersAhead(NamedTuple):
    """How hard trains brake; arrays of shape (n_trains,)."""

    braking: BrakeTable
    accepted: BoolArray
    """Trains that cannot stop shorter than assumed."""
    harder_mps2: FloatArray
    """What they are assumed to brake harder than their service brakes. [m/s2]"""
    margin_m: float


class RelativeBraking:
    """A moving block that counts on the leader's braking distance."""

    separation = Separation.BRAKING
    delay_s = 0.0
    release_delay_s = 0.0
    idle_time_s = 0.0
    sighting_time_s = 0.0

    def __init__(self, world: World, options: RelativeBrakingOptions) -> None:
        self._world = world
        self.profile = world.driven_profile
        self._margin_m = options.margin_m
        self.promises = Promises(options.margin_m)
        self.ceiling = LineCeiling(world, world.profile)
        self._at_once = AtOnce(world.size)
        brake_mps2 = options.leader_brake_kmhps / 3.6
        self.accepted: BoolArray = world.of_type("emergency_brake_mps2") <= brake_mps2
        """Trains that cannot stop shorter than assumed. shape (n_trains,)"""
        harder_mps2 = brake_mps2 - world.of_type("service_brake_mps2")
        self._leaders = plain(
            LeadersAhead(world.braking, self.accepted, harder_mps2, options.margin_m)
        )
        self._always = np.zeros(world.size), np.full(world.size, NOTHING, dtype=np.intp)
        self._fields = self._leaders, plain(self.ceiling.figures)

    def initial(self) -> tuple[()]:
        """Return the memory before the first step: there is nothing to remember."""
        return ()

    def authorise(self, state: LineState, memory: tuple[()]) -> tuple[Authority, tuple[()]]:
        """Return the authority of every train."""
        told = self._untold(state)
        _protect(state.instant, self._fields, (), (), told)
        return authority_of(told, self._at_once.permission(told[0])), memory

    def steps(self, state: LineState, memory: tuple[()]) -> LayerSteps:
        """Return the compiled step."""
        return LayerSteps(_protect, self._fields, memory, self._untold(state), np.inf)

    def _untold(self, state: LineState) -> Plain:
        """Return the authority before any was told."""
        (delay_s, own_ceiling), eoa_by = self._always, state.granted_by.copy()
        eoa_m = state.granted_to_m - self._margin_m
        return eoa_m, np.zeros(self._world.size), delay_s, eoa_by, own_ceiling

    def resumed(self, memory: tuple[()], after: Plain) -> tuple[()]:
        """Return the memory after a bundle of steps."""
        del after
        return memory

    def eoa_behind_m(
        self,
        row: int,  # noqa: ARG002 - the same whatever the train and its call
        call: int,  # noqa: ARG002
        leader: int,
        leader_front_m: FloatArray,
        leader_speed_mps: FloatArray,
    ) -> FloatArray:
        """Return the end of authority of a train behind its leader."""
        stands_m = leader_front_m
        if self.accepted[leader]:
            stands_m = _stands_each_m(leader, leader_front_m, leader_speed_mps, self._leaders)
        eoas_m: FloatArray = stands_m - self._world.length_m[leader] - self._margin_m
        return eoas_m

    def permitted_mps(self, row: int, front_m: FloatArray, eoa_m: FloatArray) -> FloatArray:
        """Return the speed from which the service brake keeps an end of authority that stays."""
        braked_mps = braked_to_mps(self._world, row, (front_m, eoa_m))
        return np.minimum(braked_mps, self.ceiling.at_mps(row, front_m))


@naming
def _leaders(fields: Plain) -> LeadersAhead:
    braking, accepted, harder_mps2, margin_m = fields
    return LeadersAhead(BrakeTable(*braking), accepted, harder_mps2, margin_m)


@formula
def _stands_m(train: int, front_m: float, speed_mps: float, leaders: LeadersAhead) -> float:
    """Return where a front comes to a stand if its train brakes as hard as assumed."""
    if speed_mps <= 0.0:
        return front_m
    braking, harder_mps2 = leaders.braking, leaders.harder_mps2[train]
    wanted = braking_v2_at(braking, train, front_m) + speed_mps * speed_mps
    # The square rises with the distance: step on by metres that double, then halve them.
    low_m, high_m = 0.0, SPACING_M
    while (
        braking_v2_at(braking, train, front_m + high_m) + 2.0 * harder_mps2 * high_m < wanted
        and high_m < MOST_M
    ):
        low_m, high_m = high_m, 2.0 * high_m
    while high_m - low_m > EXACT_M:
        middle_m = 0.5 * (low_m + high_m)
        there = braking_v2_at(braking, train, front_m + middle_m)
        if there + 2.0 * harder_mps2 * middle_m < wanted:
            low_m = middle_m
        else:
            high_m = middle_m
    return front_m + low_m


@compiled
def _stands_each_m(
    train: int, front_m: FloatArray, speed_mps: FloatArray, fields: Plain
) -> FloatArray:
    leaders, stands_m = _leaders(fields), np.empty_like(front_m)
    for place in range(front_m.size):
        stands_m[place] = _stands_m(train, front_m[place], speed_mps[place], leaders)
    return stands_m


@formula
def _protect(instant: Plain, fields: Plain, _memory: Plain, _after: Plain, told: Plain) -> None:
    """Write ends of authority, ceilings, and what is behind the ends."""
    _, whereabouts, _, lasting = instant
    trains, known = Whereabouts(*whereabouts), Lasting(*lasting)
    leaders, line_ceiling = _leaders(fields[0]), figures_of(fields[1])
    eoa_m, ceiling_mps, _, eoa_by, _ = told
    front_m, speed_mps = trains.front_m, trains.speed_mps
    for train in trains.rows:
        ceiling_mps[train] = ceiling_ahead_mps(
            line_ceiling, train, front_m[train], speed_mps[train]
        )
        eoa_m[train] = known.granted_to_m[train] - leaders.margin_m
        eoa_by[train] = known.granted_by[train]
        if not known.follows[train]:
            continue
        leader = known.leader[train]
        rear_m = trains.tail_m[leader]
        if leaders.accepted[leader] and trains.present[leader]:
            stands_m = _stands_m(leader, front_m[leader], speed_mps[leader], leaders)
            rear_m += stands_m - front_m[leader]
        if rear_m - leaders.margin_m <= eoa_m[train]:
            eoa_m[train], eoa_by[train] = rear_m - leaders.margin_m, leader
