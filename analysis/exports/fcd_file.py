"""Floating car data of SUMO: where every train is drawn in every second."""

from collections.abc import Callable, Iterator
from typing import TypeAlias
from xml.sax.saxutils import quoteattr

import numpy as np

from kankaku.analysis.tables.run_tables import RunTables
from kankaku.railway.arrays import FloatArray

Places: TypeAlias = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""From chainage to east and north. [m]"""
STEP_M = 10.0
"""The direction of a train is that of the line over so much. [m]"""


def fcd_lines(run: RunTables, places: Places, name_of: Callable[[str], str]) -> Iterator[str]:
    """
    Yield the lines of a file of floating car data.

    Parameters
    ----------
    run
        A run with its trajectory.
    places
        Where a chainage is drawn.
    name_of
        What SUMO may call a train.

    Yields
    ------
    str
        XML: a ``timestep`` for each second, a ``vehicle`` for each train in it, with ``x``, ``y``
        [m], ``angle`` [degrees, clockwise from north], ``speed`` [m/s], ``pos``, the chainage of
        the front [m], and ``track``, the one under it.
    """
    samples = run.trajectory.sort_values(["time_s", "train"], kind="stable")
    front_m = samples["front_m"].to_numpy(dtype=np.float64)
    x_m, y_m = places(front_m)
    forward = samples["train"].map(_directions(run)).to_numpy(dtype=np.float64)
    ahead_x_m, ahead_y_m = places(front_m + STEP_M * forward)
    behind_x_m, behind_y_m = places(front_m - STEP_M * forward)
    angle_deg = np.degrees(np.arctan2(ahead_x_m - behind_x_m, ahead_y_m - behind_y_m)) % 360.0
    columns = zip(
        samples["time_s"].tolist(),
        [_quoted(name_of(str(train))) for train in samples["train"]],
        [_quoted(name_of(str(track))) for track in samples["track"]],
        x_m.tolist(),
        y_m.tolist(),
        angle_deg.tolist(),
        samples["speed_mps"].tolist(),
        front_m.tolist(),
        strict=True,
    )
    yield '<?xml version="1.0" encoding="UTF-8"?>\n<fcd-export>\n'
    now_s = None
    for time_s, train, track, x, y, angle, speed, place in columns:
        if time_s != now_s:
            if now_s is not None:
                yield "  </timestep>\n"
            yield f'  <timestep time="{time_s:.2f}">\n'
            now_s = time_s
        yield (
            f'    <vehicle id={train} x="{x:.2f}" y="{y:.2f}" angle="{angle:.2f}" type="train" '
            f'speed="{speed:.2f}" pos="{place:.2f}" track={track}/>\n'
        )
    yield ("" if now_s is None else "  </timestep>\n") + "</fcd-export>\n"


def _quoted(name: str) -> str:
    """Return a name as an attribute of XML, which holds no control characters at all."""
    return quoteattr("".join(c if c.isprintable() else f"%{ord(c):02x}" for c in name))


def _directions(run: RunTables) -> dict[str, float]:
    """Return 1 for each train towards higher chainage, and -1 for the others."""
    ends = run.trajectory.groupby("train", sort=False)["front_m"].agg(["first", "last"])
    rises = np.where(ends["last"] >= ends["first"], 1.0, -1.0)
    return dict(zip(ends.index.astype(str), rises.tolist(), strict=True))
