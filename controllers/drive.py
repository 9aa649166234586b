"""The drive: the next speed of every train within traction and braking."""

import numpy as np

from controllers.pull import Pull, pull_of, pulled_mps
from railway.arrays import BoolArray, FloatArray, IntArray
from railway.compiled import compiled, plain
from railway.control import Command
from railway.kinematics import next_speed_mps
from railway.profile import at, at_each, braking_loss_mps
from railway.state import Advice, Authority, LineState, Reason
from railway.world import World

N_BOUNDS = 6
ADVISED = 2
"""The row for which the advice says why it lowers the ceiling."""
ROW_REASONS = np.array(
    [
        Reason.TRACTION,
        Reason.LINE_CEILING,
        -1,
        Reason.AUTHORITY,
        Reason.STATION_STOP,
        Reason.EMERGENCY,
    ],
    dtype=np.intp,
)


class TractionDrive:
    """
    Follows the lowest of six bounds.

    The rows of its bounds are traction, protection's ceiling, the advised ceiling, the
    brake curve to the end of authority, the brake curve to the next stop, and the emergency
    brake of a train whose link says so, for which nothing else counts. The service
    brake is the strongest that advice, stops and ceilings may ask for; only an authority
    that cannot be kept otherwise gets the emergency brake.
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
        self._stop_square = np.full(world.size, np.nan)

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
            self._stop_square = at_each(self._square, state.stop_m, self._row_start)
        return Command(
            *_command(
                state.front_m,
                state.speed_mps,
                authority.limit_m,
                authority.delay_s,
                authority.ceiling_mps,
                advice.ceiling_mps,
                self._stop_square,
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

    def reason(self, command: Command, advice: Advice) -> IntArray:
        """
        Return what bound each train's speed.

        Parameters
        ----------
        command
            From :meth:`command`.
        advice
            The advice it was made from.

        Returns
        -------
        IntArray
            A :class:`~railway.state.Reason` each. shape (n_trains,)
        """
        lowest = command.bounds_mps.argmin(axis=0)
        return np.where(lowest == ADVISED, advice.reason, ROW_REASONS[lowest])


@compiled
def _command(  # noqa: PLR0913, PLR0917 - compiled functions take plain arrays
    front_m: FloatArray,
    speed_mps: FloatArray,
    limit_m: FloatArray,
    delay_s: FloatArray,
    ceiling_mps: FloatArray,
    advised_mps: FloatArray,
    stop_square: FloatArray,
    running: BoolArray,
    in_emergency: BoolArray,
    row_start: FloatArray,
    square: FloatArray,
    pull_fields: tuple[FloatArray, FloatArray, FloatArray, float],
    emergency_extra: FloatArray,
    tables_m: tuple[float, float],
    step_s: float,
) -> tuple[FloatArray, FloatArray]:
    near_m, far_m = tables_m
    pull = Pull(*pull_fields)
    next_mps = np.zeros_like(speed_mps)
    bounds = np.zeros((N_BOUNDS, speed_mps.size))
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
            bounds[5, train] = next_mps[train]
            continue
        lag = 0.0
        if delay_s[train] > 0.0:
            lag = braking_loss_mps(square, place, speed, delay_s[train])
        limit = min(max(limit_m[train], near_m), far_m)
        ahead = at(square, limit + row_start[train])
        # Who cannot climb stands, held by the brake.
        bounds[0, train] = max(pulled_mps(pull, train, place, speed), 0.0)
        bounds[1, train] = ceiling_mps[train]
        bounds[2, train] = advised_mps[train]
        bounds[3, train] = next_speed_mps(speed, ahead - here, loss, lag)
        bounds[4, train] = next_speed_mps(speed, stop_square[train] - here, loss, 0.0)
        bounds[5, train] = np.inf
        wish = max(bounds[:, train].min(), speed - loss)
        emergency = max(bounds[3, train], speed - loss - emergency_extra[train])
        next_mps[train] = max(min(wish, emergency), 0.0)
    return next_mps, bounds
