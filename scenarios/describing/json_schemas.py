"""JSON Schema of every file, for editors that complete keys and mark mistakes."""

import json
from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

from pydantic import BaseModel, TypeAdapter

from kankaku.scenarios.describing.described_files import (
    ANY_NAME,
    KEY_FILES,
    ROW_FILES,
    DescribedFile,
    DescribedKey,
    described_files,
)
from kankaku.scenarios.reading.csv_rows import field_infos
from kankaku.scenarios.reading.explain import model_within
from kankaku.scenarios.reading.row_formats import Row

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schemas() -> dict[str, str]:
    """
    Return the schemas of all files.

    Returns
    -------
    dict[str, str]
        Texts in JSON by name, such as ``scenario.schema.json``. A file of rows is an array of
        objects, as converters of CSV make it.
    """
    described = described_files()
    found = {}
    for name, model in KEY_FILES.items():
        found[name] = _of_keys(model, described[name])
    for name, row in ROW_FILES.items():
        found[name] = _of_rows(row, described[name])
    return {
        schema_name(name): json.dumps(schema, ensure_ascii=False, indent=2) + "\n"
        for name, schema in found.items()
    }


def schema_name(file: str) -> str:
    """
    Return what the schema of a file is called.

    Parameters
    ----------
    file
        The file, as the reference names it.

    Returns
    -------
    str
        Name of the schema's file.
    """
    stem, _, more = file.partition(".")
    return f"{stem}{'_network' if more.endswith('network') else ''}.schema.json"


_BOUNDS = {
    "ge": "minimum",
    "gt": "exclusiveMinimum",
    "le": "maximum",
    "lt": "exclusiveMaximum",
}
"""Behind a validator of ours, bounds keep the names that they have in Python."""


def _plain(part: Any) -> Any:  # noqa: ANN401 - any part of a schema
    """Return a part of a schema with bounds as JSON Schema names them."""
    if isinstance(part, list):
        return [_plain(one) for one in part]
    if not isinstance(part, dict):
        return part
    return {
        _BOUNDS.get(name, name) if isinstance(one, int | float) else name: _plain(one)
        for name, one in part.items()
    }


def _head(file: DescribedFile) -> dict[str, Any]:
    return {"$schema": DIALECT, "title": file.name, "description": file.about}


def _of_keys(model: type[BaseModel], file: DescribedFile) -> dict[str, Any]:
    made = _plain(TypeAdapter(model).json_schema())
    tables = {model.__name__: made, **made.get("$defs", {})}
    by_path = {key.path: key for key in file.keys}
    _describe(model, (), tables, by_path)
    made.pop("title", None)
    return {**_head(file), **{name: part for name, part in made.items() if name != "description"}}


def _describe(
    model: type[BaseModel],
    path: tuple[str, ...],
    tables: Mapping[str, Any],
    by_path: Mapping[tuple[str, ...], DescribedKey],
) -> None:
    """Put what keys mean into the schema of a table, and of those within it."""
    own = tables[model.__name__]
    own.pop("description", None)
    own.pop("title", None)
    for name, field in model.model_fields.items():
        alias = field.alias or name
        key = by_path[*path, alias]
        part = own["properties"][alias]
        part.pop("title", None)
        part["description"] = _text(key)
        inner = model_within(field.annotation)
        if inner is not None:
            own_names = (*key.path, ANY_NAME)
            _describe(
                inner, own_names if own_names in _starts(by_path) else key.path, tables, by_path
            )


def _starts(by_path: Mapping[tuple[str, ...], DescribedKey]) -> set[tuple[str, ...]]:
    return {path[:length] for path in by_path for length in range(1, len(path))}


def _text(key: DescribedKey) -> str:
    facts = [key.meaning]
    if key.allowed:
        facts.append(f"Allowed: {key.allowed}.")
    if key.unit:
        facts.append(f"Unit: {key.unit}.")
    return " ".join(facts)


def _of_rows(row: type[Row], file: DescribedFile) -> dict[str, Any]:
    infos = field_infos(row)
    properties = {}
    for key in file.keys:
        (name,) = key.path
        part = _plain(TypeAdapter(infos[name].rebuild_annotation()).json_schema())
        properties[name] = {**part, "description": _text(key)}
    needed = [part.name for part in fields(row) if part.name != "row" and part.default is MISSING]
    items = {
        "type": "object",
        "properties": properties,
        "required": needed,
        "additionalProperties": False,
    }
    return {**_head(file), "type": "array", "items": items, "minItems": 1}
