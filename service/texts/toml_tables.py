"""How does a TOML file become declared values? Field by field, by the types of a struct or dataclass.

A field's type says what may come: `Annotated[float, Meta(ge=0, le=1)]` is "a number from 0 to 1" in errors, and the
`description` of a `Meta` says it in other words. Fields that are structs or dataclasses themselves are tables, lists
of such are `[[tables]]`, a `Path` is that of a file beside this one, and what is left out keeps its default. So a tree
of settings is read, and its errors are worded, by declaring it.
"""

import dataclasses
import difflib
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import msgspec
from msgspec import Meta

from anchoring.errors import AnchoringError
from chronicles.errors import ChronicleError
from gis.errors import GisError
from qsr.errors import QsrError
from service.errors import InputError, SiteError
from vision.errors import VisionError

# Bounds that infinity and nan do not keep.
Number = Annotated[float, Meta(ge=-1e300, le=1e300, description="a number")]
Text = Annotated[str, Meta(min_length=1, description="a text that is not empty")]

Declared = TypeVar("Declared")
_NAMES = {bool: "true or false", int: "a whole number", float: "a number", str: "a text", Path: "the path of a file"}


def read_toml(path: Path, declared: type[Declared], *, what: str) -> Declared:
    """Read a TOML file of a declared form.

    Parameters
    ----------
    declared : a struct or dataclass whose fields are those of the file.
    what : the file in words, for the error if there is none.

    Raises
    ------
    SiteError
        If the file is missing or no TOML, or a field is missing, wrong or unknown. The message names the file, the
        field, what was expected and what came.
    """
    try:
        values = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise SiteError(f"{path}: expected {what}, got {error.strerror or error!s}") from error
    except ValueError as error:
        raise SiteError(f"{path}: expected TOML in UTF-8, got {error!s}") from error
    except RecursionError as error:
        raise SiteError(f"{path}: expected TOML with a few levels of nesting, got too many to read") from error
    return _Reader(path, declared).table(values, declared, "")


def wrong(path: Path, field: str, problem: object) -> SiteError:
    """Word the error in a field of a file; the field "" is the file itself."""
    return SiteError(f"{path}: {field}: {problem}" if field else f"{path}: {problem}")


@contextmanager
def told(error_type: type[InputError], *places: object) -> Iterator[None]:
    """Turn what an engine refuses into an error of the user's file, with its places from the outside in."""
    try:
        yield
    except (AnchoringError, ChronicleError, GisError, QsrError, VisionError) as error:
        raise error_type(": ".join([*filter(None, map(str, places)), str(error)])) from error


class _Reader:
    """Convert the values of one file; `root` is the declared form of the whole of it."""

    def __init__(self, path: Path, root: type[object]) -> None:
        self._path, self._root = path, root

    def table(
        self, values: Mapping[str, object], declared: type[Declared], place: str, usual: Declared | None = None
    ) -> Declared:
        """Read a table, whose place in the file is as `camera.point[2]`; `usual` has what is left out."""
        fields = _fields(declared)
        if usual is None and not any(is_needed for _, is_needed in fields.values()):
            usual = declared()
        for name in values:
            if name not in fields:
                expected = f"expected one of {', '.join(fields)}; got an unknown field"
                raise wrong(self._path, _join(place, name), expected + self._hint(name, list(fields)))
        # Any: fields have types of their own, to which each value was converted.
        given: dict[str, Any] = {}
        for name, (hint, is_needed) in fields.items():
            if name in values:
                given[name] = self._value(values[name], hint, _join(place, name), getattr(usual, name, None))
            elif usual is not None:
                given[name] = getattr(usual, name)
            elif is_needed:
                raise wrong(self._path, _join(place, name), f"expected {_words(hint)}, got no such field")
        with told(SiteError, self._path, place):
            return declared(**given)

    def _value(self, value: object, hint: object, place: str, usual: object) -> object:
        bare, _ = _unwrap(hint)
        if _is_table(bare):
            if not isinstance(value, dict):
                raise wrong(self._path, place, f"expected a table [{place}], got {value!r}")
            return self.table(value, bare, place, usual)
        if get_origin(bare) is list and _is_table(entry := get_args(bare)[0]):
            if not isinstance(value, list) or not all(isinstance(one, dict) for one in value):
                raise wrong(self._path, place, f"expected tables [[{place}]], got {value!r}")
            return [self.table(one, entry, f"{place}[{number}]") for number, one in enumerate(value, start=1)]
        if get_origin(bare) in (dict, Mapping) and isinstance(value, dict) and value:
            one_by_one = [self._plain({key: one}, hint, place, f"{key} = {one!r}") for key, one in value.items()]
            return {key: one for entry in one_by_one for key, one in entry.items()}
        if bare is not Path:
            return self._plain(value, hint, place, repr(value))
        path = self._path.parent / self._plain(value, Text, place, repr(value))
        if path.is_file():
            return path
        raise wrong(self._path, place, f"expected the path of a file, got {value!r}, and there is no {path}")

    # Any: what comes out has the type that `hint` states.
    def _plain(self, value: object, hint: Any, place: str, came: str) -> Any:
        try:
            return msgspec.convert(value, hint, str_keys=True, builtin_types=(datetime,))
        except msgspec.ValidationError as error:
            raise wrong(self._path, place, f"expected {_words(hint)}, got {came}") from error

    def _hint(self, name: str, known: list[str]) -> str:
        near = difflib.get_close_matches(name, known, n=1)
        if near:
            return f"; did you mean {near[0]}?"
        homes = [table for table, fields in tables_of(self._root) if name in fields]
        return f"; {name} belongs {f'in [{homes[0]}]' if homes[0] else 'at the top of the file'}" if homes else ""


