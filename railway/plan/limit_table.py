"""The limits in force of all train types in one table, laid out as the brake potential."""

from typing import NamedTuple

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import formula


class LimitTable(NamedTuple):
    """
    Pieces of constant limit, one train type after the other; arrays of shape (n_pieces,).

    Places are those of :class:`kankaku.railway.plan.brake_table.BrakeTable`: a front that is a
    metre further on is a place further on.
    """

    start: FloatArray
    """Place where each piece begins; the last one of a type is the end of its tables. [m]"""
    limit_mps: FloatArray
    """[m/s]"""
    lowest_v2_m2ps2: FloatArray
    """Twice the lowest energy, brake potential included, from each piece on. [m2/s2]"""
    lowest_mps: FloatArray
    """The limit of the piece that has it. [m/s]"""
    first: IntArray
    """The piece at each point of the grid. shape (n_types * n_grid,)"""


@formula
def piece_at(limits: LimitTable, place: float) -> int:
    """
    Return the piece that a front is in.

    Parameters
    ----------
    limits
        From :attr:`kankaku.railway.plan.profile.Profile.limit_table`.
    place
        Place of the front, by :func:`kankaku.railway.plan.brake_table.place_of`. [m]

    Returns
    -------
    int
        Its number.
    """
    piece = limits.first[int(place)]
    while limits.start[piece + 1] <= place:
        piece += 1
    return int(piece)
