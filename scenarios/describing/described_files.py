"""Every file, column and key with what it means, holds, and is where it is left out."""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, fields
from enum import Enum
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple, get_origin

from pydantic import BaseModel

from kankaku.railway.errors import KankakuError, suggesting
from kankaku.scenarios.describing.key_units import unit_of
from kankaku.scenarios.reading import row_formats, schema
from kankaku.scenarios.reading.csv_rows import field_infos
from kankaku.scenarios.reading.dependability_files import AvailabilityFile, FaultTreeFile
from kankaku.scenarios.reading.excel_sheets import ENDING
from kankaku.scenarios.reading.explain import allowed_by, model_within
from kankaku.scenarios.reading.fields import CLOCK_TEXT
from kankaku.scenarios.reading.radio_network import RadioFile
from kankaku.scenarios.reading.row_formats import Row

NEEDED = "must be there"
ANY_NAME = "NAME"
"""Stands in a path for a name that whoever writes the file chooses."""
KEY_FILES: Mapping[str, type[BaseModel]] = {
    "scenario.toml": schema.ScenarioFile,
    "rolling_stock.toml": schema.RollingStockFile,
    "radio_network.toml": RadioFile,
    "availability.toml": AvailabilityFile,
    "fault_tree.toml": FaultTreeFile,
}
"""Files with keys."""
ROW_FILES: Mapping[str, type[Row]] = {
    "stations.csv": row_formats.StationRow,
    "tracks.csv": row_formats.TrackRow,
    "platforms.csv": row_formats.PlatformRow,
    "services.csv": row_formats.ServiceRow,
    "calls.csv": row_formats.CallRow,
    "dwell_stations.csv": row_formats.DwellStationRow,
    "dwell_quantiles.csv": row_formats.QuantileRow,
    "nodes.csv": row_formats.NodeRow,
    "tracks.csv of a network": row_formats.LinkRow,
    "routes.csv": row_formats.RouteRow,
    "turnouts.csv": row_formats.TurnoutRow,
    "crossings.csv": row_formats.CrossingRow,
    "limits.csv": row_formats.LimitRow,
    "driven_speeds.csv": row_formats.DrivenSpeedRow,
    "gradients.csv": row_formats.GradientRow,
    "curves.csv": row_formats.CurveRow,
    "balises.csv": row_formats.BaliseRow,
    "blocks.csv": row_formats.BlockRow,
    "circuits.csv": row_formats.CircuitRow,
    "geometry.csv": row_formats.GeometryRow,
}
"""Files with rows."""


class DescribeError(KankakuError):
    """Nothing of that name is described."""

    verdict = "cannot be described"


class KeySort(Enum):
    """What something in a file is."""

    COLUMN = "column"
    KEY = "key"
    TABLE = "table"
    TABLES = "list of tables"
    NAMED = "tables by name"


class DescribedKey(NamedTuple):
    """A column, a key, or a table of keys."""

    path: tuple[str, ...]
    """``NAME`` stands for a name of one's own."""
    sort: KeySort
    meaning: str
    allowed: str = ""
    unit: str = ""
    otherwise: str = ""
    """What holds where it is left out."""
    example: Any = None
    """As the file has it: a cell, or a value of TOML."""

    @property
    def name(self) -> str:
        """Path as it is written."""
        told = ".".join(self.path)
        shown = {KeySort.TABLE: f"[{told}]", KeySort.TABLES: f"[[{told}]]"}
        return shown.get(self.sort, f"[{told}.{ANY_NAME}]" if self.sort is KeySort.NAMED else told)


class DescribedFile(NamedTuple):
    """A file of a scenario."""

    name: str
    about: str
    otherwise: str
    """Whether it may be absent."""
    keys: tuple[DescribedKey, ...]

    @property
    def kind(self) -> str:
        """What its parts are called."""
        return "key" if self.name.endswith(".toml") else "column"


@cache
def described_files() -> Mapping[str, DescribedFile]:
    """
    Return every file that is described.

    Returns
    -------
    Mapping[str, DescribedFile]
        By name; tables of rows that a network has otherwise have a name of their own.
    """
    text = files("kankaku.scenarios.reading").joinpath("meanings.toml").read_text("utf-8")
    meanings = tomllib.loads(text)
    found = {}
    for name in (*KEY_FILES, *ROW_FILES):
        told = meanings[name]
        keys = (
            _keys(KEY_FILES[name], told["keys"], ())
            if name in KEY_FILES
            else _columns(ROW_FILES[name], told["keys"])
        )
        found[name] = DescribedFile(name, told["about"], told["optional"], tuple(keys))
    return found


