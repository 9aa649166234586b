"""A judge of JSON Schema for tests: as much of it as the schemas of scenario files use."""

import re
from collections.abc import Callable, Iterator
from typing import Any

KINDS: dict[str, type | tuple[type, ...]] = {
    "object": dict,
    "array": list,
    "string": str,
    "boolean": bool,
    "null": type(None),
}
KNOWN = {
    *("$schema", "$defs", "$ref", "title", "description", "default", "type", "const", "enum"),
    *("anyOf", "pattern", "minLength", "maxLength", "minimum", "maximum", "exclusiveMinimum"),
    *("exclusiveMaximum", "properties", "required", "additionalProperties", "propertyNames"),
    *("patternProperties", "minProperties", "items", "prefixItems", "minItems", "maxItems"),
}


def is_of(value: object, kind: str) -> bool:
    if kind in {"number", "integer"}:
        if isinstance(value, bool) or not isinstance(value, int | float):
            return False
        return kind == "number" or float(value).is_integer()
    return isinstance(value, KINDS[kind])


Schema = dict[str, Any]


def faults(schema: Schema, value: object, whole: Schema, at: str = "") -> Iterator[str]:
    """Yield why a value is not allowed."""
    unknown = schema.keys() - KNOWN
    assert not unknown, f"{at}: the judge does not know {unknown}"
    if "$ref" in schema:
        yield from faults(whole["$defs"][schema["$ref"].rpartition("/")[2]], value, whole, at)
    if "anyOf" in schema:
        tried = [[*faults(one, value, whole, at)] for one in schema["anyOf"]]
        if all(tried):
            yield f"{at}: none of {tried}"
    if value not in schema.get("enum", [value]) or value != schema.get("const", value):
        yield f"{at}: {value!r} is another value"
    if "type" in schema and not is_of(value, schema["type"]):
        yield f"{at}: {value!r} is no {schema['type']}"
        return
    for kind, judge in JUDGES.items():
        if is_of(value, kind):
            yield from judge(schema, value, whole, at)


def text_faults(schema: Schema, value: str, _: Schema, at: str) -> Iterator[str]:
    if "pattern" in schema and not re.search(schema["pattern"], value):
        yield f"{at}: {value!r} does not fit {schema['pattern']}"
    if not schema.get("minLength", 0) <= len(value) <= schema.get("maxLength", 10**9):
        yield f"{at}: of length {len(value)}"


def number_faults(schema: Schema, value: float, _: Schema, at: str) -> Iterator[str]:
    if not schema.get("minimum", -1e99) <= value <= schema.get("maximum", 1e99):
        yield f"{at}: {value} is out of range"
    if not schema.get("exclusiveMinimum", -1e99) < value < schema.get("exclusiveMaximum", 1e99):
        yield f"{at}: {value} is at the edge or beyond"


def table_faults(schema: Schema, value: dict[str, Any], whole: Schema, at: str) -> Iterator[str]:
    own = schema.get("properties", {})
    yield from (f"{at}: no {name}" for name in schema.get("required", ()) if name not in value)
    further = schema.get("additionalProperties", True)
    patterns = schema.get("patternProperties", {})
    for name, part in value.items():
        fitting = [one for pattern, one in patterns.items() if re.search(pattern, name)]
        if name in own:
            yield from faults(own[name], part, whole, f"{at}.{name}")
        elif fitting:
            for one in fitting:
                yield from faults(one, part, whole, f"{at}.{name}")
        elif further is False:
            yield f"{at}: unknown key {name}"
        elif isinstance(further, dict):
            yield from faults(further, part, whole, f"{at}.{name}")
        if "propertyNames" in schema:
            yield from faults(schema["propertyNames"], name, whole, f"{at}: name")
    if len(value) < schema.get("minProperties", 0):
        yield f"{at}: too few keys"


def list_faults(schema: Schema, value: list[Any], whole: Schema, at: str) -> Iterator[str]:
    if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", 10**9):
        yield f"{at}: {len(value)} items"
    first = schema.get("prefixItems", [])
    for number, part in enumerate(value):
        one = first[number] if number < len(first) else schema.get("items", {})
        yield from faults(one, part, whole, f"{at}[{number}]")


JUDGES: dict[str, Callable[[Schema, Any, Schema, str], Iterator[str]]] = {
    "object": table_faults,
    "array": list_faults,
    "string": text_faults,
    "number": number_faults,
}
