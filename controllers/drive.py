"""The drive: the next speed of every train within traction and braking."""

from typing import NamedTuple, TypeAlias

import numpy as np

from kankaku.controllers.manner import (
    Drivers,
    Manner,
    coasts,
    eased_mps,
    has_reacted,
    manner_from,
    manner_of,
    own_ceiling_mps,
    rising_least_mps,
)
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, formula, naming, plain
from kankaku.railway.motion.kinematics import rising_speed_mps
from kankaku.railway.motion.traction_table import coasted_mps, pulled_mps
from kankaku.railway.plan.brake_table import (
    BrakeTable,
    braking_loss_mps,
    braking_v2_at,
)
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import LayerSteps
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
AT_STOP_M = 1.0
"""A train that stands this near to its last stop has not departed yet. [m]"""


class Abilities(NamedTuple):
    """What trains can do; it stays for a whole run."""

    braking: BrakeTable
    emergency_extra_mps: FloatArray
    """Speed that the emergency brake takes in a step beside the service brake. (n_trains,)"""
    near_m: float
    """Where the tables begin. [m]"""
    far_m: float
    """Where they end. [m]"""
    step_s: float


Motion: TypeAlias = tuple[float, float, float, float]
"""Front [m] and speed of a train, speed lost in a step of the service brake, and the speed after
one of traction. [m/s]"""


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
    """The last and the next stops; arrays of shape (n_trains,)."""

    from_m: FloatArray
    """Where a train departs from; not a number before its first call. [m]"""
    booked_s: FloatArray
    """When it is booked to. [s]"""
    stop_m: FloatArray
    v2_m2ps2: FloatArray
    """Twice the brake potential there. [m2/s2]"""


