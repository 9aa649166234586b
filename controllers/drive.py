"""The drive: the next speed of every train within traction and braking."""

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import compiled, plain
from kankaku.railway.motion.kinematics import next_speed_mps
from kankaku.railway.motion.traction_table import Pull, pull_of, pulled_mps
from kankaku.railway.plan.profile import at, at_each, braking_loss_mps
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Bound, Command
from kankaku.railway.step.state import NOTHING, Advice, Authority, LineState

N_BOUNDS = 6
# Plain numbers, as compiled functions want them.
TRACTION, CEILING, ADVICE = int(Bound.TRACTION), int(Bound.CEILING), int(Bound.ADVICE)
LIMIT, STOP, EMERGENCY = int(Bound.LIMIT), int(Bound.STOP), int(Bound.EMERGENCY)


class TractionDrive:
    """
    Follows the lowest of six bounds.

    The rows of its bounds are the first six of :class:`~kankaku.railway.step.control.Bound`; for a
    train whose link says that it brakes in emergency nothing else counts. The service brake is the
    strongest that advice, stops and ceilings may ask for; only an authority that cannot be kept
    otherwise gets the emergency brake.
    """

    def __init__(self, world: World) -> None:
        step_s, profile = world.step_s, world.profile
        self._step_s = step_s
        self._row_start = world.row_start
        self._tables_m = (profile.origin_m, world.far_m)
        # Twice the potential: squares of speeds need no halving.
        self._square = 2.0 * profile.potential_m2ps2.ravel()
        self._pull = plain(pull_of(world, profile, step_s))
        service, emergency = map(world.of_type, ("service_brake_mps2", "emergency_brake_mps2"))
        self._emergency_extra = (emergency - service) * step_s
        self._nobody = np.zeros(world.size, dtype=np.bool_)
        self._stop_m = np.full(world.size, np.nan)
        self._stops = np.full((2, world.size), np.nan)

    def command(self, state: LineState, authority: Authority, advice: Advice) -> Command:
        """
        Return the speed at the end of the step for every train.

        Parameters
        ----------
        state
            The line.
        authority
            What protection permits.
        advice
            What operation asks for.

        Returns
        -------
        Command
            Next speeds and their bounds.
        """
        if state.stop_m is not self._stop_m:
            self._stop_m = state.stop_m
            squares = at_each(self._square, state.stop_m, self._row_start)
            # One array more costs as much as a formula for all trains.
            self._stops = np.array([state.stop_m, squares])
        return Command(
            *_command(
                state.front_m,
                state.speed_mps,
                authority.eoa_m,
                authority.delay_s,
                authority.eoa_by,
                authority.ceiling_mps,
                advice.ceiling_mps,
                self._stops,
                state.running,
                self._nobody if authority.link is None else authority.link.emergency,
                self._row_start,
                self._square,
                self._pull,
                self._emergency_extra,
                self._tables_m,
                self._step_s,
            )
        )


@compiled
def _command(  # noqa: PLR0913, PLR0917 - compiled functions take plain arrays
    front_m: FloatArray,
    speed_mps: FloatArray,
    eoa_m: FloatArray,
    delay_s: FloatArray,
    eoa_by: IntArray,
    ceiling_mps: FloatArray,
    advised_mps: FloatArray,
    stops: FloatArray,
    running: BoolArray,
    in_emergency: BoolArray,
    row_start: FloatArray,
    square: FloatArray,
    pull_fields: tuple[FloatArray, FloatArray, FloatArray, float],
    emergency_extra: FloatArray,
    tables_m: tuple[float, float],
    step_s: float,
) -> tuple[FloatArray, FloatArray, IntArray]:
    near_m, far_m = tables_m
    pull = Pull(*pull_fields)
    next_mps = np.zeros_like(speed_mps)
    bounds = np.zeros((N_BOUNDS, speed_mps.size))
    bound = np.zeros(speed_mps.size, dtype=np.intp)
    for train in range(speed_mps.size):
        if not running[train]:
            continue
        speed = speed_mps[train]
        place = front_m[train] + row_start[train]
        here = at(square, place)
        loss = braking_loss_mps(square, place, speed, step_s)
        if in_emergency[train]:
            next_mps[train] = max(speed - loss - emergency_extra[train], 0.0)
            bounds[:, train] = np.inf
            bounds[EMERGENCY, train] = next_mps[train]
            bound[train] = EMERGENCY
            continue
        lag = 0.0
        if delay_s[train] > 0.0:
            lag = braking_loss_mps(square, place, speed, delay_s[train])
        limit = min(max(eoa_m[train], near_m), far_m)
        ahead = at(square, limit + row_start[train])
        # Who cannot climb stands, held by the brake.
        bounds[TRACTION, train] = max(pulled_mps(pull, train, place, speed), 0.0)
        bounds[CEILING, train] = ceiling_mps[train]
        bounds[ADVICE, train] = advised_mps[train]
        bounds[LIMIT, train] = next_speed_mps(speed, ahead - here, loss, lag)
        bounds[STOP, train] = next_speed_mps(speed, stops[1, train] - here, loss, 0.0)
        bounds[EMERGENCY, train] = np.inf
        wish = max(bounds[:, train].min(), speed - loss)
        emergency = max(bounds[LIMIT, train], speed - loss - emergency_extra[train])
        next_mps[train] = max(min(wish, emergency), 0.0)
        bound[train] = _lowest(
            bounds[:, train], eoa_m[train], eoa_by[train], stops[0, train], far_m
        )
    return next_mps, bounds, bound


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
