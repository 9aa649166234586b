"""Train numbers along the lines of a time-distance diagram."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

SIZE_PT = 5.5
LONGEST = 12
"""Characters of a number; longer ones are cut off. [-]"""
STAGGERED = (0.10, 0.22, 0.34)
"""Where along its visible way a train bears its number; neighbours at different places. [-]"""


def name_lines(axes: Axes, lines: Mapping[str, Line2D], *, size: float = SIZE_PT) -> None:
    """
    Write the number of each train along its line.

    Parameters
    ----------
    axes
        Where the lines are; its limits are set before.
    lines
        One for each train, times across and places upwards, in the order of the trains.
    size
        Of the letters. [pt]
    """
    start_s, end_s = sorted(axes.get_xlim())
    low_m, high_m = sorted(axes.get_ylim())
    for number, (train, line) in enumerate(lines.items()):
        times_s = np.asarray(line.get_xdata(), dtype=np.float64)
        places_m = np.asarray(line.get_ydata(), dtype=np.float64)
        seen = (times_s >= start_s) & (times_s <= end_s) & (places_m > low_m) & (places_m < high_m)
        # A number beside a standing train would lie across the next line.
        moves = np.flatnonzero(seen[:-1] & seen[1:] & (np.diff(places_m) != 0.0))
        if not moves.size:
            continue
        at = int(moves[int(STAGGERED[number % len(STAGGERED)] * (moves.size - 1))])
        to = min(at + 20, times_s.size - 1)
        angle = np.degrees(np.arctan2(places_m[to] - places_m[at], times_s[to] - times_s[at]))
        axes.text(
            times_s[at],
            places_m[at],
            train[:LONGEST],
            fontsize=size,
            color=line.get_color(),
            rotation=angle,
            rotation_mode="anchor",
            transform_rotates_text=True,
            va="bottom",
            clip_on=True,
            zorder=4.0,
        )