class TractionDrive:
    """
    Follows the lowest of six bounds, in the style that the world's trains are driven in.

    The rows of its bounds are the first six of :class:`~kankaku.railway.step.control.Bound`; for a
    train whose permission says that it brakes in emergency nothing else counts. The service brake
    is the strongest that advice, stops and ceilings may ask for; only an authority that cannot be
    kept otherwise gets the emergency brake. Where acceleration changes gradually the drive acts so
    much earlier. It remembers what drivers do.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        service, emergency = map(world.of_type, ("service_brake_mps2", "emergency_brake_mps2"))
        self._abilities = plain(
            Abilities(
                world.braking,
                (emergency - service) * world.step_s,
                world.profile.origin_m,
                world.far_m,
                world.step_s,
            )
        )
        self._manner = plain(manner_of(world))
        self._stops = plain(Stops(*np.full((4, world.size), np.nan)))
        self._booked = world.stop_m, world.booked_departure_s
        self._calls_version = NO_VERSION
        self._nobody = np.zeros(world.size, dtype=np.bool_)
        self._drivers = plain(
            Drivers(
                np.zeros(world.size),
                np.zeros(world.size),
                np.zeros(world.size),
                np.zeros(world.size, dtype=np.bool_),
                np.full(world.size, np.inf),
            )
        )

    def command(self, state: LineState, authority: Authority, advice: Advice) -> Command:
        """Return the speed at the end of the step for every train."""
        self._take_up_calls(state)
        asked = (
            authority.eoa_m,
            authority.delay_s,
            authority.eoa_by,
            authority.ceiling_mps,
            advice.ceiling_mps,
            authority.permission.emergency,
        )
        told = self._untold(self._world.size)
        wanted = state.time_s, state.whereabouts, asked, self._stops
        _command(wanted, (self._abilities, self._manner, self._drivers), told)
        next_mps, bound, bounds = told
        return Command(next_mps, bounds, bound)

    def steps(self, state: LineState) -> LayerSteps:
        """Return the compiled step."""
        self._take_up_calls(state)
        trains = self._abilities, self._manner, self._drivers
        fields = self._stops, trains, self._nobody
        return LayerSteps(_drive, fields, (), self._untold(1), np.inf)

    def _untold(self, columns: int) -> tuple[FloatArray, IntArray, FloatArray]:
        """Return speeds and what counts for each, before any was told, and columns for bounds."""
        size = self._world.size
        return np.zeros(size), np.zeros(size, dtype=np.intp), np.zeros((N_BOUNDS, columns))

    def _take_up_calls(self, state: LineState) -> None:
        if state.calls_version != self._calls_version:
            self._calls_version = state.calls_version
            calls = np.flatnonzero(state.present), state.next_call, state.stop_m
            _take_up(calls, self._booked, self._world.braking, self._stops)


@formula
def _take_up(
    calls: tuple[IntArray, IntArray, FloatArray],
    booked: tuple[FloatArray, FloatArray],
    braking: BrakeTable,
    stops_fields: Plain,
) -> None:
    """Write the last and the next stops of the trains on the line."""
    rows, next_call, stop_m = calls
    stops = Stops(*stops_fields)
    for train in rows:
        call = next_call[train]
        stops.from_m[train] = booked[0][train, call - 1] if call > 0 else np.nan
        stops.booked_s[train] = booked[1][train, max(call - 1, 0)]
        stops.stop_m[train] = stop_m[train]
        stops.v2_m2ps2[train] = braking_v2_at(braking, train, stop_m[train])


@formula
def _command(
    wanted: tuple[float, Plain, Plain, Plain],
    trains_fields: tuple[Plain, Plain, Plain],
    told: tuple[FloatArray, IntArray, FloatArray],
) -> None:
    """Write speeds, what counts for each, and bounds: one column again and again, or of each."""
    now_s, whereabouts, asked_fields, stop_fields = wanted
    next_mps, bound, bounds = told
    trains, asked, stops = Whereabouts(*whereabouts), Asked(*asked_fields), Stops(*stop_fields)
    able, manner = _abilities(trains_fields[0]), manner_from(trains_fields[1])
    drivers, known = Drivers(*trains_fields[2]), (able, manner)
    for train in trains.rows:
        if not trains.running[train]:
            drivers.before_mps[train], drivers.coasts_from_mps[train] = 0.0, 0.0
            next_mps[train], bound[train] = 0.0, 0
            continue
        speed, front_m = trains.speed_mps[train], trains.front_m[train]
        loss = braking_loss_mps(able.braking, train, front_m, speed, able.step_s)
        pulled = pulled_mps(manner.ceiling.traction, train, front_m, speed)
        motion = front_m, speed, loss, pulled
        gained, downhill, braked, hardest = _reach_mps(known, drivers, train, motion)
        if asked.emergency[train]:
            next_mps[train] = max(hardest, 0.0)
            own = bounds[:, min(train, bounds.shape[1] - 1)]
            own[:] = np.inf
            own[EMERGENCY] = next_mps[train]
            bound[train] = EMERGENCY
            continue
        departs = speed == 0.0 and abs(front_m - stops.from_m[train]) < AT_STOP_M
        if departs and drivers.may_s[train] == np.inf:
            drivers.hurries[train] = now_s > stops.booked_s[train] + manner.late_after_s
        own = bounds[:, min(train, bounds.shape[1] - 1)]
        _bound(own, train, motion, asked, stops, known, drivers)
        kept = max(own[LIMIT], hardest)
        steeper = _steeper_mps(known, train, (front_m, speed), gained, downhill)
        speeds = speed, gained, braked, downhill, steeper
        wish = eased_mps(own, train, speeds, manner)
        next_mps[train] = max(min(wish, kept), 0.0)
        ends = asked.eoa_m[train], asked.eoa_by[train], stops.stop_m[train], able.far_m
        bound[train] = _lowest(own, ends)
        may = departs and next_mps[train] > 0.0
        if not has_reacted(now_s, train, may, manner, drivers):
            next_mps[train], bound[train] = 0.0, STOP


@formula
def _drive(instant: Plain, authority: Plain, advice: Plain, fields: Plain, told: Plain) -> None:
    now_s, whereabouts, _, _ = instant
    (eoa_m, ceiling_mps, delay_s, eoa_by, _), (stops, trains, nobody) = authority, fields
    asked = eoa_m, delay_s, eoa_by, ceiling_mps, advice[0], nobody
    _command((now_s, whereabouts, asked, stops), trains, told)


@formula
def _reach_mps(
    known: tuple[Abilities, Manner], drivers: Drivers, train: int, motion: Motion
) -> tuple[float, float, float, float]:
    """
    Return what brakes can do in a step, and write down where that begins.

    These are the speeds gained with traction or brake as in the last step, and on the descent
    alone, and the least speeds after it by service and emergency brake.
    """
    (able, manner), (_, speed, loss, pulled) = known, motion
    gained = speed - drivers.before_mps[train] if speed > 0.0 else 0.0
    downhill = able.braking.service_mps2[train] * able.step_s - loss
    # Gravity is at once there.
    gained += downhill - drivers.downhill_mps[train] if speed > 0.0 else 0.0
    drivers.before_mps[train], drivers.downhill_mps[train] = speed, downhill
    # On a climb that takes more than a net brake does, traction is all that there is.
    braked = min(speed - loss, pulled)
    hardest = min(speed - loss - able.emergency_extra_mps[train], pulled)
    if manner.rise_mps[train] < np.inf:
        rising, hard = rising_least_mps(manner, train, speed, gained, downhill)
        braked, hardest = max(braked, min(rising, pulled)), max(hardest, min(hard, pulled))
    return gained, downhill, braked, hardest


@formula
def _steeper_mps(
    known: tuple[Abilities, Manner],
    train: int,
    place: tuple[float, float],
    gained: float,
    downhill: float,
) -> float:
    """Return how much more from step to step the descent gives, until a gain has faded."""
    (able, manner), (front_m, speed) = known, place
    if manner.rise_mps[train] == np.inf:
        return 0.0
    steps = 2.0 + max(gained - downhill, 0.0) / manner.jerk_mps[train]
    steps += max(downhill, 0.0) / manner.rise_mps[train]
    level = able.braking.service_mps2[train] * able.step_s
    steeper = 0.0
    for share in (0.5, 1.0):
        there_m = min(front_m + share * steps * speed * able.step_s, able.far_m)
        then = level - braking_loss_mps(able.braking, train, there_m, speed, able.step_s)
        steeper = max(steeper, (then - downhill) / (share * steps))
    return steeper


@formula
def _bound(  # noqa: PLR0917 - compiled functions take plain arrays
    bounds: FloatArray,
    train: int,
    motion: Motion,
    asked: Asked,
    stops: Stops,
    known: tuple[Abilities, Manner],
    drivers: Drivers,
) -> None:
    """Write the bounds of a train that does not brake in emergency."""
    (able, manner), (front_m, speed, loss, pulled) = known, motion
    here = braking_v2_at(able.braking, train, front_m)
    ceiling, advised = asked.ceiling_mps[train], asked.advised_mps[train]
    if manner.keeps_ceiling:
        own = own_ceiling_mps(manner, drivers, train, (front_m, speed))
        if manner.band_mps > 0.0 and not drivers.hurries[train]:
            held = min(own, ceiling, advised)
            if coasts(manner, drivers, train, (speed, pulled), held):
                pulled = coasted_mps(manner.ceiling.traction, train, speed, pulled)
        ceiling = min(ceiling, own)
    # Who cannot climb stands, held by the brake.
    bounds[TRACTION] = max(pulled, 0.0)
    bounds[CEILING], bounds[ADVICE] = ceiling, advised
    bounds[LIMIT] = _to_end_mps(asked, known, train, motion, here)
    gentler = manner.gentler_mps2[train]
    room = stops.v2_m2ps2[train] - here - 2.0 * gentler * (stops.stop_m[train] - front_m)
    losses = loss - gentler * able.step_s, 0.0
    bounds[STOP] = rising_speed_mps(speed, room, losses, manner.rise_mps[train], motion[3])
    bounds[EMERGENCY] = np.inf


@naming
def _abilities(fields: Plain) -> Abilities:
    braking, emergency_extra_mps, near_m, far_m, step_s = fields
    return Abilities(BrakeTable(*braking), emergency_extra_mps, near_m, far_m, step_s)


@formula
def _to_end_mps(
    asked: Asked, known: tuple[Abilities, Manner], train: int, motion: Motion, here: float
) -> float:
    """Return the speed after a step on the brake curve to the end of authority."""
    (able, manner), (front_m, speed, loss, pulled) = known, motion
    lag, rise = 0.0, manner.rise_mps[train]
    if asked.delay_s[train] > 0.0:
        lag = braking_loss_mps(able.braking, train, front_m, speed, asked.delay_s[train])
    end_m = min(max(asked.eoa_m[train], able.near_m), able.far_m)
    ahead = braking_v2_at(able.braking, train, end_m)
    room, over = (ahead - here) / manner.safety_factor[train], manner.overspeed_mps[train]
    kept = rising_speed_mps(speed + over, room, (loss, lag), rise, pulled + over)
    return float(max(kept - over, 0.0))


@formula
def _lowest(bounds_mps: FloatArray, ends: tuple[float, int, float, float]) -> int:
    """
    Return which bound a train's speed is told to be due to.

    Of bounds that are alike the nearer and harder one counts. Where nothing ends the way and
    where no stop is left, the brake curves lead to the ends of the tables only.
    """
    eoa_m, eoa_by, stop_m, far_m = ends
    lowest = STOP if stop_m < far_m else CEILING
    for other in (CEILING, ADVICE, TRACTION):
        if bounds_mps[other] < bounds_mps[lowest]:
            lowest = other
    # Who brakes for its stop anyway does so even if the way ends soon behind it.
    beyond = lowest == STOP and eoa_m >= stop_m
    if eoa_by != NOTHING and bounds_mps[LIMIT] <= bounds_mps[lowest] and not beyond:
        lowest = LIMIT
    return lowest
