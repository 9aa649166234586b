"""Keyed random streams: the same key gives the same draws, whatever else is drawn."""

import hashlib

import numpy as np


def stream(seed: int, *key: str | int) -> np.random.Generator:
    """
    Return the random generator of one decision point.

    Parameters
    ----------
    seed
        Seed of the scenario. [-]
    *key
        What is drawn, for whom: ``"dwell", train, station``.

    Returns
    -------
    numpy.random.Generator
        A generator that depends on the seed and the key only.
    """
    text = "\x1f".join([str(seed), *map(str, key)])
    digest = hashlib.sha256(text.encode()).digest()
    words = np.frombuffer(digest, dtype="<u4")
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(words.tolist())))