def _keys(
    model: type[BaseModel], meanings: Mapping[str, Any], path: tuple[str, ...]
) -> Iterator[DescribedKey]:
    for name, field in model.model_fields.items():
        here = (*path, field.alias or name)
        meaning = meanings[".".join(here)]
        inner = model_within(field.annotation)
        if inner is not None:
            sort = _sort_of(get_origin(field.annotation))
            needed = NEEDED if field.is_required() else "none"
            if isinstance(field.default, BaseModel):
                needed = "what its keys say"
            yield DescribedKey(here, sort, meaning, otherwise=needed)
            further = (*here, ANY_NAME) if sort is KeySort.NAMED else here
            yield from _keys(inner, meanings, further)
            continue
        sentence, example, *told = meaning
        otherwise = NEEDED if field.is_required() else _shown(field.default)
        allowed = allowed_by(field)
        yield DescribedKey(
            *(here, KeySort.KEY, sentence, allowed, _unit(name, allowed)),
            *(told[0] if told else otherwise, example),
        )


def _sort_of(origin: object) -> KeySort:
    """Return what a key with tables in it is."""
    if origin is dict:
        return KeySort.NAMED
    return KeySort.TABLES if origin is tuple else KeySort.TABLE


def _columns(model: type[Row], meanings: Mapping[str, Any]) -> Iterator[DescribedKey]:
    infos = field_infos(model)
    defaults = {part.name: part.default for part in fields(model)}
    # In the order of the sentences: the name of something before its place.
    for name, (sentence, example, *told) in meanings.items():
        otherwise = NEEDED if defaults[name] is MISSING else _shown(defaults[name])
        allowed = allowed_by(infos[name])
        yield DescribedKey(
            *((name,), KeySort.COLUMN, sentence, allowed, _unit(name, allowed)),
            *(told[0] if told else otherwise, example),
        )


def _unit(name: str, allowed: str) -> str:
    return "HH:MM:SS" if allowed.startswith(CLOCK_TEXT) else unit_of(name)


def _shown(value: object) -> str:
    """Return what holds where nothing is said."""
    if isinstance(value, bool):
        return str(value).lower()
    if value is None or value in ((), {}):
        return "none"
    return f"{value:g}" if isinstance(value, float) else str(value) or "empty"


def find_described(asked: str) -> tuple[DescribedFile, tuple[DescribedKey, ...]]:
    """
    Return what somebody asks for.

    Parameters
    ----------
    asked
        A file, or a file and a column or key of it behind a point, a colon or a space. Of a key
        the last part is enough, and a name of one's own may stand in it, be ``NAME``, or be left
        out.

    Returns
    -------
    tuple[DescribedFile, tuple[DescribedKey, ...]]
        The file, and which of its columns or keys are meant, of a table all that it has; no
        columns and keys if the whole file is meant.

    Raises
    ------
    DescribeError
        If there is no such file, column or key.
    """
    asked = asked.strip().replace(ENDING, ".csv")
    known = described_files()
    name = next((one for one in sorted(known, key=len)[::-1] if asked.startswith(one)), "")
    behind = asked.removeprefix(name)
    if not name or (behind and behind[0] not in ".: "):
        told = suggesting(asked, [*known], ", ".join(known))
        raise DescribeError(asked[:60], "no such file", told)
    file = known[name]
    path = [part for part in behind.strip(".: []").replace("]", "").split(".") if part]
    # As mistakes name the tables of a list.
    path = [part for part in path if not part.isdigit()]
    if not path:
        return file, ()
    found = tuple(_meant(file.keys, path))
    if not found:
        names = list(dict.fromkeys(key.path[-1] for key in file.keys))
        # A unit is easily forgotten.
        begun = ", ".join(one for one in names if one.startswith(path[-1]))
        told = begun or suggesting(path[-1], names, f"what kankaku describe {name} lists")
        where = f"{name}: {'.'.join(path)[:60]}"
        raise DescribeError(where, f"no such {file.kind}", told)
    return file, found


def _meant(keys: Sequence[DescribedKey], path: Sequence[str]) -> Iterator[DescribedKey]:
    exact = [key for key in keys if _fits(key.path, path)]
    if exact:
        for key in keys:
            if any(key.path[: len(one.path)] == one.path for one in exact):
                yield key
        return
    yield from (key for key in keys if key.path[-len(path) :] == tuple(path))


def _fits(path: Sequence[str], asked: Sequence[str]) -> bool:
    """Return whether a path is asked for, with names of one's own in it or without them."""
    if [part for part in path if part != ANY_NAME] == [*asked]:
        return True
    return len(path) == len(asked) and all(
        own in {ANY_NAME, other} for own, other in zip(path, asked, strict=True)
    )
