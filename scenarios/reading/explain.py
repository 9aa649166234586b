"""What is wrong with a key or a cell and what is allowed, in words."""

from collections.abc import Callable, Iterable, Sequence
from typing import Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from kankaku.scenarios.reading.cell_texts import (
    clock_trouble,
    identifier_trouble,
    number_trouble,
    quoted_trouble,
    shown,
    text_trouble,
)
from kankaku.scenarios.reading.fields import CLOCK_TEXT, NAME_TEXT, OPTION_TEXT
from kankaku.scenarios.reading.mistakes import meant

_NUMBERS = (float, int, float | None)


def explained(
    model: type[BaseModel], path: Sequence[object], kind: str, value: object
) -> tuple[str, str, str]:
    """
    Return what is wrong in a file with keys.

    Parameters
    ----------
    model
        Schema of the file.
    path
        Key path.
    kind
        What pydantic found.
    value
        What the file holds there.

    Returns
    -------
    tuple[str, str, str]
        Place, problem and what is allowed.
    """
    parts = [str(part) for part in path if part != "[key]"]
    owner = _owner(model, parts[:-1])
    return ".".join(parts), *_explain(owner, parts[-1], kind, value)


def refused_cell(field: FieldInfo, text: str) -> tuple[str, str]:
    """
    Return what is wrong with a cell.

    Parameters
    ----------
    field
        What the cells of the column may hold.
    text
        The cell.

    Returns
    -------
    tuple[str, str]
        Problem and what is allowed.
    """
    return _refused(field, text, number_trouble), allowed_by(field)


def _owner(model: type[BaseModel], path: Iterable[str]) -> type[BaseModel] | None:
    """Return the schema of the table that a key path leads to; nothing for a free table."""
    owner: type[BaseModel] | None = model
    freely_named = False
    for part in path:
        if freely_named:
            freely_named = False
            continue
        if owner is None or part not in owner.model_fields:
            return None
        annotation = owner.model_fields[part].annotation
        owner = model_within(annotation)
        freely_named = get_origin(annotation) in (dict, tuple)
    return None if freely_named else owner


def model_within(annotation: object) -> type[BaseModel] | None:
    """
    Return the schema of the tables that a key holds.

    Parameters
    ----------
    annotation
        Type of the key.

    Returns
    -------
    type[BaseModel] | None
        The schema of one table; nothing if it holds none, or free ones.
    """
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    inner = (model_within(part) for part in get_args(annotation))
    return next((model for model in inner if model), None)


def _explain(owner: type[BaseModel] | None, key: str, kind: str, value: object) -> tuple[str, str]:
    named = owner.model_fields if owner else {}
    fields = {field.alias or name: field for name, field in named.items()}
    if kind == "extra_forbidden":
        return f"unknown key {shown(key)}", meant(key, fields)
    allowed = allowed_by(fields[key]) if key in fields else OPTION_TEXT
    if kind == "missing":
        return "is missing", allowed
    if kind == "string_pattern_mismatch" and key not in fields:
        trouble = identifier_trouble(value)
        told = f": it {trouble}" if trouble else ""
        return f"the name {shown(value)} is not allowed{told}", NAME_TEXT
    if kind == "too_long" and key in fields:
        return "has too many entries", f"up to {_most_entries(fields[key])}"
    if key in fields:
        return _refused(fields[key], value, quoted_trouble), allowed
    return ("is empty" if value in ("", {}) else f"{shown(value)} is not allowed"), allowed


def _most_entries(field: FieldInfo) -> int:
    return next((entry.max_length for entry in field.metadata if hasattr(entry, "max_length")), 0)


def _refused(field: FieldInfo, value: object, of_number: Callable[[object], str]) -> str:
    if value in ("", {}):
        return "is empty"
    trouble = ""
    if (field.description or "").startswith(CLOCK_TEXT):
        trouble = clock_trouble(value)
    elif field.description == NAME_TEXT:
        trouble = identifier_trouble(value)
    elif field.annotation in _NUMBERS:
        trouble = of_number(value)
    elif field.annotation is str and isinstance(value, str):
        trouble = text_trouble(value)
    told = f": it {trouble}" if trouble else ""
    return f"{shown(value)} is not allowed{told}"


def allowed_by(field: FieldInfo) -> str:
    """
    Return what a key or a column may hold.

    Parameters
    ----------
    field
        Its kind.

    Returns
    -------
    str
        For example ``a number from 5 up to 400``.
    """
    if field.description:
        return field.description
    if get_origin(field.annotation) is tuple:
        (item, *_) = get_args(field.annotation)
        tables = isinstance(item, type) and issubclass(item, BaseModel)
        return "tables in double brackets" if tables else "a list"
    if get_origin(field.annotation) is Literal:
        return " or ".join(str(value) for value in get_args(field.annotation))
    kinds = {float: "a number", int: "a whole number", str: "text", float | None: "a number"}
    kinds |= {bool: "true or false", int | None: "a whole number"}
    kind = kinds.get(field.annotation)  # type: ignore[arg-type]
    signs = {"gt": "above", "ge": "from", "lt": "below", "le": "up to"}
    signs |= {"min_length": "of length", "max_length": "up to"}
    bounds = [
        f"{word} {_plain(getattr(entry, sign))}"
        for entry in field.metadata
        for sign, word in signs.items()
        if getattr(entry, sign, None) is not None
    ]
    if kind is None:
        return "one table or more" if bounds else "a table of keys"
    return " ".join([kind, *bounds])


def _plain(bound: float) -> str:
    return str(bound) if isinstance(bound, int) else f"{bound:g}"