def tables_of(declared: type[object], place: str = "") -> Iterator[tuple[str, tuple[str, ...]]]:
    """List the tables of a declared form with their fields; the table "" is the file itself.

    Examples
    --------
    >>> Sun = msgspec.defstruct("Sun", ["height_rad", "colour"])
    >>> list(tables_of(msgspec.defstruct("Sky", ["name", ("sun", Sun)])))
    [('', ('name', 'sun')), ('sun', ('height_rad', 'colour'))]
    """
    fields = _fields(declared)
    yield place, tuple(fields)
    for name, (hint, _) in fields.items():
        bare, _ = _unwrap(hint)
        inner = get_args(bare)[0] if get_origin(bare) is list else bare
        if _is_table(inner):
            yield from tables_of(inner, _join(place, name))


# Any: what types.get_type_hints returns are types and special forms, which have no type in common.
def _fields(declared: type[object]) -> dict[str, tuple[Any, bool]]:
    """List the fields of a table: the type of each, and whether it must be there."""
    hints = get_type_hints(declared, include_extras=True)
    if dataclasses.is_dataclass(declared):
        none = dataclasses.MISSING
        needed = {one.name: one.default is none and one.default_factory is none for one in dataclasses.fields(declared)}
    else:
        assert issubclass(declared, msgspec.Struct)
        needed = {one.name: one.required for one in msgspec.structs.fields(declared)}
    return {name: (hints[name], is_needed) for name, is_needed in needed.items()}


def _unwrap(hint: Any) -> tuple[Any, dict[str, Any]]:
    """Take None out of a type, and the words and bounds of its `Meta`."""
    if get_origin(hint) in (Union, UnionType):
        [hint] = [one for one in get_args(hint) if one is not NoneType]
    if get_origin(hint) is Annotated:
        hint, meta = get_args(hint)
        return hint, {name: getattr(meta, name) for name in ("description", "ge", "gt", "le", "lt")}
    return hint, {}


def _words(hint: Any) -> str:
    """Say what a field expects.

    Examples
    --------
    >>> [_words(hint) for hint in (Annotated[int, Meta(ge=1, le=9)], Annotated[float, Meta(gt=0)], Literal["a", "b"])]
    ['a whole number from 1 to 9', 'a number above 0', 'one of a, b']
    """
    bare, meta = _unwrap(hint)
    bound = {name: value for name, value in meta.items() if value is not None}
    if "description" in bound:
        return str(bound["description"])
    if get_origin(bare) is Literal:
        return f"one of {', '.join(map(str, get_args(bare)))}"
    if _is_table(bare):
        return "a table"
    if "ge" in bound and "le" in bound:
        return f"{_NAMES[bare]} from {bound['ge']} to {bound['le']}"
    signs = {"ge": "at least", "gt": "above", "le": "at most", "lt": "below"}
    limits = " and ".join(f"{signs[name]} {value}" for name, value in bound.items())
    return f"{_NAMES[bare]} {limits}".rstrip()


def _is_table(kind: Any) -> bool:
    return isinstance(kind, type) and (dataclasses.is_dataclass(kind) or issubclass(kind, msgspec.Struct))


def _join(place: str, name: str) -> str:
    return f"{place}.{name}" if place else name
