"""What all figures share: colours, clock and station axes, files that can be reproduced."""

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager, get_font
from matplotlib.text import Text
from matplotlib.ticker import FixedLocator, FuncFormatter, MultipleLocator

from kankaku.analysis.tables.columns import columns_by_train, write_whole
from kankaku.analysis.words import clock
from kankaku.railway.arrays import FloatArray

# fmt: off
PALETTE = (
    "#0072B2", "#D55E00", "#009E73", "#AA4499", "#56B4E9", "#E69F00", "#332288", "#693C00",
    "#0000E1", "#A569FF", "#4B4B5A", "#3C2D3C", "#785A3C", "#A5C387", "#7887C3", "#5A1E00",
    "#961EFF", "#6900B4", "#FF3C78", "#87C3D2", "#A50F78", "#D2873C", "#8796FF", "#C31ED2",
)
# fmt: on
"""
Okabe and Ito, *Color Universal Design*, 2008, with two purples of Tol's muted scheme; then each
time the colour that is farthest from all before it for whoever sees it least, in Oklab, by normal
sight and without one kind of cones (Machado, Oliveira and Fernandes 2009).
"""
OF_ONE_DASH = 8
"""So many controllers share a line style. [-]"""
DASHES: tuple[str | tuple[float, tuple[float, ...]], ...] = (
    "solid",
    (0, (4, 1.5)),
    (0, (1, 1)),
    (0, (6, 1.5, 1, 1.5)),
    (0, (2.5, 2.5)),
)
"""Line styles: beyond eight colours nobody tells lines apart by the colour alone."""
MARKERS = ("o", "s", "^", "D", "v")
"""Markers: their number and that of the colours have no common divisor."""
BOOKED = "#A6A6A6"
STOP = "#111111"
GRID = "#E9E9E9"
INK = "#333333"
FONT = Path(__file__).parent / "fonts" / "NotoSansJPSubset-Regular.ttf"
"""The characters of JIS X 0208 from Noto Sans JP, under the licence beside it."""
BOLD = 700
NO_LETTER = "□"
JAPANESE = "Noto Sans JP Subset"
STYLE: dict[Any, Any] = {
    "axes.edgecolor": "#999999",
    "axes.labelcolor": INK,
    "axes.linewidth": 0.6,
    "axes.titlesize": 10.0,
    # Who looks for a glyph looks in this order.
    "font.family": ["DejaVu Sans", JAPANESE],
    "font.size": 8.0,
    "legend.frameon": False,
    "path.simplify_threshold": 0.2,
    "svg.hashsalt": "kankaku",
    "text.color": INK,
    # A name with a dollar sign is no formula.
    "text.parse_math": False,
    "xtick.color": INK,
    "ytick.color": INK,
}
PNG_DPI = 160
_TIMELESS: dict[str, dict[str, str | None]] = {
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}
"""What leaves out of a file when it was drawn."""
_CLOCK_STEPS_S = (60, 120, 300, 600, 900, 1800, 3600, 7200, 14400)


@contextmanager
def style() -> Iterator[None]:
    """Draw in the style of the project, and leave matplotlib as it was."""
    if not any(font.name == JAPANESE for font in fontManager.ttflist):
        fontManager.addfont(FONT)
        # There is one weight of it; who asks for a bold one gets that without a complaint.
        (own,) = (font for font in fontManager.ttflist if font.name == JAPANESE)
        fontManager.ttflist.append(replace(own, weight=BOLD))
    with mpl.rc_context(STYLE):
        yield


def colour(index: int) -> str:
    """
    Return a controller's colour.

    Parameters
    ----------
    index
        Place of the controller in its scenario. [-]

    Returns
    -------
    str
        A colour that stays distinct to colour-blind readers; the same one as that of another
        controller only if there are more than 24, with another line style and marker then.
    """
    return PALETTE[index % len(PALETTE)]


def marker(index: int) -> str:
    """
    Return a controller's marker.

    Parameters
    ----------
    index
        Place of the controller in its scenario. [-]

    Returns
    -------
    str
        With its colour one that no other of 120 controllers has.
    """
    return MARKERS[index % len(MARKERS)]


