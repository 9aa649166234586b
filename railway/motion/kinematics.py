"""Braking and discrete-step formulas; the elementwise ones take arrays over trains."""

import math

import numpy as np

from kankaku.railway.compiled import elementwise, formula

NEWTON_STEPS = 40
"""More than are ever needed. [-]"""
NEAR_MPS = 1e-6
"""Speeds after a step are known this well. [m/s]"""


@elementwise
def braking_distance_m(speed_mps: float, brake_mps2: float) -> float:
    """
    Return the distance to a standstill on the level.

    Parameters
    ----------
    speed_mps
        Speed. [m/s], broadcastable
    brake_mps2
        Constant deceleration. [m/s2], broadcastable

    Returns
    -------
    FloatArray
        Distance. [m], broadcast shape

    References
    ----------
    .. [1] Sato et al. 2025, eq. (11).
    """
    return 0.5 * speed_mps * speed_mps / brake_mps2


@elementwise
def next_speed_mps(speed_mps: float, square_m2ps2: float, loss_mps: float, lag_mps: float) -> float:
    r"""
    Return the greatest speed after one step from which a brake curve can still be kept.

    A curve is given by the square of the speed :math:`w` that it allows at the present
    position, and by the speed :math:`l = b \Delta t` that its deceleration takes in a step.
    Over a step of constant acceleration the train moves :math:`(v_0 + v_1) \Delta t / 2`, and
    the curve has to be kept by a front that counts as a delay :math:`\tau` further on, which
    takes :math:`m = b \tau`:

    .. math:: v_1^2 + l (v_0 + v_1) + 2 m v_1 \le w

    whose larger root is returned; 0 where there is none.

    Parameters
    ----------
    speed_mps
        Speed at the start of the step. [m/s], broadcastable
    square_m2ps2
        Square of the speed that the curve allows at the present position; ``2 b d`` for a
        target ``d`` metres ahead on the level. [m2/s2], broadcastable
    loss_mps
        Speed lost by braking for a step. [m/s], broadcastable
    lag_mps
        Speed lost by braking for the delay. [m/s], broadcastable

    Returns
    -------
    FloatArray
        Speed at the end of the step. [m/s], broadcast shape
    """
    room = square_m2ps2 - loss_mps * speed_mps
    if room <= 0.0:
        return 0.0
    half = 0.5 * loss_mps + lag_mps
    return math.sqrt(half * half + room) - half


@formula
def rising_speed_mps(
    speed_mps: float,
    square_m2ps2: float,
    losses_mps: tuple[float, float],
    rise_mps: float,
    enough_mps: float = np.inf,
) -> float:
    r"""
    Return :func:`next_speed_mps` for a brake that builds up.

    From an acceleration :math:`a` a brake that rises at a rate :math:`j` to its deceleration
    :math:`b` takes a train of speed :math:`v` further than its braking distance by
    :math:`v (a + b)^2 / 2 j b`, but for terms that do not grow with the speed. So after a step
    in which it gains :math:`v_1 - v_0` its front counts as further on by a delay of that kind,

    .. math:: v_1^2 + l (v_0 + v_1) + 2 m v_1 + \frac{u^2}{r} v_1
        + \frac{u^3}{3 r^2} \max(\tfrac34 u - l, 0) \le w, \qquad u = l + v_1 - v_0

    with the speed :math:`r` by which a step of a rising brake takes more than the one before.

    Parameters
    ----------
    speed_mps
        Speed at the start of the step. [m/s]
    square_m2ps2
        Square of the speed that the curve allows at the present position. [m2/s2]
    losses_mps
        Speed lost by braking for a step, and for the delay of :func:`next_speed_mps`. [m/s]
    rise_mps
        Greatest growth of the speed lost from step to step; infinite for a brake that is whole at
        once. [m/s]
    enough_mps
        Who may be faster than this need not know by how much: then any higher speed is returned,
        as that of :func:`next_speed_mps`. [m/s]

    Returns
    -------
    float
        Speed at the end of the step. [m/s]
    """
    loss_mps, lag_mps = losses_mps
    after = float(next_speed_mps(speed_mps, square_m2ps2, loss_mps, lag_mps))
    braked = max(speed_mps - loss_mps, 0.0)
    if rise_mps == np.inf or after <= braked:
        return after
    figures = speed_mps, square_m2ps2, loss_mps, lag_mps, rise_mps
    if enough_mps < after and _over_curve(max(enough_mps, braked), figures)[0] < 0.0:
        return after
    if braked > 0.0:
        # Nobody who builds up by more has any room left.
        room = square_m2ps2 - braked * braked - loss_mps * (speed_mps + braked)
        room -= 2.0 * lag_mps * braked
        after = min(after, braked + math.sqrt(max(rise_mps * room / braked, 0.0)))
    # Convex and rising from here down: Newton's steps fall towards the root.
    for _ in range(NEWTON_STEPS):
        excess, slope = _over_curve(after, figures)
        step = excess / slope
        after = max(after - step, braked)
        if step < NEAR_MPS or after <= braked:
            break
    return after


