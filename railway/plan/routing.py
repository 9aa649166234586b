"""Ways through a network: from track to track in the running direction, as straight as can be."""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import NamedTuple

from kankaku.railway.plan.line import Line, Track

SAME = 1e-9


class StraightWay(NamedTuple):
    """The straightest way from one track to another."""

    tracks: tuple[str, ...]
    """Both ends included; empty if there is none."""
    others: int
    """Ways that are just as straight. [-]"""


def onward(line: Line) -> Mapping[str, tuple[str, ...]]:
    """
    Return where trains can go on to.

    Parameters
    ----------
    line
        A network.

    Returns
    -------
    Mapping[str, tuple[str, ...]]
        Tracks behind each track: any at points, at a joint the one of the same place across.
    """
    at_points = {turnout.node for turnout in line.turnouts}
    begins: dict[str, list[Track]] = {}
    for track in line.network:
        begins.setdefault(track.from_node, []).append(track)
    return {
        track.id: tuple(
            after.id
            for after in begins.get(track.to_node, ())
            if after.direction is track.direction
            and (track.to_node in at_points or after.across == track.across)
        )
        for track in line.network
    }


def straightest(line: Line, origin: str, destination: str) -> StraightWay:
    """
    Return the straightest way from one track to another.

    Parameters
    ----------
    line
        A network.
    origin, destination
        Its tracks.

    Returns
    -------
    StraightWay
        The one with the least changes of place across, summed up.
    """
    behind, track_of = onward(line), line.track_by_id
    end_m = track_of[destination].start_m

    @cache
    def best(track: str) -> tuple[float, int, tuple[str, ...]]:
        """Return cost, count and tracks of the straightest ways on from a track."""
        if track == destination:
            return 0.0, 1, (track,)
        if track_of[track].start_m >= end_m:
            return float("inf"), 0, ()
        least, count, found = float("inf"), 0, tuple[str, ...]()
        for after in behind[track]:
            aside, ways, tracks = best(after)
            cost = aside + abs(track_of[after].across - track_of[track].across)
            if ways and cost < least - SAME:
                least, count, found = cost, ways, (track, *tracks)
            elif ways and cost <= least + SAME:
                count += ways
        return least, count, found

    _, count, tracks = best(origin)
    return StraightWay(tracks, max(count - 1, 0))


def joined(ways: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """
    Return ways one after the other.

    Parameters
    ----------
    ways
        Each begins with the track that the one before ends with.

    Returns
    -------
    tuple[str, ...]
        Every track once; empty if one of the ways is.
    """
    if not all(ways):
        return ()
    return (ways[0][0], *(track for way in ways for track in way[1:]))
