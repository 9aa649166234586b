"""How long platforms are, and what stations need along the line."""

from math import ceil

from kankaku.scenarios.drafts.meetings import NEAREST_THROAT

PLATFORM_MARGIN_M = 10.0
"""Platforms are longer than the longest train by so much. [m]"""
BEYOND_M = 50.0
"""From a platform to the buffer stop at the end of the line. [m]"""
WAITING_BLOCK_M = 30.0
"""
Who waits between two points has room for itself and a block so long: under step codes a train may
come to a stand as soon as it is in the last block before them. [m]
"""
THROW_S, PROOF_S = 5.0, 1.5
"""Time that points take to throw, and to be proved. [s]"""


def platform_m(train_m: float) -> float:
    """
    Return the length of platforms.

    Parameters
    ----------
    train_m
        Length of the longest train. [m]

    Returns
    -------
    float
        In steps of 5 m. [m]
    """
    return 5.0 * ceil((train_m + PLATFORM_MARGIN_M) / 5.0)


def least_apart_m(train_m: float) -> float:
    """
    Return how far apart stations must be whose trains begin or end where they like.

    Parameters
    ----------
    train_m
        Length of the longest train. [m]

    Returns
    -------
    float
        Between the middles of two stations. [m]
    """
    return platform_m(train_m) + 2.0 * sum(NEAREST_THROAT)
