"""The track plan of a network: tracks, points and platforms, stretched where much is close by."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from kankaku.railway.plan.line import Direction, Line, Platform, Track
from kankaku.railway.plan.routing import onward

INCHES_PER_LEVEL = 0.55
INCHES_PER_M = 0.0016
ROW = 9000.0
"""A row is about this long, stretches cut short. [m]"""
CHARACTER_M = 27.0
"""A character of a track's name is about this wide. [m]"""
FEW_TRACKS = 12
"""Of so few directed tracks all are named, however little room there is."""
LONGEST_M = 400.0
"""A stretch with nothing on it is drawn no longer than this. [m]"""
ARROWS = {(True, False): ">", (False, True): "<", (True, True): "<>"}
TRACK, POINTS, PLATFORM = "#333333", "#D55E00", "#9ecae1"


def track_plan_figure(line: Line, *, window_m: tuple[float, float] | None = None) -> Figure:
    """
    Draw the tracks of a network.

    Parameters
    ----------
    line
        A network.
    window_m
        Only what lies between two chainages; the whole line where None. [m]

    Returns
    -------
    Figure
        Chainage from left to right, the left track of rising trains on top; not to scale.
    """
    whole = _Scale(line, [t for t in line.network if _inside(line, t, window_m)])
    rows = max(round(whole.length / ROW), 1)
    windows_m = whole.cut(rows)
    levels = [track.across for track in line.network]
    height = INCHES_PER_LEVEL * (max(levels) - min(levels) + 3.2)
    width = min(max(INCHES_PER_M * whole.length / rows, 6.0), 16.0)
    figure = Figure(figsize=(width, height * rows))
    panels = figure.subplots(rows, 1, squeeze=False)[:, 0]
    for axes, row_m in zip(panels, windows_m, strict=True):
        _draw_row(axes, line, row_m, (min(levels), max(levels)))
    figure.tight_layout(pad=0.2)
    return figure


def _draw_row(
    axes: Axes, line: Line, window_m: tuple[float, float], levels: tuple[float, float]
) -> None:
    tracks = [track for track in line.network if _inside(line, track, window_m)]
    scale = _Scale(line, tracks, window_m)
    _draw_tracks(axes, line, tracks, scale)
    _draw_points(axes, line, tracks, scale)
    _draw_platforms(axes, line, tracks, scale)
    axes.set_ylim(levels[1] + 1.5, levels[0] - 1.4)
    axes.set_xlim(-0.02 * scale.length, 1.02 * scale.length)
    axes.set_axis_off()


def _inside(line: Line, track: Track, window_m: tuple[float, float] | None) -> bool:
    start_m, end_m = _ends_m(line, track)
    return window_m is None or (start_m < window_m[1] and end_m > window_m[0])


def _ends_m(
    line: Line, track: Track | Platform, *, falling: bool | None = None
) -> tuple[float, float]:
    """Return the chainages between which something lies, told by track or platform. [m]"""
    if isinstance(track, Track):
        falling = track.direction is Direction.FALLING
    if falling:
        return line.mirrored_m(track.end_m), line.mirrored_m(track.start_m)
    return track.start_m, track.end_m


class _Scale:
    """Places on the drawing by chainage: long stretches with nothing on them are cut short."""

    def __init__(
        self, line: Line, tracks: Sequence[Track], window_m: tuple[float, float] | None = None
    ) -> None:
        places = {place_m for track in tracks for place_m in _ends_m(line, track)}
        places |= {
            place_m
            for turnout in line.turnouts
            for place_m in (turnout.fouling_start_m, turnout.fouling_end_m)
            if min(places) < place_m < max(places)
        }
        named = {track.id: track for track in tracks}
        for platform in line.platforms:
            if platform.track in named:
                falling = named[platform.track].direction is Direction.FALLING
                places |= set(_ends_m(line, platform, falling=falling))
        if window_m is not None:
            # A track that leaves the window ends at its edge.
            places = {place_m for place_m in places if window_m[0] < place_m < window_m[1]}
            places |= set(window_m)
        self._places_m = np.array(sorted(places))
        drawn = np.minimum(np.diff(self._places_m), LONGEST_M)
        self._at = np.concatenate([[0.0], np.cumsum(drawn)])
        self.length = float(self._at[-1])

    def cut(self, rows: int) -> list[tuple[float, float]]:
        """Return chainages between which rows of equal length lie. [m]"""
        cuts = np.interp(np.linspace(0.0, self.length, rows + 1), self._at, self._places_m)
        return list(pairwise(cuts.tolist()))

    def __call__(self, place_m: float) -> float:
        return float(np.interp(place_m, self._places_m, self._at))


