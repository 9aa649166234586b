"""Five figures make a train: what else a run needs follows from them."""

from collections.abc import Mapping
from math import isfinite
from typing import NamedTuple

from kankaku.railway.errors import suggesting
from kankaku.scenarios.drafts.stock_library import LibraryTrain

OPTION = "--train-figures"
NAME = "own_train"
CAR_M = 20.0
ROTATING = 0.08
"""Of the mass: electric multiple units. [-]"""
POWER_FROM, WEAKER_FROM = 0.45, 0.75
"""Shares of the greatest speed: constant power from the one on, less from the other on. [-]"""


class _Figure(NamedTuple):
    least: float
    most: float
    what: str


FIGURES: Mapping[str, _Figure] = {
    "length_m": _Figure(10.0, 900.0, "length"),
    "mass_t": _Figure(5.0, 20000.0, "mass as loaded"),
    "speed_kmh": _Figure(15.0, 400.0, "greatest speed"),
    "acceleration_mps2": _Figure(0.05, 2.5, "starting acceleration"),
    "brake_mps2": _Figure(0.2, 2.5, "service brake"),
}
EXAMPLE = "length_m=120,mass_t=240,speed_kmh=80,acceleration_mps2=1.0,brake_mps2=1.0"


class FiguresRead(NamedTuple):
    """A train, or what is wrong with its figures."""

    train: LibraryTrain | None
    mistakes: tuple[str, ...]


def train_of_figures(told: str) -> FiguresRead:
    """
    Make a train of five figures.

    Parameters
    ----------
    told
        ``length_m=120,mass_t=240,speed_kmh=80,acceleration_mps2=1.0,brake_mps2=1.0``.

    Returns
    -------
    FiguresRead
        The train with everything that a run needs, and what of it was derived; or every mistake.
    """
    figures: dict[str, float] = {}
    mistakes = []
    for part in filter(None, (piece.strip() for piece in told.split(","))):
        name, _, text = (piece.strip() for piece in part.partition("="))
        known = FIGURES.get(name)
        if known is None:
            allowed = suggesting(name, [*FIGURES], ", ".join(FIGURES))
            mistakes.append(f"{OPTION}: unknown figure {name!r}; allowed: {allowed}")
            continue
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not isfinite(value) or not known.least <= value <= known.most:
            allowed = f"{known.least:g} to {known.most:g}"
            mistakes.append(f"{OPTION}: {name} is {text!r}; allowed: {allowed}")
        figures[name] = value
    missing = [name for name in FIGURES if name not in figures]
    if missing:
        mistakes.append(f"{OPTION}: {', '.join(missing)} missing; allowed: all five, {EXAMPLE}")
    if mistakes:
        return FiguresRead(None, tuple(mistakes))
    return FiguresRead(_train(figures), ())


def _train(figures: Mapping[str, float]) -> LibraryTrain:
    mass_t, speed_kmh = figures["mass_t"], figures["speed_kmh"]
    force_kn = round(mass_t * (1.0 + ROTATING) * figures["acceleration_mps2"], 1)
    entry = {
        "cars": max(round(figures["length_m"] / CAR_M), 1),
        "length_m": figures["length_m"],
        "mass_t": mass_t,
        "rotating_mass_percent": 100.0 * ROTATING,
        "maximum_speed_kmh": speed_kmh,
        "service_brake_kmhps": round(3.6 * figures["brake_mps2"], 3),
        "jerk_mps3": 0.8,
        "brake_build_up_s": 1.0,
        "traction": {
            "starting_force_kn": force_kn,
            "power_speed_kmh": round(POWER_FROM * speed_kmh, 1),
            "characteristic_speed_kmh": round(WEAKER_FROM * speed_kmh, 1),
        },
    }
    said = ", ".join(f"{figure.what} {figures[name]:g}" for name, figure in FIGURES.items())
    assumed = (
        f"starting force {force_kn:g} kN from the acceleration and {100.0 * ROTATING:g} % of "
        f"rotating masses; constant power from {100.0 * POWER_FROM:g} % of the greatest "
        f"speed, less from {100.0 * WEAKER_FROM:g} %; jerk 0.8 m/s3, build-up of the brake 1 s; "
        "the rest as scenarios have it where nothing is said"
    )
    return LibraryTrain(NAME, "a train of five figures", f"{OPTION}: {said}", "", assumed, entry)
