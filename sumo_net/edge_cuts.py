"""Tracks cut into the edges of SUMO's network."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kankaku.railway.plan.line import Line
from kankaku.sumo_net import names

BEYOND_STOP_M = 1.0
"""Track that SUMO is given beyond a stop at the end of a track. [m]"""


SIGNAL_BEYOND_STOP_M = 1.0
"""Least distance from a stop position to the signal that it waits at. [m]"""


SHORTEST_EDGE_M = 1.0
"""Limits that begin nearer to another cut begin there. [m]"""


@dataclass(frozen=True, slots=True)
class Edge:
    """A stretch of one track without a signal inside, and of one speed limit."""

    id: str
    section: int
    track_index: int
    start_m: float
    end_m: float
    from_node: str
    to_node: str
    limit_mps: float
    at_signal: bool
    """It begins at a signal within the track."""

    @property
    def length_m(self) -> float:
        """Length in metres, to the millimetre."""
        return round(self.end_m - self.start_m, 3)


def cut_tracks(line: Line) -> Mapping[str, tuple[Edge, ...]]:
    """
    Cut each track at its signals, and where its speed limit changes.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    Mapping[str, tuple[Edge, ...]]
        Edges by track, in running direction.
    """
    edges: dict[str, tuple[Edge, ...]] = {}
    joints_m = joints(line)
    for section, stretch in enumerate(line.sections):
        ends_m = joints_m[section], joints_m[section + 1]
        for index, track in enumerate(stretch.tracks):
            signals_m = _signals_m(line, track.id, ends_m)
            cuts = _with_limits(line, [ends_m[0], *signals_m, ends_m[1]])
            inner = [
                (names.signal_node if cut_m in signals_m else names.limit_node)(track.id, count)
                for count, cut_m in enumerate(cuts[1:-1], start=1)
            ]
            nodes = [names.section_node(section), *inner, names.section_node(section + 1)]
            edges[track.id] = tuple(
                Edge(
                    id=names.edge(track.id, count),
                    section=section,
                    track_index=index,
                    start_m=round(start_m, 3),
                    end_m=round(end_m, 3),
                    from_node=nodes[count],
                    to_node=nodes[count + 1],
                    limit_mps=_limit_mps(line, 0.5 * (start_m + end_m)),
                    at_signal=start_m in signals_m,
                )
                for count, (start_m, end_m) in enumerate(pairwise(cuts))
            )
    return edges


def joints(line: Line) -> list[float]:
    """
    Return where SUMO's sections begin and end: past stops that lie at the end of a track.

    A front may stand half a metre beyond the aimed position, and SUMO begins the stop only on
    the edge that holds it.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    list[float]
        Start of each section, then the end of the last one. [m]
    """
    joints_m = [line.start_m]
    for section in line.sections:
        tracks = {track.id for track in section.tracks}
        stops_m = [place.stop_m for place in line.platforms if place.track in tracks]
        near_m = [stop_m for stop_m in stops_m if stop_m + STOP_TOLERANCE_M > section.end_m]
        past_m = max(near_m, default=-np.inf) + BEYOND_STOP_M
        joints_m.append(max(section.end_m, past_m))
    return joints_m


def _signals_m(line: Line, track: str, ends_m: tuple[float, float]) -> list[float]:
    stops_m = sorted(platform.stop_m for platform in line.platforms if platform.track == track)
    signals_m: set[float] = set()
    for block in line.blocks:
        if block.track == track:
            for end_m in (block.start_m, block.end_m):
                signal_m = end_m
                # A front within the tolerance of its stop must not be past the signal.
                for stop_m in stops_m:
                    if abs(signal_m - stop_m) < SIGNAL_BEYOND_STOP_M:
                        signal_m = stop_m + SIGNAL_BEYOND_STOP_M
                signals_m.add(signal_m)
    first_m = ends_m[0] + SIGNAL_BEYOND_STOP_M
    last_m = ends_m[1] - SIGNAL_BEYOND_STOP_M
    return sorted(signal for signal in signals_m if first_m < signal < last_m)


def _with_limits(line: Line, cuts_m: list[float]) -> list[float]:
    changes_m = {at_m for limit in line.limits for at_m in (limit.start_m, limit.end_m)}
    clear_m = [
        change_m
        for change_m in changes_m
        if cuts_m[0] < change_m < cuts_m[-1]
        and min(abs(change_m - cut_m) for cut_m in cuts_m) >= SHORTEST_EDGE_M
    ]
    return sorted([*cuts_m, *clear_m])


def _limit_mps(line: Line, place_m: float) -> float:
    here = [limit for limit in line.limits if limit.start_m <= place_m < limit.end_m]
    return min((limit.limit_mps for limit in here), default=EDGE_SPEED_MPS)


def edge_of_stop(edges: Mapping[str, tuple[Edge, ...]], track: str, stop_m: float) -> Edge:
    """
    Return the edge on which a train stops.

    Parameters
    ----------
    edges
        Edges by track.
    track
        Identifier of the track.
    stop_m
        Chainage of the stop position. [m]

    Returns
    -------
    Edge
        The edge that holds the stop position and the tolerance on both sides.

    Raises
    ------
    ValueError
        If there is none.
    """
    first_m, last_m = stop_m - STOP_TOLERANCE_M, stop_m + STOP_TOLERANCE_M
    for edge in edges[track]:
        if edge.start_m <= first_m and last_m <= edge.end_m:
            return edge
    msg = (
        f"the stop position {stop_m:.2f} m on track {track} is closer than {STOP_TOLERANCE_M} m "
        "to the track's end or to the signal behind it"
    )
    raise ValueError(msg)


EDGE_SPEED_MPS = 150.0
"""Speed limit of an edge without one. [m/s]"""


STOP_TOLERANCE_M = 0.5
"""A front this far before or beyond the aimed stop position starts the stop. [m]"""
