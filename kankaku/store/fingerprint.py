"""What a result depends on, as digests: the content of objects, and the sources of the program."""

import hashlib
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

ROOMS = ("analysis", "controllers", "railway", "scenarios", "sumo_net", "telecom")
STUDIES = ("campaign", "ensemble_runs", "failure_findings", "movers", "study")
"""Studies that decide what is in the tables of a run."""


def content_sha256(value: object) -> str:
    """
    Return a digest of what an object holds.

    Parameters
    ----------
    value
        Numbers, texts, arrays, enumerations, dataclasses, and collections of them.

    Returns
    -------
    str
        The same for equal contents, in every process.

    Raises
    ------
    TypeError
        If there is anything else in it.
    """
    digest = hashlib.sha256()
    for part in _parts(value):
        digest.update(len(part).to_bytes(8, "big") + part)
    return digest.hexdigest()


def _parts(value: Any) -> Iterator[bytes]:  # noqa: ANN401 - whatever a scenario holds
    yield type(value).__name__.encode()
    if value is None or isinstance(value, str | bytes | bool | int | float | np.generic):
        yield repr(value).encode()
    elif isinstance(value, Enum):
        yield value.name.encode()
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype.str} {value.shape}".encode()
        yield np.ascontiguousarray(value).tobytes()
    elif isinstance(value, frozenset):
        yield from sorted(content_sha256(item).encode() for item in value)
    else:
        for item in _items(value):
            yield from _parts(item)


def _items(value: Any) -> Iterator[Any]:  # noqa: ANN401 - whatever a scenario holds
    if is_dataclass(value):
        for field in fields(value):
            yield field.name
            yield getattr(value, field.name)
    elif isinstance(value, Mapping):
        for pair in value.items():
            yield from pair
    elif isinstance(value, tuple | list):
        yield from value
    else:
        msg = f"no digest of a {type(value).__name__}"
        raise TypeError(msg)


@cache
def sources_sha256(rooms: tuple[str, ...] = ROOMS, studies: tuple[str, ...] = STUDIES) -> str:
    """
    Return a digest of the sources that are installed.

    Parameters
    ----------
    rooms
        Packages that count.
    studies
        Studies that count.

    Returns
    -------
    str
        By default another one after any change of a line that might change a table.
    """
    digest = hashlib.sha256()
    for name, file in _sources(rooms, studies):
        digest.update(f"{name}\0".encode() + file.read_bytes() + b"\0")
    return digest.hexdigest()


def _sources(rooms: tuple[str, ...], studies: tuple[str, ...]) -> Iterator[tuple[str, Path]]:
    for name in rooms:
        spec = find_spec(f"kankaku.{name}")
        if spec is not None and spec.origin is not None:
            folder = Path(spec.origin).parent
            for file in sorted(folder.rglob("*.py")):
                yield f"{name}/{file.relative_to(folder).as_posix()}", file
    for name in studies:
        spec = find_spec(f"kankaku.studies.{name}")
        if spec is not None and spec.origin is not None:
            yield name, Path(spec.origin)


def foreign_sha256(*parts: Callable[..., Any]) -> str:
    """
    Return a digest of the sources of classes that do not belong to the program.

    Of a class in a package, all modules of the package count: it may call any of them.

    Parameters
    ----------
    parts
        Classes, or functions that build something.

    Returns
    -------
    str
        Empty if all of them belong to it.
    """
    digest, found = hashlib.sha256(), False
    for part in parts:
        made = part.func if isinstance(part, partial) else part
        if made.__module__.partition(".")[0] != "kankaku":
            found = True
            for file in _foreign_files(made.__module__):
                digest.update(file.read_bytes())
            digest.update(getattr(made, "__qualname__", type(made).__qualname__).encode())
    return digest.hexdigest() if found else ""


def _foreign_files(module: str) -> list[Path]:
    """Return the file of a module, or all of its package; none of what stands in no file."""
    package = getattr(sys.modules.get(module.partition(".")[0]), "__file__", None)
    if package and Path(package).name == "__init__.py":
        return sorted(Path(package).parent.rglob("*.py"))
    file = getattr(sys.modules.get(module), "__file__", None)
    return [Path(file)] if file else []
