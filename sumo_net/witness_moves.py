"""What a witness that looks now and then is told of the steps in between."""

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import formula


@formula
def places_then(
    trains: tuple[IntArray, IntArray, FloatArray, FloatArray],
    commands_mps: FloatArray,
    moments: tuple[int, int, float],
    front_m: FloatArray,
    speed_mps: FloatArray,
) -> None:
    """
    Work out where trains are at some moments within steps that were taken in one go.

    Parameters
    ----------
    trains
        Who is looked at, shape (n_rows,), and who of them runs, shape (n_running,), both rising;
        fronts and speeds before the first step. [m], [m/s], shape (n_trains,)
    commands_mps
        Speeds at the end of each step of those who run. [m/s], shape (n_steps, n_running)
    moments
        After how many steps the first moment is, and so many more each further one; length of a
        step. [-], [-], [s]
    front_m, speed_mps
        Written to. [m], [m/s], shape (n_moments, n_rows)
    """
    rows, running, before_m, before_mps = trains
    first, every, step_s = moments
    column = 0
    for at in range(rows.size):
        row = rows[at]
        while column < running.size and running[column] < row:
            column += 1
        runs = column < running.size and running[column] == row
        start_m, speed, twice_mps, step = before_m[row], before_mps[row], 0.0, 0
        for moment in range(front_m.shape[0]):
            while runs and step < first + moment * every:
                twice_mps += speed + commands_mps[step, column]
                speed = commands_mps[step, column]
                step += 1
            front_m[moment, at] = start_m + 0.5 * step_s * twice_mps
            speed_mps[moment, at] = speed


@formula
def speeds_between(
    rows: IntArray,
    moved: tuple[FloatArray, FloatArray, FloatArray],
    period_s: float,
    told: FloatArray,
) -> None:
    """
    Work out what takes trains from moment to moment in one ballistic step each.

    Parameters
    ----------
    rows
        Who is looked at. shape (n_rows,)
    moved
        Fronts at the look before, of all trains, written to, shape (n_trains,); fronts and speeds
        at each moment. [m], [m], [m/s], shape (n_moments, n_rows)
    period_s
        From moment to moment. [s]
    told
        Distance gone, and speeds before and after the step, neither negative. Written to. [m],
        [m/s], [m/s], shape (3, n_moments, n_rows)
    """
    seen_m, front_m, speed_mps = moved
    for moment in range(front_m.shape[0]):
        for at in range(rows.size):
            gone_m = front_m[moment, at] - seen_m[rows[at]]
            seen_m[rows[at]] = front_m[moment, at]
            twice_mean_mps = 2.0 * gone_m / period_s
            before_mps = max(twice_mean_mps - speed_mps[moment, at], 0.0)
            told[0, moment, at] = gone_m
            told[1, moment, at] = before_mps
            told[2, moment, at] = twice_mean_mps - before_mps
