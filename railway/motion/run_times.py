"""Run times of all legs of a timetable, each train alone on the line."""

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.motion.run_curve import driven_along
from kankaku.railway.motion.way import way_on
from kankaku.railway.plan.profile import Profile
from kankaku.railway.plan.world import World


def run_times_s(world: World, profile: Profile) -> FloatArray:
    """
    Return the run time to each call from the one before, as trains are driven on a profile.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    profile
        The line as they are driven on it.

    Returns
    -------
    FloatArray
        From when the train may depart to its standstill, nobody in its way; nan at origins and
        past the last call. [s], shape (n_trains, n_calls_max)
    """
    known: dict[tuple[int, float, float], float] = {}
    times_s = np.full((world.size, world.stop_m.shape[1] - 1), np.nan)
    for row in range(world.size):
        kind = int(world.type_index[row])
        for column in range(1, int(world.call_count[row])):
            start_m, stop_m = world.stop_m[row, column - 1 : column + 1].tolist()
            key = (kind, start_m, stop_m)
            if key not in known:
                way = way_on(profile, kind, world.driven_types[kind], (start_m, stop_m))
                known[key] = driven_along(way, profile.coasting_band_mps).run_time_s
            times_s[row, column] = world.departure_lag_s[row] + known[key]
    return times_s