def dashes(index: int) -> str | tuple[float, tuple[float, ...]]:
    """
    Return a controller's line style.

    Parameters
    ----------
    index
        Place of the controller in its scenario. [-]

    Returns
    -------
    str | tuple[float, tuple[float, ...]]
        Solid for the first eight; with its colour one that no other of 120 controllers has.
    """
    return DASHES[(index // OF_ONE_DASH + index // len(PALETTE)) % len(DASHES)]


def clock_axis(axes: Axes, start_s: float, end_s: float, *, ticks: int = 9) -> None:
    """
    Make the horizontal axis a clock.

    Parameters
    ----------
    axes
        Whose axis.
    start_s, end_s
        Seconds after midnight. [s]
    ticks
        How many ticks at most. [-]
    """
    step_s = next(
        (step for step in _CLOCK_STEPS_S if (end_s - start_s) / step <= ticks), _CLOCK_STEPS_S[-1]
    )
    axes.set_xlim(start_s, end_s)
    axes.xaxis.set_major_locator(MultipleLocator(step_s))
    axes.xaxis.set_major_formatter(FuncFormatter(clock))


def spread(places: FloatArray, gap: float) -> FloatArray:
    """
    Move labels apart just as far as they need.

    Parameters
    ----------
    places
        Where the labels belong, rising. shape (n,)
    gap
        Smallest distance between two labels. Same unit

    Returns
    -------
    FloatArray
        Places at least ``gap`` apart with the least sum of squared moves. shape (n,)

    References
    ----------
    .. [1] Ayer et al., *An empirical distribution function for sampling with incomplete
       information*, Ann. Math. Stat. 26, 1955: pool adjacent violators.
    """
    pools: list[tuple[float, int]] = []
    for index, place in enumerate(places.tolist()):
        pools.append((place - index * gap, 1))
        while len(pools) > 1 and pools[-2][0] > pools[-1][0]:
            (value, count), (other, others) = pools.pop(), pools.pop()
            total = count + others
            pools.append(((value * count + other * others) / total, total))
    flat = np.concatenate([np.full(count, value) for value, count in pools] or [np.zeros(0)])
    moved: FloatArray = flat + gap * np.arange(flat.size)
    return moved


def station_axis(axes: Axes, stations: pd.DataFrame, *, labels: bool, gap_m: float) -> None:
    """
    Write station names at their chainage on the vertical axis, with a faint line each.

    Parameters
    ----------
    axes
        Whose axis.
    stations
        The table ``stations``, or a part of it.
    labels
        Write the names; else only the lines.
    gap_m
        Smallest distance between two names. [m]
    """
    chainage_m = stations["chainage_m"].to_numpy()
    axes.yaxis.set_major_locator(FixedLocator(chainage_m.tolist()))
    axes.tick_params(axis="y", labelleft=False, length=0)
    axes.grid(axis="y", color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    if not labels:
        return
    across = axes.get_yaxis_transform()
    for name, place, text_m in zip(
        stations["name"], chainage_m, spread(chainage_m, gap_m), strict=True
    ):
        axes.plot(
            [-0.022, -0.008, 0.0],
            [text_m, place, place],
            transform=across,
            color="#999999",
            linewidth=0.5,
            clip_on=False,
        )
        axes.text(-0.026, text_m, name, transform=across, ha="right", va="center", fontsize=7.0)


def plain_frame(axes: Axes) -> None:
    """
    Lay a faint grid below the lines, and leave away the frame where there is no scale.

    Parameters
    ----------
    axes
        Whose.
    """
    axes.grid(color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def draw_booked(axes: Axes, calls: pd.DataFrame, *, label: str) -> None:
    """
    Draw the booked lines thin and grey.

    Parameters
    ----------
    axes
        Where.
    calls
        The table ``calls`` of any run.
    label
        Entry of the legend.
    """
    names = "booked_arrival_s", "booked_departure_s", "stop_m"
    for index, (_, (*times_s, stop_m)) in enumerate(columns_by_train(calls, *names)):
        axes.plot(
            np.column_stack(times_s).ravel(),
            np.repeat(stop_m, 2),
            color=BOOKED,
            linewidth=0.6,
            label="_" if index else label,
            zorder=1.5,
        )


@cache
def _known_letters() -> frozenset[int]:
    """Return the characters that can be drawn."""
    files = (FONT, fontManager.findfont("DejaVu Sans"))
    return frozenset(code for file in files for code in get_font(str(file)).get_charmap())


def drawable(text: str) -> str:
    """
    Return a text as it can be drawn.

    Parameters
    ----------
    text
        Any text, a stranger's too.

    Returns
    -------
    str
        The same with a box for each character that no font of ours has.
    """
    known = _known_letters()
    return "".join(c if c == "\n" or ord(c) in known else NO_LETTER for c in text)


def write_figure(
    figure: Figure, stem: Path, formats: Sequence[str] = ("png", "svg")
) -> tuple[Path, ...]:
    """
    Write a figure, by default as PNG and SVG, the same bytes every time.

    Parameters
    ----------
    figure
        The figure.
    stem
        Path without suffix.
    formats
        Which files: ``png``, ``svg``, ``pdf``.

    Returns
    -------
    tuple[Path, ...]
        The files.
    """
    for text in figure.findobj(Text):
        assert isinstance(text, Text)  # noqa: S101 - that is what was looked for
        text.set_text(drawable(text.get_text()))
    files = []
    for kind in formats:
        metadata = _TIMELESS.get(kind, {})
        buffer = io.BytesIO()
        with style():
            figure.savefig(buffer, format=kind, dpi=PNG_DPI, metadata=metadata)
        file = stem.with_suffix(f".{kind}")
        write_whole(file, buffer.getvalue())
        files.append(file)
    return tuple(files)