def _draw_tracks(axes: Axes, line: Line, tracks: Sequence[Track], scale: _Scale) -> None:
    zone = {turnout.node: turnout for turnout in line.turnouts}
    ways: dict[str, list[Track]] = {}
    for track in tracks:
        ways.setdefault(track.physical, []).append(track)
    for name, both in ways.items():
        track = both[0]
        start_m, end_m = _ends_m(line, track)
        low, high = track.from_node, track.to_node
        if track.direction is Direction.FALLING:
            low, high = high, low
        from_m = zone[low].fouling_end_m if low in zone else start_m
        to_m = zone[high].fouling_start_m if high in zone else end_m
        axes.plot([scale(from_m), scale(to_m)], [track.across] * 2, color=TRACK, lw=1.4)
        if not _goes_on(line, low):
            axes.plot([scale(start_m)] * 2, track.across + np.array([-0.18, 0.18]), color=TRACK)
        if not _goes_on(line, high):
            axes.plot([scale(end_m)] * 2, track.across + np.array([-0.18, 0.18]), color=TRACK)
        directions = {one.direction for one in both}
        arrow = ARROWS[Direction.RISING in directions, Direction.FALLING in directions]
        left, right = scale(from_m), scale(to_m)
        label = f"{name} {arrow}"
        if right - left > CHARACTER_M * len(label) or len(tracks) < FEW_TRACKS:
            place = 0.5 * (left + right), track.across + 0.34
            words: Any = {"ha": "center", "va": "center", "fontsize": 6.0, "color": "#666666"}
            axes.text(*place, label, **words)


def _goes_on(line: Line, node: str) -> bool:
    begins = {track.from_node for track in line.network}
    ends = {track.to_node for track in line.network}
    sides = [(t.from_node, t.to_node) for t in line.network if node in {t.from_node, t.to_node}]
    others = {name for pair in sides for name in pair} - {node}
    return node in begins and node in ends and len(others) > 1


def _draw_points(axes: Axes, line: Line, tracks: Sequence[Track], scale: _Scale) -> None:
    """Draw every movement through points, and at joints."""
    drawn = {track.id for track in tracks}
    zone = {turnout.node: turnout for turnout in line.turnouts}
    for before, after in _movements(line):
        node = before.to_node
        if before.id not in drawn or after.id not in drawn or node not in zone:
            continue
        points = zone[node]
        west, east = before, after
        if before.direction is Direction.FALLING:
            west, east = after, before
        ends = [scale(points.fouling_start_m), scale(points.fouling_end_m)]
        axes.plot(ends, [west.across, east.across], color=POINTS, lw=1.1)


def _movements(line: Line) -> Iterator[tuple[Track, Track]]:
    for name, following in onward(line).items():
        for after in following:
            yield line.track_by_id[name], line.track_by_id[after]


def _draw_platforms(axes: Axes, line: Line, tracks: Sequence[Track], scale: _Scale) -> None:
    named = {track.id: track for track in tracks}
    labels: dict[str, list[float]] = {}
    for platform in line.platforms:
        track = named.get(platform.track)
        if track is None:
            continue
        falling = track.direction is Direction.FALLING
        start_m, end_m = _ends_m(line, platform, falling=falling)
        stop_m = line.mirrored_m(platform.stop_m) if falling else platform.stop_m
        left, right = scale(start_m), scale(end_m)
        if right - left < 0.5 * (end_m - start_m):
            # It lies in another row.
            continue
        corner = left, track.across - 0.3
        axes.add_patch(Rectangle(corner, right - left, 0.16, color=PLATFORM, lw=0.0))
        axes.plot([scale(stop_m)] * 2, track.across + np.array([-0.12, 0.12]), color=TRACK, lw=0.8)
        labels.setdefault(platform.station, []).append(0.5 * (left + right))
    top = min(track.across for track in tracks) - 0.85
    rows = sorted(labels.items(), key=lambda item: float(np.mean(item[1])))
    last = -np.inf
    for number, (station, places) in enumerate(rows):
        place = float(np.mean(places))
        crowded = place - last < 0.09 * scale.length and number % 2 == 1
        name = line.station_by_id[station].name
        axes.text(place, top - (0.35 if crowded else 0.0), name, ha="center", fontsize=8.0)
        last = place
