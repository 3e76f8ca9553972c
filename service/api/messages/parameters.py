"""Which parameters do `GET /api/v1/events` and its siblings take, and what do they mean?

One struct each says it for both sides: requests are read by it, and OpenAPI shows it. (Declaring them in the route's
signature instead makes the framework spend more time on them than the database needs for the answer.)
"""

import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, TypeVar  # Any: JSON schemas, and fields of several types

from msgspec import UNSET, Meta, Struct, UnsetType, ValidationError, convert, json
from msgspec.structs import asdict

from dyknow.language.diagnostics import hinted
from service.errors import FilterError, QueryError
from service.export.events import ROLE_PREFIX, ExportFormat
from service.questions.events.queries import DEFAULT_LIMIT, MAX_LIMIT, EventFilter, Match, Order
from service.questions.events.summaries import MAX_KEYS, By
from service.records.events import EventStatus
from service.records.times import MAX_MEDIA_US, TimePoint, parse_time

JsonObject = dict[str, Any]
Pairs = Sequence[tuple[str, str]]


_TEXT: JsonObject = {"type": "string"}
_MEDIA_FORMS = r"^([0-9]{1,15}|[0-9]{1,9}(\.[0-9]{1,9})?s|([0-9]{1,5}:)?[0-5]?[0-9]:[0-5][0-9](\.[0-9]{1,9})?)$"
MEDIA_TIME: JsonObject = {"type": "string", "pattern": _MEDIA_FORMS, "examples": ["12500000", "12.5s", "01:23.5"]}
_FORMS = "microseconds of media time, `12.5s`, `mm:ss`, or RFC 3339 with an offset"
_SURE = "How sure an event is at least; takes the place of the floors of chronicles."
_BEHIND = "The sequence number after which to begin; the header `Last-Event-ID` wins."
_WINDOW = "The window as START/END, of which one may be `..`; takes the place of from and to."

_SPELT = {
    "types": "type", "actors": "actor", "roads": "road", "sources": "source", "runs": "run", "statuses": "status",
    "chronicles": "chronicle", "from_": "from",
}  # fmt: skip
_REPEATABLE = frozenset(_SPELT.values()) - {"from"}

_Names = tuple[str, ...]
_UTC_TIME = {"type": "string", "format": "date-time", "examples": ["2026-05-01T08:00:00Z"]}
_Time = Annotated[str, Meta(extra_json_schema={"anyOf": [MEDIA_TIME, _UTC_TIME]})]
_ENDS = rf"({_MEDIA_FORMS[1:-1]}|\.\.)"
_Span = Annotated[str, Meta(extra_json_schema={"pattern": f"^{_ENDS}/{_ENDS}$", "examples": ["10s/.."]})]
_Whole = Annotated[int, Meta(ge=0, le=MAX_MEDIA_US)]


class _Query(Struct, frozen=True, kw_only=True, rename=_SPELT):
    """Fields of `EventFilter` in the words of HTTP; what is not set does not restrict."""

    types: Annotated[_Names, Meta(description="Event type.")] = ()
    actors: Annotated[_Names, Meta(description="An object that takes part in any role.")] = ()
    roads: Annotated[_Names, Meta(description="The road on which the event began.")] = ()
    sources: Annotated[_Names, Meta(description="Name of the input.")] = ()
    runs: Annotated[_Names, Meta(description="Identifier of a run.")] = ()
    statuses: Annotated[tuple[EventStatus, ...], Meta(description="What is known of the event.")] = ()
    min_confidence: Annotated[float, Meta(ge=0, le=1, description=_SURE)] | UnsetType = UNSET


class StreamQuery(_Query, frozen=True, kw_only=True):
    """Which events are told as they are written."""

    last_event_id: Annotated[int, Meta(ge=0, le=MAX_MEDIA_US, description=_BEHIND)] | UnsetType = UNSET


class _FilterQuery(_Query, frozen=True, kw_only=True, rename=_SPELT):
    from_: Annotated[_Time | None, Meta(description=f"Start of the window: {_FORMS}.")] = None
    to: Annotated[_Time | None, Meta(description=f"End of it, excluded: {_FORMS}.")] = None
    datetime: Annotated[_Span | None, Meta(description=_WINDOW)] = None
    match: Annotated[Match, Meta(description="How an event must lie to the window.")] = "overlap"
    min_duration_us: Annotated[_Whole, Meta(description="How long an event lasts at least.")] | UnsetType = UNSET
    max_duration_us: Annotated[_Whole, Meta(description="How long an event lasts at most.")] | UnsetType = UNSET
    chronicles: Annotated[_Names, Meta(description="Name of the chronicle that the event is of.")] = ()
    as_of: Annotated[_Whole, Meta(description="Ask the log as it was at this sequence number.")] | UnsetType = UNSET


class EventQuery(_FilterQuery, frozen=True, kw_only=True):
    """Which page of events is asked for."""

    order: Annotated[Order, Meta(description="Earliest or latest start first.")] = "start"
    limit: Annotated[int, Meta(ge=1, le=MAX_LIMIT, description="Events on a page.")] = DEFAULT_LIMIT
    cursor: Annotated[str | None, Meta(description="`next_cursor` of the page before, same filters.")] = None
    count: Annotated[Literal["none", "exact"], Meta(description="Whether to count all.")] = "none"


class SummaryQuery(_FilterQuery, frozen=True, kw_only=True):
    """Which events are counted, and by what."""

    by: Annotated[By, Meta(description="What to count by.")] = "type"
    bin_us: Annotated[int, Meta(ge=1, le=MAX_MEDIA_US, description="Size of bins of media time.")] | UnsetType = UNSET
    limit: Annotated[int, Meta(ge=1, le=MAX_KEYS, description="Keys at most, the most frequent.")] = DEFAULT_LIMIT