@formula
def _over_curve(
    after: float, figures: tuple[float, float, float, float, float]
) -> tuple[float, float]:
    """Return by how much a speed after a step is over the curve [m2/s2], and its slope. [m/s]"""
    speed_mps, square_m2ps2, loss_mps, lag_mps, rise_mps = figures
    missing = loss_mps + after - speed_mps
    excess = after * after + loss_mps * (speed_mps + after) + 2.0 * lag_mps * after
    excess += missing * missing / rise_mps * after - square_m2ps2
    slope = 2.0 * after + loss_mps + 2.0 * lag_mps
    slope += missing * (missing + 2.0 * after) / rise_mps
    # What does not grow with the speed counts only from a strong acceleration on.
    over = 0.75 * missing - loss_mps
    if over > 0.0:
        excess += missing**3 * over / (3.0 * rise_mps**2)
        slope += missing**2 * (over + 0.25 * missing) / rise_mps**2
    return excess, slope


def two_stage_brake_mps2(acceleration_mps2: float, brake_mps2: float) -> float:
    """
    Return the deceleration of the first stage of two-stage deceleration.

    Braking at this rate towards the leader's rear, a train that holds its present speed
    from the moment its leader departs just touches the safety limit.

    Parameters
    ----------
    acceleration_mps2
        Greatest acceleration of the leader. [m/s2]
    brake_mps2
        Greatest service braking of the follower. [m/s2]

    Returns
    -------
    float
        ``a b / (a + b)``. [m/s2]

    References
    ----------
    .. [1] Sato et al. 2025, eqs. (15) and (16) solved for the deceleration.
    """
    return acceleration_mps2 * brake_mps2 / (acceleration_mps2 + brake_mps2)


@elementwise
def two_stage_speed_mps(
    gap_m: float, leader_speed_mps: float, acceleration_mps2: float, brake_mps2: float
) -> float:
    r"""
    Return the speed that may be held if the leader accelerates from now on.

    The braking point of a follower at constant speed :math:`v` is tangent to the path of
    a rear that moves at :math:`v_1` and accelerates at :math:`a`:

    .. math:: \frac{v^2}{2b} + \frac{(v - v_1)^2}{2a} = D, \qquad v \ge v_1

    With a standing leader this is eq. (16) of the source; when the pure braking distance
    at the leader's speed already exceeds the gap, the brake curve :math:`\sqrt{2 b D}` is
    returned.

    Parameters
    ----------
    gap_m
        Distance to the leader's rear, margins taken off. [m], broadcastable
    leader_speed_mps
        Speed of the leader; 0 where it stands. [m/s], broadcastable
    acceleration_mps2
        Greatest acceleration of the leader. [m/s2], broadcastable
    brake_mps2
        Greatest service braking of the follower. [m/s2], broadcastable

    Returns
    -------
    FloatArray
        Speed. [m/s], broadcast shape

    References
    ----------
    .. [1] Sato et al. 2025, eqs. (12) to (16), the leader's own speed added.
    """
    if gap_m <= 0.0:
        return 0.0
    share = brake_mps2 / (acceleration_mps2 + brake_mps2)
    along = share * leader_speed_mps
    square = (
        along * along
        + 2.0 * share * acceleration_mps2 * gap_m
        - share * leader_speed_mps * leader_speed_mps
    )
    if square > 0.0:
        tangent = along + math.sqrt(square)
        if tangent >= leader_speed_mps:
            return tangent
    return min(math.sqrt(2.0 * brake_mps2 * gap_m), leader_speed_mps)
