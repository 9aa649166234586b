"""The drive: the next speed of every train within traction and braking."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled, plain
from kankaku.railway.motion.kinematics import next_speed_mps
from kankaku.railway.motion.traction_table import TractionTable, pulled_mps, traction_table
from kankaku.railway.plan.brake_table import (
    BrakeTable,
    braking_loss_mps,
    braking_v2_at,
    braking_v2_each,
)
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Bound, Command
from kankaku.railway.step.state import (
    NO_VERSION,
    NOTHING,
    Advice,
    Authority,
    LineState,
    Whereabouts,
)

N_BOUNDS = 6
# Plain numbers, as compiled functions want them.
TRACTION, CEILING, ADVICE = int(Bound.TRACTION), int(Bound.CEILING), int(Bound.ADVICE)
LIMIT, STOP, EMERGENCY = int(Bound.LIMIT), int(Bound.STOP), int(Bound.EMERGENCY)


class Abilities(NamedTuple):
    """What trains can do; it stays for a whole run."""

    braking: BrakeTable
    traction: TractionTable
    emergency_extra_mps: FloatArray
    """Speed that the emergency brake takes in a step beside the service brake. (n_trains,)"""
    near_m: float
    """Where the tables begin. [m]"""
    far_m: float
    """Where they end. [m]"""
    step_s: float


class Asked(NamedTuple):
    """What authority and advice ask for in a step; arrays of shape (n_trains,)."""

    eoa_m: FloatArray
    delay_s: FloatArray
    eoa_by: IntArray
    ceiling_mps: FloatArray
    advised_mps: FloatArray
    """The ceiling of the advice. [m/s]"""
    emergency: BoolArray


class Stops(NamedTuple):
    """The next stops; arrays of shape (n_trains,)."""

    stop_m: FloatArray
    v2_m2ps2: FloatArray
    """Twice the brake potential there. [m2/s2]"""


class TractionDrive:
    """
    Follows the lowest of six bounds.

    The rows of its bounds are the first six of :class:`~kankaku.railway.step.control.Bound`; for a
    train whose permission says that it brakes in emergency nothing else counts. The service brake
    is the strongest that advice, stops and ceilings may ask for; only an authority that cannot be
    kept otherwise gets the emergency brake.
    """

    def __init__(self, world: World) -> None:
        self._step_s = world.step_s
        self._rows = np.arange(world.size)
        service, emergency = map(world.of_type, ("service_brake_mps2", "emergency_brake_mps2"))
        self._braking = world.braking
        self._abilities = plain(
            Abilities(
                world.braking,
                traction_table(world, world.profile, world.step_s),
                (emergency - service) * world.step_s,
                world.profile.origin_m,
                world.far_m,
                world.step_s,
            )
        )
        nowhere_m = np.full(world.size, np.nan)
        self._stops = plain(Stops(nowhere_m, nowhere_m))
        self._calls_version = NO_VERSION

    def command(self, state: LineState, authority: Authority, advice: Advice) -> Command:
        """Return the speed at the end of the step for every train."""
        if state.calls_version != self._calls_version:
            self._calls_version = state.calls_version
            v2_m2ps2 = braking_v2_each(self._braking, self._rows, state.stop_m)
            self._stops = plain(Stops(state.stop_m, v2_m2ps2))
        asked = (
            authority.eoa_m,
            authority.delay_s,
            authority.eoa_by,
            authority.ceiling_mps,
            advice.ceiling_mps,
            authority.permission.emergency,
        )
        return Command(*_command(state.whereabouts, asked, self._stops, self._abilities))


@compiled
def _command(
    whereabouts: Plain, asked_fields: Plain, stop_fields: Plain, ability_fields: Plain
) -> tuple[FloatArray, FloatArray, IntArray]:
    trains, asked = Whereabouts(*whereabouts), Asked(*asked_fields)
    stops, able = Stops(*stop_fields), _abilities(ability_fields)
    size = trains.speed_mps.size
    next_mps, bound = np.zeros(size), np.zeros(size, dtype=np.intp)
    bounds = np.zeros((N_BOUNDS, size))
    for train in range(size):
        if not trains.running[train]:
            continue
        speed, front_m = trains.speed_mps[train], trains.front_m[train]
        loss = braking_loss_mps(able.braking, train, front_m, speed, able.step_s)
        pulled = pulled_mps(able.traction, train, front_m, speed)
        # On a climb that takes more than a net brake does, traction is all that there is.
        braked = min(speed - loss, pulled)
        hardest = min(speed - loss - able.emergency_extra_mps[train], pulled)
        if asked.emergency[train]:
            next_mps[train] = max(hardest, 0.0)
            bounds[:, train] = np.inf
            bounds[EMERGENCY, train] = next_mps[train]
            bound[train] = EMERGENCY
            continue
        here = braking_v2_at(able.braking, train, front_m)
        # Who cannot climb stands, held by the brake.
        bounds[TRACTION, train] = max(pulled, 0.0)
        bounds[CEILING, train] = asked.ceiling_mps[train]
        bounds[ADVICE, train] = asked.advised_mps[train]
        bounds[LIMIT, train] = _to_end_mps(asked, able, train, front_m, speed, (here, loss))
        bounds[STOP, train] = next_speed_mps(speed, stops.v2_m2ps2[train] - here, loss, 0.0)
        bounds[EMERGENCY, train] = np.inf
        wish = max(bounds[:, train].min(), braked)
        emergency = max(bounds[LIMIT, train], hardest)
        next_mps[train] = max(min(wish, emergency), 0.0)
        eoa_m, eoa_by, stop_m = asked.eoa_m[train], asked.eoa_by[train], stops.stop_m[train]
        bound[train] = _lowest(bounds[:, train], eoa_m, eoa_by, stop_m, able.far_m)
    return next_mps, bounds, bound


@compiled
def _abilities(fields: Plain) -> Abilities:
    braking, traction, emergency_extra_mps, near_m, far_m, step_s = fields
    return Abilities(
        BrakeTable(*braking), TractionTable(*traction), emergency_extra_mps, near_m, far_m, step_s
    )


@compiled
def _to_end_mps(
    asked: Asked,
    able: Abilities,
    train: int,
    front_m: float,
    speed: float,
    braked: tuple[float, float],
) -> float:
    """Return the speed after a step on the brake curve to the end of authority."""
    (here, loss), lag = braked, 0.0
    if asked.delay_s[train] > 0.0:
        lag = braking_loss_mps(able.braking, train, front_m, speed, asked.delay_s[train])
    end_m = min(max(asked.eoa_m[train], able.near_m), able.far_m)
    ahead = braking_v2_at(able.braking, train, end_m)
    return float(next_speed_mps(speed, ahead - here, loss, lag))


@compiled
def _lowest(bounds_mps: FloatArray, eoa_m: float, eoa_by: int, stop_m: float, far_m: float) -> int:
    """
    Return which bound a train's speed is told to be due to.

    Of bounds that are alike the nearer and harder one counts. Where nothing ends the way and
    where no stop is left, the brake curves lead to the ends of the tables only.
    """
    lowest = STOP if stop_m < far_m else CEILING
    for other in (CEILING, ADVICE, TRACTION):
        if bounds_mps[other] < bounds_mps[lowest]:
            lowest = other
    # Who brakes for its stop anyway does so even if the way ends soon behind it.
    beyond = lowest == STOP and eoa_m >= stop_m
    if eoa_by != NOTHING and bounds_mps[LIMIT] <= bounds_mps[lowest] and not beyond:
        lowest = LIMIT
    return lowest
