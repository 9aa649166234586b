"""Cross-checks of train types, and of limits that are those of one train type."""

from collections.abc import Iterator
from itertools import pairwise

from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.reading.mistakes import Mistake, meant
from kankaku.scenarios.reading.schema import (
    ResistanceEntry,
    RollingStockFile,
    TractionEntry,
    TrainEntry,
)

FAMILIES = (
    ("a_n", "b_nspm", "c_ns2pm2"),
    ("a_kn", "b_kn_per_kmh", "c_kn_per_kmh2"),
    ("a_n_per_t", "b_n_per_t_kmh", "c_n_per_t_kmh2"),
)
"""Coefficients of running resistance that go together."""
TOLD = " or ".join(", ".join(family) for family in FAMILIES)
WAYS = "starting_force_kn with power_kw or power_speed_kmh, or force_speed alone"

Told = tuple[str, str, str]
"""Key below the train type, problem, and what is allowed."""


def rolling_stock_mistakes(stock: RollingStockFile, file: str) -> list[Mistake]:
    """
    Return contradictions within the train types.

    Parameters
    ----------
    stock
        The train types.
    file
        Name of their file.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    return [
        Mistake(file, f"train.{name}.{key}", problem, allowed)
        for name, train in stock.train.items()
        for told in (_train_mistakes, _resistance_mistakes, _traction_mistakes)
        for key, problem, allowed in told(train)
    ]


def limit_mistakes(line: LineTables, stock: RollingStockFile) -> list[Mistake]:
    """
    Return limits of train types that there are not.

    Parameters
    ----------
    line
        The files of the line.
    stock
        The train types.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    return [
        line.limits.mistake(
            row,
            "train_type",
            f"unknown train type {row.train_type!r}",
            meant(row.train_type, stock.train),
        )
        for row in line.limits
        if row.train_type and row.train_type not in stock.train
    ]


def _train_mistakes(train: TrainEntry) -> Iterator[Told]:
    if train.motor_mass_t is not None and train.motor_mass_t > train.mass_t:
        problem = f"{train.motor_mass_t:g} is more than the mass of the train"
        yield "motor_mass_t", problem, f"up to {train.mass_t:g}"
    emergency = train.emergency_brake_kmhps
    if emergency is not None and emergency < train.service_brake_kmhps:
        problem = f"{emergency:g} is weaker than the service brake"
        yield "emergency_brake_kmhps", problem, f"from {train.service_brake_kmhps:g}"


def given(entry: ResistanceEntry | TractionEntry) -> tuple[str, ...]:
    """
    Return the keys that a table of a train type has.

    Parameters
    ----------
    entry
        The table.

    Returns
    -------
    tuple[str, ...]
        In the order of the schema.
    """
    fields = type(entry).model_fields
    return tuple(key for key in fields if getattr(entry, key) is not None)


def _resistance_mistakes(train: TrainEntry) -> Iterator[Told]:
    if train.resistance is None:
        return
    keys = given(train.resistance)
    if not keys:
        yield "resistance", "has no coefficient", TOLD
        return
    family = next(family for family in FAMILIES if keys[0] in family)
    for key in keys:
        if key not in family:
            yield f"resistance.{key}", f"stands beside {keys[0]}", f"only {', '.join(family)}"
    if train.motor_mass_t is not None:
        problem = "stands beside resistance, which does without it"
        yield "motor_mass_t", problem, "one of the two"


def _traction_mistakes(train: TrainEntry) -> Iterator[Told]:
    traction = train.traction
    keys = given(traction)
    if traction.force_speed is not None:
        for key in keys:
            if key != "force_speed":
                yield f"traction.{key}", "stands beside force_speed", WAYS
        yield from _table_mistakes(traction.force_speed, train.maximum_speed_kmh)
        return
    if traction.starting_force_kn is None:
        yield "traction.starting_force_kn", "is missing", WAYS
        return
    if traction.power_kw is not None and traction.power_speed_kmh is not None:
        yield "traction.power_kw", "stands beside power_speed_kmh", WAYS
        return
    power_speed_kmh = traction.power_speed_kmh
    if traction.power_kw is not None:
        power_speed_kmh = 3.6 * traction.power_kw / traction.starting_force_kn
    if power_speed_kmh is None:
        yield "traction.power_kw", "is missing", WAYS
        return
    characteristic_kmh = traction.characteristic_speed_kmh
    if characteristic_kmh is not None and characteristic_kmh < power_speed_kmh:
        below = "power_speed_kmh" if traction.power_kw is None else "the speed of power_kw"
        problem = f"{characteristic_kmh:g} lies below {below}"
        yield "traction.characteristic_speed_kmh", problem, f"from {power_speed_kmh:g}"


def _table_mistakes(
    points: tuple[tuple[float, float], ...], maximum_speed_kmh: float
) -> Iterator[Told]:
    key = "traction.force_speed"
    speeds_kmh = [speed_kmh for speed_kmh, _ in points]
    if speeds_kmh[0] != 0.0:
        yield key, f"begins at {speeds_kmh[0]:g} km/h", "a first speed of 0"
    for before, after in pairwise(speeds_kmh):
        if after <= before:
            yield key, f"{after:g} km/h stands behind {before:g} km/h", "rising speeds"
    if points[0][1] == 0.0:
        yield key, "has no force at the start", "a first force above 0"
    if max(speeds_kmh) < maximum_speed_kmh:
        problem = f"ends at {max(speeds_kmh):g} km/h, below maximum_speed_kmh"
        yield key, problem, f"a last speed from {maximum_speed_kmh:g}"
