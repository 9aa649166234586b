"""
Draw every "how far" of one approach on one track: ``python -m tools.approach_drawing``.

Writes ``docs/approach.svg``. Places are schematic; the curves follow from them.
"""

import sys
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from kankaku.railway.arrays import FloatArray

PLACE = Path(__file__).parents[1] / "docs" / "approach.svg"
STYLE: Any = {"font.size": 9.0, "svg.fonttype": "path", "svg.hashsalt": "approach"}
FOLLOWER, LEADER, PERMISSION = "#1f5fa8", "#b5532a", "#5a2d82"
STOP, CEILING, GREY = "#2b7a3d", "#444444", "#777777"
BRAKE_MPS2 = 0.6
TAIL_M, FRONT_M, DELAYED_M = -220.0, 0.0, 45.0
LIMIT_M = (330.0, 620.0)
PLATFORM_M = (860.0, 1190.0)
STOP_M = 1170.0
EOA_M, DANGER_M, LEADER_M = 960.0, 1040.0, 1320.0
GRANTED_M, FOULED_M = 1450.0, 1560.0
TOP_MPS, LIMITED_MPS, SPEED_MPS = 25.0, 19.5, 23.0


class Mark(NamedTuple):
    """A place on the track with its label."""

    place_m: float
    title: str
    field: str
    row: int
    """How far down the label stands; 0 is the nearest. [-]"""
    colour: str
    shift_m: float = 0.0
    """By how much the label stands aside. [m]"""


MARKS = (
    Mark(TAIL_M, "tail of the follower", "tail_m", 0, FOLLOWER, 25.0),
    Mark(FRONT_M, "front of the follower", "front_m, speed_mps", 1, FOLLOWER),
    Mark(LIMIT_M[0], "speed limit begins", "limits.csv: start_km", 0, CEILING, -25.0),
    Mark(LIMIT_M[1], "speed limit ends", "end_km, for the tail", 0, CEILING, 20.0),
    Mark(EOA_M, "end of authority (EoA)", "Authority.eoa_m", 0, PERMISSION, -45.0),
    Mark(DANGER_M, "danger point: tail of the leader", "tail_m, clear_to_m", 1, LEADER, 110.0),
    Mark(STOP_M, "stop position", "stop_m", 0, STOP, 50.0),
    Mark(LEADER_M, "front of the leader", "front_m", 2, LEADER, 60.0),
    Mark(GRANTED_M, "granted to (points)", "LineState.granted_to_m", 0, PERMISSION, 45.0),
)


def braked_to(place_m: FloatArray, end_m: float, end_mps: float = 0.0) -> FloatArray:
    """
    Return the brake curve to a speed at a place.

    Parameters
    ----------
    place_m
        Places. [m], shape (n_places,)
    end_m
        Where the curve ends. [m]
    end_mps
        The speed there. [m/s]

    Returns
    -------
    FloatArray
        Speeds; not a number beyond the end. [m/s], shape (n_places,)
    """
    left_m = np.where(place_m <= end_m, end_m - place_m, np.nan)
    curve: FloatArray = np.sqrt(end_mps**2 + 2.0 * BRAKE_MPS2 * left_m)
    return curve


def ceiling_mps(place_m: FloatArray) -> FloatArray:
    """
    Return the line ceiling for the front, whose train is as long as the follower.

    Parameters
    ----------
    place_m
        Places. [m], shape (n_places,)

    Returns
    -------
    FloatArray
        Speeds. [m/s], shape (n_places,)
    """
    length_m = FRONT_M - TAIL_M
    limited = (place_m >= LIMIT_M[0]) & (place_m <= LIMIT_M[1] + length_m)
    before = np.fmin(braked_to(place_m, LIMIT_M[0], LIMITED_MPS), TOP_MPS)
    ahead = np.where(place_m < LIMIT_M[0], before, TOP_MPS)
    return np.where(limited, LIMITED_MPS, ahead)


def _speeds(axes: Axes) -> None:
    place_m = np.arange(-260.0, 1640.0)
    axes.plot(place_m, ceiling_mps(place_m), color=CEILING, lw=1.8)
    axes.text(
        1630.0, TOP_MPS + 0.6, "line ceiling: Authority.ceiling_mps", color=CEILING, ha="right"
    )
    to_eoa, to_stop = braked_to(place_m, EOA_M), braked_to(place_m, STOP_M)
    axes.plot(place_m[to_eoa <= TOP_MPS], to_eoa[to_eoa <= TOP_MPS], color=PERMISSION, lw=1.8)
    axes.plot(place_m[to_stop <= TOP_MPS], to_stop[to_stop <= TOP_MPS], color=STOP, lw=1.3, ls="--")
    axes.annotate(
        "service brake curve\nto the end of authority",
        (905.0, float(braked_to(np.array([905.0]), EOA_M)[0])),
        (610.0, 4.2),
        color=PERMISSION,
        ha="center",
        arrowprops={"arrowstyle": "-", "color": PERMISSION, "lw": 0.8},
    )
    axes.annotate(
        "service brake curve\nto the stop position",
        (1080.0, float(braked_to(np.array([1080.0]), STOP_M)[0])),
        (1290.0, 14.0),
        color=STOP,
        ha="center",
        arrowprops={"arrowstyle": "-", "color": STOP, "lw": 0.8},
    )
    axes.plot([FRONT_M], [SPEED_MPS], "o", color=FOLLOWER, ms=6)
    axes.annotate(
        "the follower now",
        (FRONT_M, SPEED_MPS),
        (-130.0, 17.5),
        color=FOLLOWER,
        ha="center",
        arrowprops={"arrowstyle": "-", "color": FOLLOWER, "lw": 0.8},
    )
    run_m = np.arange(FRONT_M, EOA_M)
    lowest = np.fmin(np.fmin(ceiling_mps(run_m), braked_to(run_m, EOA_M)), SPEED_MPS)
    axes.fill_between(run_m, lowest, color=FOLLOWER, alpha=0.10, lw=0.0)
    axes.text(300.0, 9.5, "what the follower may do", color=FOLLOWER, ha="center")
    axes.set_ylim(0.0, 29.0)
    axes.set_ylabel("speed")
    axes.set_yticks([])
    axes.spines[["top", "right"]].set_visible(False)


