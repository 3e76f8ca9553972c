"""Which parameters do `GET /api/v1/events` and its siblings take, and what do they mean?

One table each says it for both sides: requests are read by it, and OpenAPI shows it. (Declaring them in the route's
signature instead makes the framework spend more time on them than the database needs for the answer.)
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeVar, get_args  # Any: JSON schemas

from msgspec import Struct

from service.errors import QueryError
from service.export.events import FORMATS, ExportFormat
from service.questions.queries import DEFAULT_LIMIT, MAX_LIMIT, EventFilter, Match, Order
from service.questions.summaries import BY, MAX_KEYS, By
from service.records import EventStatus
from service.times import MAX_MEDIA_US, TimePoint, parse_time

JsonObject = dict[str, Any]
Pairs = Sequence[tuple[str, str]]
Table = Mapping[str, "Parameter"]
Count = Literal["none", "exact"]
_Word = TypeVar("_Word", bound=str)

ROLE_PREFIX = "role."

_TEXT: JsonObject = {"type": "string"}
MEDIA_TIME: JsonObject = {"type": "string", "examples": ["12500000", "12.5s", "01:23.5"]}
_TIME: JsonObject = {"type": "string", "examples": ["12500000", "12.5s", "01:23.5", "2026-05-01T08:00:00Z"]}
_TIME_FORMS = "microseconds of media time, `12.5s`, `mm:ss`, or RFC 3339 with an offset"


class EventQuestion(Struct, frozen=True):
    """A request for a page of events, as read from its parameters."""

    wanted: EventFilter
    limit: int
    cursor: str | None
    is_counted: bool


class Parameter(Struct, frozen=True):
    """A query parameter; one that may be repeated is an array in OpenAPI."""

    description: str
    schema: JsonObject
    is_repeatable: bool = False


def _number(default: int, most: int) -> JsonObject:
    return {"type": "integer", "minimum": 1, "maximum": most, "default": default}


def _whole(least: int) -> JsonObject:
    return {"type": "integer", "minimum": least, "maximum": MAX_MEDIA_US}


def _words(kind: object) -> list[str]:
    return list(get_args(kind))


_FILTERS: Table = {
    "type": Parameter("Event type.", _TEXT, is_repeatable=True),
    "from": Parameter(f"Start of the window: {_TIME_FORMS}.", _TIME),
    "to": Parameter(f"End of the window, excluded: {_TIME_FORMS}.", _TIME),
    "match": Parameter("How an event must lie to the window.", _TEXT | {"enum": _words(Match), "default": "overlap"}),
    "actor": Parameter("An object that takes part in any role.", _TEXT, is_repeatable=True),
    "road": Parameter("The road on which the event began.", _TEXT, is_repeatable=True),
    "source": Parameter("Name of the input.", _TEXT, is_repeatable=True),
    "run": Parameter("Identifier of a run.", _TEXT, is_repeatable=True),
    "status": Parameter("What is known of the event.", _TEXT | {"enum": _words(EventStatus)}, is_repeatable=True),
    "min_confidence": Parameter(
        "How sure an event is at least; takes the place of the floors of chronicles.",
        {"type": "number", "minimum": 0, "maximum": 1},
    ),
    "datetime": Parameter("The window as START/END, of which one may be `..`; takes the place of from and to.", _TEXT),
    "min_duration_us": Parameter("How long an event lasts at least.", _whole(0)),
    "max_duration_us": Parameter("How long an event lasts at most.", _whole(0)),
    "chronicle": Parameter("Name of the chronicle that the event is of.", _TEXT, is_repeatable=True),
    "as_of": Parameter("Ask the log as it was when this was its newest sequence number.", _whole(0)),
}
_ORDER = Parameter("Earliest or latest start first.", _TEXT | {"enum": _words(Order), "default": "start"})
EVENT_PARAMETERS: Table = {
    **_FILTERS,
    "order": _ORDER,
    "limit": Parameter("Events on a page.", _number(DEFAULT_LIMIT, MAX_LIMIT)),
    "cursor": Parameter("`next_cursor` of the page before, with the same filters.", _TEXT),
    "count": Parameter("Whether to count all.", _TEXT | {"enum": _words(Count), "default": "none"}),
}
SUMMARY_PARAMETERS: Table = {
    **_FILTERS,
    "by": Parameter("What to count by.", _TEXT | {"enum": _words(By), "default": "type"}),
    "bin_us": Parameter("Size of the bins of media time; none if left out.", _whole(1)),
    "limit": Parameter("Keys at most, those with the most events.", _number(DEFAULT_LIMIT, MAX_KEYS)),
}
EXPORT_PARAMETERS: Table = {
    **_FILTERS,
    "order": _ORDER,
    "format": Parameter("The form of the file.", _TEXT | {"enum": _words(ExportFormat), "default": "jsonl"}),
}
_STREAMED = ("type", "actor", "road", "source", "run", "status", "min_confidence")
STREAM_PARAMETERS: Table = {name: EVENT_PARAMETERS[name] for name in _STREAMED} | {
    "last_event_id": Parameter("The sequence number after which to begin; the header `Last-Event-ID` wins.", _TEXT)
}


def read_question(pairs: Pairs) -> EventQuestion:
    """Read the parameters of a request for events.

    Parameters
    ----------
    pairs : names and values in the order of the request.

    Raises
    ------
    QueryError
        If a name is unknown (a mistyped one would silently restrict nothing), a value is malformed, or a parameter
        that has one value comes twice.

    Examples
    --------
    >>> question = read_question([("type", "overtake"), ("role.overtaker", "car7"), ("limit", "5")])
    >>> question.wanted.types, question.wanted.roles, question.limit
    (('overtake',), (('overtaker', ('car7',)),), 5)
    """
    values, roles = _sort_out(pairs, EVENT_PARAMETERS)
    limit = _limit(values, DEFAULT_LIMIT, MAX_LIMIT)
    is_counted = _one_word(values, "count", get_args(Count), "none") == "exact"
    return EventQuestion(_filter(values, roles), limit, values.get("cursor", [None])[0], is_counted)


def read_summary_question(pairs: Pairs) -> tuple[EventFilter, By, int | None, int]:
    """Read which events are counted, by what, in bins of which size, and for how many keys; raises as above."""
    values, roles = _sort_out(pairs, SUMMARY_PARAMETERS)
    by, bin_us = _one_word(values, "by", BY, "type"), _whole_number(values, "bin_us", 1)
    return _filter(values, roles), by, bin_us, _limit(values, DEFAULT_LIMIT, MAX_KEYS)


def read_export_question(pairs: Pairs) -> tuple[EventFilter, ExportFormat]:
    """Read which events are wanted in which form; raises as above."""
    values, roles = _sort_out(pairs, EXPORT_PARAMETERS)
    return _filter(values, roles), _one_word(values, "format", FORMATS, "jsonl")


def read_stream_question(pairs: Pairs, last_event_id: str | None) -> tuple[EventFilter, int | None]:
    """Read which events are wanted as they come, and after which number; None for those that are not written yet.

    Parameters
    ----------
    last_event_id : the header of that name, which a browser sends when it connects again.

    Raises
    ------
    QueryError
        As `read_question`, and if the number is none.
    """
    values, roles = _sort_out(pairs, STREAM_PARAMETERS)
    text = values.get("last_event_id", [None])[0] if last_event_id is None else last_event_id
    if text is not None and not (text.isascii() and text.isdigit() and len(text) <= 18):
        expected = "last_event_id: expected a sequence number of this log"
        raise QueryError(f"{expected}, got {text!r}", parameter="last_event_id")
    return _filter(values, roles), None if text is None else int(text)


def describe_event_parameters(table: Table = EVENT_PARAMETERS) -> list[JsonObject]:
    """Describe the parameters of events, or of a stream of them, for OpenAPI."""
    described: list[JsonObject] = [
        {
            "name": name,
            "in": "query",
            "required": False,
            "description": one.description,
            "schema": {"type": "array", "items": one.schema} if one.is_repeatable else one.schema,
        }
        for name, one in table.items()
    ]
    role: JsonObject = {"type": "array", "items": _TEXT}
    return [*described, describe_roles(role, "as in `role.overtaker=car7`. Repeat for alternatives.")]


def describe_roles(role: JsonObject = _TEXT, more: str = "as in `role.overtaker=car7`.") -> JsonObject:
    """Describe the parameters `role.NAME` for OpenAPI."""
    # Exploded, an object's members become parameters of their own: role.overtaker=car7&role.overtaken=car3.
    roles = {"type": "object", "patternProperties": {r"^role\..+$": role}, "additionalProperties": False}
    described = {
        "name": "roles",
        "in": "query",
        "required": False,
        "description": f"An object that fills a role, {more}",
    }
    return {**described, "style": "form", "explode": True, "schema": roles}


def _filter(values: Mapping[str, list[str]], roles: Mapping[str, list[str]]) -> EventFilter:
    from_, to = _window(values) if "datetime" in values else (_time(values, "from"), _time(values, "to"))
    return EventFilter(
        types=_all(values, "type"),
        from_=from_,
        to=to,
        match=_one_word(values, "match", get_args(Match), "overlap"),
        actors=_all(values, "actor"),
        roles=tuple((name, tuple(actors)) for name, actors in sorted(roles.items())),
        roads=_all(values, "road"),
        sources=_all(values, "source"),
        runs=_all(values, "run"),
        statuses=tuple(_check_word("status", text, get_args(EventStatus)) for text in values.get("status", ())),
        min_confidence=_share(values, "min_confidence"),
        min_duration_us=_whole_number(values, "min_duration_us", 0),
        max_duration_us=_whole_number(values, "max_duration_us", 0),
        chronicles=_all(values, "chronicle"),
        as_of=_whole_number(values, "as_of", 0),
        order=_one_word(values, "order", get_args(Order), "start"),
    )


def _sort_out(pairs: Pairs, table: Table) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
    """Collect values by parameter, and actors by role."""
    values: dict[str, list[str]] = {}
    roles: dict[str, list[str]] = {}
    for name, value in pairs:
        if name.startswith(ROLE_PREFIX) and name != ROLE_PREFIX:
            roles.setdefault(name.removeprefix(ROLE_PREFIX), []).append(value)
        elif name in table:
            values.setdefault(name, []).append(value)
        else:
            raise QueryError(f"query: expected {', '.join(table)} or role.NAME, got {name!r}", parameter=name)
    single = {name: given for name, given in values.items() if not table[name].is_repeatable}
    for name, given in single.items():
        if len(given) > 1:
            raise QueryError(f"{name}: expected one value, got {given!r}", parameter=name)
    return values, roles


def _all(values: Mapping[str, list[str]], name: str) -> tuple[str, ...]:
    return tuple(values.get(name, ()))


def _time(values: Mapping[str, list[str]], name: str) -> TimePoint | None:
    return parse_time(values[name][0], parameter=name) if name in values else None


def _window(values: Mapping[str, list[str]]) -> tuple[TimePoint | None, TimePoint | None]:
    """Read START/END, as OGC API names a window."""
    text = values["datetime"][0]
    ends = text.split("/")
    if len(ends) != 2 or {"from", "to"} & values.keys():
        expected = "datetime: expected START/END without from and to, such as 10s/.."
        raise QueryError(f"{expected}, got {text!r}", parameter="datetime")
    start, end = (None if one in ("..", "") else parse_time(one, parameter="datetime") for one in ends)
    return start, end


def _whole_number(values: Mapping[str, list[str]], name: str, least: int, most: int = MAX_MEDIA_US) -> int | None:
    if name not in values:
        return None
    text = values[name][0]
    if not (text.isascii() and text.isdigit() and len(text) <= 16 and least <= int(text) <= most):
        raise QueryError(f"{name}: expected {least} to {most}, got {text!r}", parameter=name)
    return int(text)


def _share(values: Mapping[str, list[str]], name: str) -> float | None:
    if name not in values:
        return None
    text = values[name][0]
    if not (text.isascii() and text.replace(".", "", 1).isdigit() and len(text) <= 20 and float(text) <= 1):
        raise QueryError(f"{name}: expected 0 to 1, got {text!r}", parameter=name)
    return float(text)


def _one_word(values: Mapping[str, list[str]], name: str, words: tuple[_Word, ...], default: _Word) -> _Word:
    return _check_word(name, values[name][0], words) if name in values else default


def _check_word(name: str, text: str, words: tuple[_Word, ...]) -> _Word:
    for word in words:
        if word == text:
            return word
    raise QueryError(f"{name}: expected {' or '.join(words)}, got {text!r}", parameter=name)


def _limit(values: Mapping[str, list[str]], default: int, most: int) -> int:
    limit = _whole_number(values, "limit", 1, most)
    return default if limit is None else limit
