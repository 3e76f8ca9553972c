"""Does a JSON value fit a schema? As much of JSON Schema 2020-12 as the schema of explanations uses."""

from collections.abc import Callable
from typing import Any

_TYPES: dict[str, Callable[[Any], bool]] = {
    "object": lambda value: isinstance(value, dict),
    "array": lambda value: isinstance(value, list),
    "string": lambda value: isinstance(value, str),
    "number": lambda value: isinstance(value, int | float) and not isinstance(value, bool),
    "integer": lambda value: isinstance(value, int) and not isinstance(value, bool),
    "boolean": lambda value: isinstance(value, bool),
    "null": lambda value: value is None,
}
_KNOWN = {
    *("$schema", "title", "description", "$defs", "$ref", "oneOf", "anyOf", "const", "enum", "type", "items"),
    *("properties", "required", "additionalProperties"),
}


def faults(value: Any, schema: dict[str, Any], root: dict[str, Any], where: str = "$") -> list[str]:
    """List where a value does not fit, with its path."""
    assert schema.keys() <= _KNOWN, schema.keys() - _KNOWN
    if "$ref" in schema:
        return faults(value, root["$defs"][schema["$ref"].removeprefix("#/$defs/")], root, where)
    if "oneOf" in schema or "anyOf" in schema:
        return _faults_of_choice(value, schema, root, where)
    if "const" in schema or "enum" in schema:
        return [] if value in schema.get("enum", [schema.get("const")]) else [f"{where}: {value!r}"]
    types = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    if not any(_TYPES[one](value) for one in types):
        return [f"{where}: expected {types}, got {value!r}"]
    if isinstance(value, list):
        each = [faults(one, schema["items"], root, f"{where}[{index}]") for index, one in enumerate(value)]
        return [fault for found in each for fault in found]
    return _faults_of_object(value, schema, root, where) if isinstance(value, dict) else []


def _faults_of_choice(value: Any, schema: dict[str, Any], root: dict[str, Any], where: str) -> list[str]:
    word = "oneOf" if "oneOf" in schema else "anyOf"
    each = [faults(value, one, root, where) for one in schema[word]]
    fitting = sum(not one for one in each)
    if fitting == 1 or (fitting and word == "anyOf"):
        return []
    return [f"{where}: fits {fitting} of {word}", *min(each, key=len)]


def _faults_of_object(value: dict[str, Any], schema: dict[str, Any], root: dict[str, Any], where: str) -> list[str]:
    known, extra = schema.get("properties", {}), schema.get("additionalProperties", True)
    found = [f"{where}: lacks {name}" for name in schema.get("required", []) if name not in value]
    for name, one in value.items():
        if name in known:
            found += faults(one, known[name], root, f"{where}.{name}")
        elif extra is False:
            found.append(f"{where}: has {name}")
        elif isinstance(extra, dict):
            found += faults(one, extra, root, f"{where}.{name}")
    return found
