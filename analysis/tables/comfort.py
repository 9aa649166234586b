"""Ride comfort: how much the acceleration of trains changes from second to second."""

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Reason

STANDING = int(Reason.DWELLING), int(Reason.HELD)


def jerk_mps3(record: RunRecord) -> FloatArray:
    """
    Return the jerk of every train while it runs.

    Accelerations are means over a sample of the trajectory, about a second, so that a change
    of traction or brake within a step counts by what passengers feel of it.

    Parameters
    ----------
    record
        What a run left behind.

    Returns
    -------
    FloatArray
        Root mean square of the change of acceleration; nan for a train that never ran.
        [m/s3], shape (n_trains,)
    """
    seen = record.trajectory
    order = np.lexsort((seen.time_s, seen.row))
    time_s, row, speed_mps = seen.time_s[order], seen.row[order], seen.speed_mps[order]
    runs = ~np.isin(seen.reason[order], STANDING)
    step_s = np.diff(time_s)
    sample_s = np.median(step_s) if step_s.size else 1.0
    joined = (row[1:] == row[:-1]) & runs[:-1] & (np.abs(step_s - sample_s) < 0.5 * sample_s)
    acceleration_mps2 = np.diff(speed_mps) / sample_s
    jerk = np.diff(acceleration_mps2) / sample_s
    both = joined[1:] & joined[:-1]
    size = record.world.size
    squares = np.bincount(row[1:-1][both], np.square(jerk[both]), size)
    counts = np.bincount(row[1:-1][both], minlength=size)
    with np.errstate(invalid="ignore"):
        return np.sqrt(squares / counts)
