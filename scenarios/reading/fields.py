"""Kinds of keys and cells: what they may hold, and how that is said."""

import math
from typing import Annotated, Literal, TypeAlias, TypeGuard

from pydantic import AfterValidator, BeforeValidator, Field, PlainValidator, StringConstraints

from kankaku.scenarios.reading.cell_texts import clock, number, text_trouble

CLOCK_TEXT = "a time of day as HH:MM:SS, hours 0 to 99; after midnight they go on with 24"
OPTION_TEXT = "a finite number, true or false, or a list of finite numbers"
LONGEST_NAME = 60
"""Characters of an identifier. [-]"""
NAME_TEXT = (
    f"a text of letters a-z and A-Z, digits, '-', '_' and '.', at most {LONGEST_NAME} characters"
)
POINTS_TEXT = "a list of [km/h, kN], speeds up to 400 and forces up to 5000, at most 1000 of them"
FASTEST_KMH, STRONGEST_KN, MOST_POINTS = 400.0, 5000.0, 1000
MOST = 10_000
"""Entries of one kind in a file with keys. [-]"""


def _number(value: object) -> object:
    found = number(value) if isinstance(value, str) else None
    return value if found is None else found


def _maybe_number(value: object) -> object:
    return None if value == "" else _number(value)


def _clock(value: object) -> object:
    # A time without quotes is one to TOML, too.
    found = clock(value) if isinstance(value, str) else None
    if found is None:
        raise ValueError(CLOCK_TEXT)
    return found


def _maybe_clock(value: object) -> object:
    return "" if value == "" else _clock(value)


def _text(value: str) -> str:
    trouble = text_trouble(value)
    if trouble:
        raise ValueError(trouble)
    return value


def _option(value: object) -> float | bool | tuple[float, ...]:
    if isinstance(value, bool):
        return value
    if _is_finite(value):
        return float(value)
    if isinstance(value, list) and value and len(value) <= MOST and all(map(_is_finite, value)):
        return tuple(map(float, value))
    raise ValueError(OPTION_TEXT)


def _points(value: object) -> tuple[tuple[float, float], ...]:
    if not isinstance(value, list) or not 0 < len(value) <= MOST_POINTS:
        raise ValueError(POINTS_TEXT)
    return tuple(map(_point, value))


def _point(value: object) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2 or not all(map(_is_finite, value)):
        raise ValueError(POINTS_TEXT)
    speed_kmh, force_kn = map(float, value)
    if not (0.0 <= speed_kmh <= FASTEST_KMH and 0.0 <= force_kn <= STRONGEST_KN):
        raise ValueError(POINTS_TEXT)
    return speed_kmh, force_kn


def _is_finite(value: object) -> TypeGuard[float]:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


Cell = BeforeValidator(_number)
MaybeCell = BeforeValidator(_maybe_number)
Option: TypeAlias = Annotated[
    float | bool | tuple[float, ...],
    PlainValidator(_option, json_schema_input_type=float | bool | list[float]),
]
Points: TypeAlias = Annotated[
    tuple[tuple[float, float], ...] | None,
    PlainValidator(_points, json_schema_input_type=list[tuple[float, float]]),
    Field(description=POINTS_TEXT),
]
Name: TypeAlias = Annotated[
    str,
    StringConstraints(pattern=rf"^[A-Za-z0-9_.\-]{{1,{LONGEST_NAME}}}$"),
    Field(description=NAME_TEXT),
]
MaybeName: TypeAlias = Annotated[
    str,
    StringConstraints(pattern=rf"^[A-Za-z0-9_.\-]{{0,{LONGEST_NAME}}}$"),
    Field(description=f"{NAME_TEXT}; or nothing"),
]
OptionalName: TypeAlias = Annotated[Name | None, Field(description=NAME_TEXT)]
Text: TypeAlias = Annotated[
    str, StringConstraints(min_length=1, max_length=200), AfterValidator(_text)
]
OptionalText: TypeAlias = Annotated[str, StringConstraints(max_length=200), AfterValidator(_text)]
_ClockText: TypeAlias = Annotated[str, Field(pattern=r"^[0-9]{1,2}:[0-5][0-9]:[0-5][0-9]$")]
Clock: TypeAlias = Annotated[
    str,
    BeforeValidator(_clock, json_schema_input_type=_ClockText),
    Field(description=CLOCK_TEXT),
]
MaybeClock: TypeAlias = Annotated[
    str,
    BeforeValidator(_maybe_clock, json_schema_input_type=_ClockText | Literal[""]),
    Field(description=f"{CLOCK_TEXT}; or nothing"),
]
Kilometre: TypeAlias = Annotated[float, Cell, Field(ge=-1000.0, le=10000.0)]
MaybeLongitude: TypeAlias = Annotated[
    Annotated[float, Field(ge=-180.0, le=180.0)] | None,
    MaybeCell,
    Field(description="a number from -180 up to 180, or nothing"),
]
MaybeLatitude: TypeAlias = Annotated[
    Annotated[float, Field(ge=-90.0, le=90.0)] | None,
    MaybeCell,
    Field(description="a number from -90 up to 90, or nothing"),
]
Percent: TypeAlias = Annotated[float, Field(gt=0.0, le=100.0)]
Mass: TypeAlias = Annotated[float, Field(gt=0.0, le=20000.0)]
Brake: TypeAlias = Annotated[float, Field(ge=0.5, le=12.0)]
SweptDelay: TypeAlias = Annotated[float, Field(ge=0.0, lt=1000.0)]
Speed: TypeAlias = Annotated[float, Field(ge=5.0, le=400.0)]