def _train(axes: Axes, tail_m: float, front_m: float, colour: str, name: str) -> None:
    axes.add_patch(Rectangle((tail_m, 0.07), front_m - tail_m, 0.5, color=colour))
    axes.text((tail_m + front_m) / 2.0, 0.32, name, color="white", ha="center", va="center")


def _between(axes: Axes, ends_m: tuple[float, float], height: float, text: str, side: str) -> None:
    arrow = {"arrowstyle": "<->", "color": GREY, "lw": 1.0, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", (ends_m[0], height), (ends_m[1], height), arrowprops=arrow)
    place_m = sum(ends_m) / 2.0
    axes.text(place_m, height + 0.14, text, color=GREY, ha=side, va="bottom", linespacing=1.25)


def _code(axes: Axes, at: tuple[float, float], text: str, colour: str, side: str) -> None:
    axes.text(*at, text, color=colour, ha=side, va="center", family="monospace", size=7.5)


def _track(axes: Axes) -> None:
    axes.plot([-260.0, 1640.0], [0.0, 0.0], color="black", lw=2.0)
    axes.plot([GRANTED_M + 20.0, FOULED_M], [-0.42, 0.0], color="black", lw=2.0)
    axes.plot([GRANTED_M - 60.0, GRANTED_M + 20.0], [-0.42, -0.42], color="black", lw=2.0)
    axes.add_patch(
        Rectangle((GRANTED_M, -0.5), FOULED_M - GRANTED_M, 0.6, color="#f0d9a8", zorder=0)
    )
    axes.text(1505.0, 0.22, "fouling section", color=GREY, ha="center")
    width_m = PLATFORM_M[1] - PLATFORM_M[0]
    axes.add_patch(Rectangle((PLATFORM_M[0], 0.66), width_m, 0.2, color="#cfe3d3"))
    axes.text(850.0, 0.76, "platform section", color=STOP, ha="right", va="center")
    _code(axes, (850.0, 0.46), "start_km, end_km", STOP, "right")
    _train(axes, TAIL_M, FRONT_M, FOLLOWER, "follower")
    _train(axes, DANGER_M, LEADER_M, LEADER, "leader")
    _between(axes, (FRONT_M, DELAYED_M), 0.32, "speed x delay_s", "left")
    margin = "safety margin (margin_m)\nor overlap (overlap_m)"
    _between(axes, (EOA_M, DANGER_M), 1.05, margin, "center")
    for mark in MARKS:
        bottom = -1.0 - 0.92 * mark.row
        axes.plot([mark.place_m] * 2, [0.0, -0.55], color=mark.colour, lw=1.1)
        aside_m = mark.place_m + mark.shift_m
        axes.plot([mark.place_m, aside_m], [-0.55, bottom + 0.2], color=mark.colour, lw=1.1)
        axes.text(aside_m, bottom, mark.title, color=mark.colour, ha="center", va="center")
        _code(axes, (aside_m, bottom - 0.34), mark.field, mark.colour, "center")
    axes.set_ylim(-3.4, 1.9)
    axes.axis("off")


def approach_figure() -> Figure:
    """
    Return the drawing.

    Returns
    -------
    Figure
        Speeds above, the track below.
    """
    figure = Figure(figsize=(11.0, 6.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 1.15))
    _speeds(above)
    _track(below)
    above.tick_params(labelbottom=False, length=0.0)
    below.set_xlim(-270.0, 1650.0)
    for place_m, colour in ((EOA_M, PERMISSION), (STOP_M, STOP), (DANGER_M, LEADER)):
        above.axvline(place_m, color=colour, lw=0.6, ls=":")
    return figure


def main() -> None:
    """Write the drawing; a place on the command line stands for the usual one."""
    place = Path(sys.argv[1]) if len(sys.argv) > 1 else PLACE
    with mpl.rc_context(STYLE):
        metadata = {"Date": None} if place.suffix == ".svg" else None
        approach_figure().savefig(place, metadata=metadata, dpi=110)


if __name__ == "__main__":
    main()
