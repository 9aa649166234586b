"""One brake pattern: the speeds from which a share of the service brake stops a train in time."""

from kankaku.railway.compiled import formula
from kankaku.railway.motion.kinematics import next_speed_mps
from kankaku.railway.plan.brake_table import BrakeTable, braking_v2_at


@formula
def pattern_v2_m2ps2(
    braking: BrakeTable, train: int, from_m: float, stop_m: float, share: float
) -> float:
    r"""
    Return the square of the speed that a share of the service brake takes off on the way to a stop.

    The share is that of the brake alone; gravity, which the table holds, is not lessened:

    .. math:: w = 2 \int (b + g i)\,dx - 2 (1 - s)\, b\, (x_{stop} - x)

    Parameters
    ----------
    braking
        What the service brake takes.
    train
        Row of the train.
    from_m
        Where the train brakes from. [m]
    stop_m
        Where the pattern ends. [m]
    share
        Deceleration of the pattern over the service brake. [-]

    Returns
    -------
    float
        [m2/s2]
    """
    whole = braking_v2_at(braking, train, stop_m) - braking_v2_at(braking, train, from_m)
    spared = 2.0 * (1.0 - share) * braking.service_mps2[train] * (stop_m - from_m)
    return float(whole - spared)


@formula
def brake_pattern_mps(
    braking: BrakeTable, train: int, from_m: float, stop_m: float, brake: tuple[float, float]
) -> float:
    """
    Return the speed that the pattern permits at a place.

    Parameters
    ----------
    braking
        What the service brake takes.
    train
        Row of the train.
    from_m
        Where. [m]
    stop_m
        Where the pattern ends. [m]
    brake
        Its share of the service brake [-], and the time until the brake takes effect [s].

    Returns
    -------
    float
        0 at the end and beyond. [m/s]
    """
    if from_m >= stop_m:
        return 0.0
    share, idle_time_s = brake
    w = pattern_v2_m2ps2(braking, train, from_m, stop_m, share)
    brake_mps2 = share * braking.service_mps2[train]
    return float(next_speed_mps(0.0, w, 0.0, brake_mps2 * idle_time_s))
