"""What a simulation of radio traffic leaves behind: busy links, and every command."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.radio.cells import Link


class LinkName(NamedTuple):
    """A link: its kind and, where there is one per cell, the cell."""

    kind: Link
    cell: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Traffic:
    """Everything that a simulation leaves behind."""

    links: tuple[LinkName, ...]
    busy: FloatArray
    """Share of each second in which a link is busy. [-], shape (n_links, n_seconds)"""
    made_s: FloatArray
    """When each command was made. [s], shape (n_commands,)"""
    arrived_s: FloatArray
    """When it arrived; not a number if never. [s], shape (n_commands,)"""
    returned_s: FloatArray
    """When its answer was back; not a number if never. [s], shape (n_commands,)"""
    cell: IntArray
    """By which cell it was sent. shape (n_commands,)"""
    to_train: BoolArray
    """Whether it is for a train. shape (n_commands,)"""
    tries: IntArray
    """How often it was sent. shape (n_commands,)"""

    def utilisation(self, kind: Link) -> float:
        """
        Return the mean utilisation of all links of a kind.

        Parameters
        ----------
        kind
            Which links.

        Returns
        -------
        float
            Share of time; not a number if there is no such link. [-]
        """
        rows = [row for row, link in enumerate(self.links) if link.kind is kind]
        return float(self.busy[rows].mean()) if rows else np.nan

    @property
    def round_trips_s(self) -> FloatArray:
        """From the making of a train's command until its answer is back. [s], shape (n,)"""
        taken_s = (self.returned_s - self.made_s)[self.to_train]
        return taken_s[~np.isnan(taken_s)]

    @property
    def sent(self) -> BoolArray:
        """Whether a train's command was ever sent by radio. shape (n,)"""
        return self.tries[self.to_train] > 0

    @property
    def delays_s(self) -> FloatArray:
        """From the making of a train's command to its arrival; inf if never. [s], shape (n,)"""
        taken_s = (self.arrived_s - self.made_s)[self.to_train]
        return np.where(np.isnan(taken_s), np.inf, taken_s)


def busy_shares(starts_s: FloatArray, ends_s: FloatArray, seconds: int) -> FloatArray:
    """
    Return the share of each second that transmissions take.

    Parameters
    ----------
    starts_s, ends_s
        Transmissions, one after the other. [s], shape (n,)
    seconds
        How many seconds, from 0 on. [-]

    Returns
    -------
    FloatArray
        Shares; what lies beyond the last second is left out. [-], shape (n_seconds,)
    """
    edges_s = np.arange(seconds + 1, dtype=np.float64)
    done_s = np.concatenate([[0.0], np.cumsum(ends_s - starts_s)])
    knots_s = np.column_stack([starts_s, ends_s]).ravel()
    values_s = np.column_stack([done_s[:-1], done_s[1:]]).ravel()
    if not knots_s.size:
        return np.zeros(seconds)
    shares: FloatArray = np.diff(np.interp(edges_s, knots_s, values_s))
    return shares