class ExportQuery(_FilterQuery, frozen=True, kw_only=True):
    """Which events are exported, and how."""

    order: Annotated[Order, Meta(description="Earliest or latest start first.")] = "start"
    format: Annotated[ExportFormat, Meta(description="The form of the file.")] = "jsonl"


_Asked = TypeVar("_Asked", bound=_Query)


def read_query(pairs: Pairs, kind: type[_Asked]) -> tuple[_Asked, EventFilter]:
    """Read the parameters of a request about events.

    Parameters
    ----------
    pairs : names and values in the order of the request.

    Returns
    -------
    What was asked, and the events that are wanted.

    Raises
    ------
    QueryError
        If a name is unknown (a mistyped one would silently restrict nothing), a value is malformed, or a parameter
        that has one value comes twice.

    Examples
    --------
    >>> asked, wanted = read_query([("type", "overtake"), ("role.overtaker", "car7"), ("limit", "5")], EventQuery)
    >>> wanted.types, wanted.roles, asked.limit
    (('overtake',), (('overtaker', ('car7',)),), 5)
    """
    values: dict[str, list[str]] = {}
    roles: dict[str, list[str]] = {}
    for name, value in pairs:
        if name.startswith(ROLE_PREFIX) and name != ROLE_PREFIX:
            roles.setdefault(name.removeprefix(ROLE_PREFIX), []).append(value)
        elif name in kind.__struct_encode_fields__:
            values.setdefault(name, []).append(value)
        else:
            names = kind.__struct_encode_fields__
            expected = f"query: expected {', '.join(names)} or role.NAME"
            raise QueryError(f"{expected}, got {name!r}{hinted(name, names)}", parameter=name)
    for name, some in values.items():
        if len(some) > 1 and name not in _REPEATABLE:
            raise QueryError(f"{name}: expected one value, got {some!r}", parameter=name)
    given = {name: some if name in _REPEATABLE else some[0] for name, some in values.items()}
    try:
        asked = convert(given, kind, strict=False)
    except ValidationError as error:
        name = re.findall(r"\$\.(\w+)", str(error))[0]
        raise QueryError(f"{name}: expected {_wanted(kind, name)}, got {given[name]!r}", parameter=name) from error
    return asked, _filter(asked, roles)


def read_stream_question(pairs: Pairs, last_event_id: str | None) -> tuple[EventFilter, int | None]:
    """Read which events are wanted as they come, and after which number; None for those that are not written yet.

    Parameters
    ----------
    last_event_id : the header of that name, which a browser sends when it connects again; it wins.

    Raises
    ------
    QueryError
        As `read_query`.
    """
    if last_event_id is not None:
        pairs = [*(pair for pair in pairs if pair[0] != "last_event_id"), ("last_event_id", last_event_id)]
    asked, wanted = read_query(pairs, StreamQuery)
    return wanted, None if asked.last_event_id is UNSET else asked.last_event_id


def taking(kind: type[_Query]) -> JsonObject:
    """Describe the parameters of a request about events, for the OpenAPI description of its route."""
    described: list[JsonObject] = [
        {"name": name, "in": "query", "required": False, "description": schema.pop("description"), "schema": schema}
        for name, schema in _schemas(kind).items()
    ]
    role: JsonObject = {"type": "array", "items": _TEXT}
    described.append(describe_roles(role, "as in `role.overtaker=car7`. Repeat for alternatives."))
    return {"parameters": described}


def describe_roles(role: JsonObject = _TEXT, more: str = "as in `role.overtaker=car7`.") -> JsonObject:
    """Describe the parameters `role.NAME` for OpenAPI."""
    # Exploded, an object's members become parameters of their own: role.overtaker=car7&role.overtaken=car3.
    roles = {"type": "object", "patternProperties": {r"^role\..+$": role}, "additionalProperties": False}
    described = {"name": "roles", "in": "query", "required": False, "style": "form", "explode": True, "schema": roles}
    return described | {"description": f"An object that fills a role, {more}"}


def _schemas(kind: type[_Query]) -> dict[str, JsonObject]:
    schemas: dict[str, JsonObject] = json.schema(kind)["$defs"][kind.__name__]["properties"]
    return schemas


def _wanted(kind: type[_Query], name: str) -> str:
    """Say what a parameter takes that has words or bounds."""
    schema = _schemas(kind)[name]
    words = schema.get("items", schema).get("enum")
    return " or ".join(words) if words else f"{schema['minimum']} to {schema['maximum']}"


def _filter(asked: _Query, roles: Mapping[str, list[str]]) -> EventFilter:
    given = {name: value for name, value in asdict(asked).items() if value is not UNSET and value is not None}
    fields: dict[str, Any] = {name: given[name] for name in EventFilter.__struct_fields__ if name in given}
    if "datetime" in given:
        fields |= _window(given)
    else:
        fields |= {one: parse_time(given[one], parameter=one.rstrip("_")) for one in ("from_", "to") if one in given}
    return EventFilter(**fields, roles=tuple((name, tuple(actors)) for name, actors in sorted(roles.items())))


def _window(given: Mapping[str, str]) -> dict[str, TimePoint]:
    """Read START/END, as OGC API names a window."""
    ends = given["datetime"].split("/")
    if {"from_", "to"} & given.keys():
        raise FilterError("datetime: expected it without from and to, got both", parameter="datetime")
    if len(ends) != 2:
        expected = "datetime: expected START/END, such as 10s/.."
        raise QueryError(f"{expected}, got {given['datetime']!r}", parameter="datetime")
    named = zip(("from_", "to"), ends, strict=True)
    return {name: parse_time(end, parameter="datetime") for name, end in named if end not in ("..", "")}
