"""A line cut into pieces one after the other: circuits or blocks, by route."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import count_up_to, formula
from kankaku.railway.plan.line import Block, Line


class Tiling(NamedTuple):
    """The pieces of track along every route, one route after the other."""

    first: IntArray
    """Where each route begins in the other arrays, and their end. shape (n_routes + 1,)"""
    piece: IntArray
    """Number of the piece among all pieces of the line. shape (n_places,)"""
    start_m: FloatArray
    """[m], shape (n_places,)"""
    end_m: FloatArray
    """[m], shape (n_places,)"""


def tiling_of(line: Line, pieces: Sequence[Block], routes: Sequence[tuple[str, ...]]) -> Tiling:
    """
    Return the pieces of a line as the trains of some routes meet them.

    Parameters
    ----------
    line
        The line.
    pieces
        Blocks or circuits. Those of a track that is used both ways occur once by direction.
    routes
        Tracks of each route, in order.

    Returns
    -------
    Tiling
        The pieces of every route, one after the other.
    """
    on_track: dict[str, list[int]] = {track: [] for track in line.track_by_id}
    first_of: dict[str, int] = {}
    for number, piece in enumerate(pieces):
        on_track[piece.track].append(number)
        first_of.setdefault(piece.id, number)
    numbers = [[number for track in route for number in on_track[track]] for route in routes]
    ends = np.cumsum([0, *map(len, numbers)])
    flat = [number for route in numbers for number in route]
    return Tiling(
        ends.astype(np.intp),
        # The same piece, whichever way it is passed.
        np.array([first_of[pieces[number].id] for number in flat], dtype=np.intp),
        np.array([pieces[number].start_m for number in flat]),
        np.array([pieces[number].end_m for number in flat]),
    )


@formula
def place_of(tiling: Tiling, route: int, chainage_m: float) -> int:
    """
    Return the place in a tiling that holds a chainage.

    Parameters
    ----------
    tiling
        Circuits or blocks.
    route
        Which route.
    chainage_m
        Where; a boundary belongs to the piece ahead. [m]

    Returns
    -------
    int
        The place; the first of the route for a chainage before it.
    """
    first, last = tiling.first[route], tiling.first[route + 1]
    place: int = first + max(count_up_to(tiling.start_m[first:last], chainage_m) - 1, 0)
    return place


@formula
def place_of_front(tiling: Tiling, route: int, front_m: float) -> int:
    """
    Return the place in a tiling that a front stands in.

    Parameters
    ----------
    tiling
        Circuits or blocks.
    route
        Which route.
    front_m
        Front; one exactly at a boundary has not passed it. [m]

    Returns
    -------
    int
        The place.
    """
    place = place_of(tiling, route, front_m)
    if place > tiling.first[route] and tiling.start_m[place] == front_m:
        place -= 1
    return place
