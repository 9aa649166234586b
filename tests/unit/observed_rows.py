"""Observed events made for tests: trains with dwells of known quantiles and correlation."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.special import ndtr

from kankaku.railway.arrays import FloatArray
from kankaku.scenarios.reading.units import clock_of

STATIONS = ("first", "middle", "last")
RUN_S = 120.0


def scores(trains: int, stations: int, correlation: float, seed: int) -> FloatArray:
    """Return normal scores along trips. shape (trains, stations)."""
    fresh = np.random.default_rng(seed).standard_normal((trains, stations))
    drawn = fresh.copy()
    for at in range(1, stations):
        drawn[:, at] = correlation * drawn[:, at - 1] + np.sqrt(1 - correlation**2) * fresh[:, at]
    return drawn


def exponential_s(drawn: FloatArray, least_s: FloatArray, mean_s: FloatArray) -> FloatArray:
    """Return dwells that are a least one and an exponential delay. shape as of the scores. [s]"""
    dwells_s: FloatArray = least_s - mean_s * np.log1p(-ndtr(drawn))
    return dwells_s


def event_text(
    dwells_s: FloatArray, stations: Sequence[str] = STATIONS, *, every_s: float = 40.0
) -> str:
    """
    Return a table of events, to a thousandth of a second, of trains on a new day after 700 each.

    Before the first station they begin at ``depot`` and beyond the last they end at ``yard``.
    """
    lines = ["date,train,direction,station,arrival,departure"]
    for number, own_s in enumerate(dwells_s):
        day = f"2026-{1 + number // 700 // 28:02d}-{1 + number // 700 % 28:02d}"
        now_s = 6 * 3600 + every_s * (number % 700)
        for station, dwell_s in zip(("depot", *stations, "yard"), (1.0, *own_s, 1.0), strict=True):
            went_s = now_s + dwell_s
            cells = [day, f"T{number}", "up", station, stamp(day, now_s), stamp(day, went_s)]
            lines.append(",".join(cells))
            now_s = went_s + RUN_S
    return "\n".join(lines) + "\n"


def stamp(day: str, time_s: float) -> str:
    """Return a time with its date, to a thousandth of a second."""
    whole_s, thousandths = divmod(round(1000.0 * time_s), 1000)
    return f"{day}T{clock_of(whole_s)}.{thousandths:03d}"


def write_events(file: Path, text: str) -> Path:
    """Write a table of events."""
    file.write_text(text, encoding="utf-8")
    return file
