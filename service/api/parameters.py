"""Which parameters do `GET /api/v1/events`, `.../events/stream` and `.../why-not` take, and what do they mean?

One table each says it for both sides: requests are read by it, and OpenAPI shows it. (Declaring them in the route's
signature instead makes the framework spend more time on them than the database needs for the answer.)
"""

import re
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar, get_args  # Any: JSON schemas

from msgspec import Struct

from service.errors import QueryError
from service.questions.explaining import MAX_NEAR_MISSES, AbsenceQuestion
from service.questions.queries import DEFAULT_LIMIT, MAX_LIMIT, MAX_ROLES, MAX_VALUES, EventFilter, Match, Order
from service.records import EventStatus
from service.times import TimePoint, parse_media_us, parse_time

JsonObject = dict[str, Any]
Pairs = Sequence[tuple[str, str]]
Table = Mapping[str, "Parameter"]
_Word = TypeVar("_Word", bound=str)

ROLE_PREFIX = "role."
DEFAULT_NEAR_MISSES = 5

_TEXT: JsonObject = {"type": "string"}
# As `service.times` reads them, up to 10^15 us.
_MICROSECONDS, _SECONDS = r"[0-9]{1,15}", r"[0-9]{1,9}(\.[0-9]{1,9})?s"
_CLOCK = r"([0-9]{1,5}:[0-5]?[0-9]|[0-9]{1,2}):[0-5][0-9](\.[0-9]{1,9})?"
_FORMS = f"^({_MICROSECONDS}|{_SECONDS}|{_CLOCK})$"
_MEDIA_TIME: JsonObject = {"type": "string", "pattern": _FORMS, "examples": ["12500000", "12.5s", "01:23.5"]}
_UTC_TIME: JsonObject = {"type": "string", "format": "date-time", "examples": ["2026-05-01T08:00:00Z"]}
_TIME: JsonObject = {"anyOf": [_MEDIA_TIME, _UTC_TIME]}
_NUMBER = re.compile(r"([0-9]{1,30}\.?[0-9]{0,30}|\.[0-9]{1,30})([eE][+-]?[0-9]{1,3})?")
_TIME_FORMS = "microseconds of media time, `12.5s`, `mm:ss`, or RFC 3339 with an offset"


class EventQuestion(Struct, frozen=True):
    """A request for a page of events, as read from its parameters."""

    wanted: EventFilter
    limit: int
    cursor: str | None


class Parameter(Struct, frozen=True):
    """A query parameter; one that may be repeated is an array in OpenAPI."""

    description: str
    schema: JsonObject
    is_repeatable: bool = False


def _number(default: int, most: int) -> JsonObject:
    return {"type": "integer", "minimum": 1, "maximum": most, "default": default}


def _words(kind: object) -> list[str]:
    return list(get_args(kind))


EVENT_PARAMETERS: Table = {
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
    "order": Parameter("Earliest or latest start first.", _TEXT | {"enum": _words(Order), "default": "start"}),
    "limit": Parameter("Events on a page.", _number(DEFAULT_LIMIT, MAX_LIMIT)),
    "cursor": Parameter("`next_cursor` of the page before, with the same filters.", _TEXT),
}
_STREAMED = ("type", "actor", "road", "source", "run", "status", "min_confidence")
STREAM_PARAMETERS: Table = {name: EVENT_PARAMETERS[name] for name in _STREAMED} | {
    "last_event_id": Parameter("The sequence number after which to begin; the header `Last-Event-ID` wins.", _TEXT)
}
ABSENCE_PARAMETERS: Table = {
    "from": Parameter("Start of the window, media time.", _MEDIA_TIME),
    "to": Parameter("End of the window, excluded, media time.", _MEDIA_TIME),
    "run": Parameter("Identifier of a run; may be left out if the log holds one.", _TEXT),
    "limit": Parameter("Instances at most.", _number(DEFAULT_NEAR_MISSES, MAX_NEAR_MISSES)),
}
AWAITED_PARAMETERS: Table = {
    "at": Parameter("When, media time; the end of the run, if left out.", _MEDIA_TIME),
    **{name: ABSENCE_PARAMETERS[name] for name in ("from", "run", "limit")},
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
    values, roles = _sort_out(pairs, EVENT_PARAMETERS, one_each=False)
    limit = _limit(values, DEFAULT_LIMIT, MAX_LIMIT)
    return EventQuestion(_filter(values, roles), limit, values.get("cursor", [None])[0])


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
    values, roles = _sort_out(pairs, STREAM_PARAMETERS, one_each=False)
    text = values.get("last_event_id", [None])[0] if last_event_id is None else last_event_id
    if text is not None and not (text.isascii() and text.isdigit() and len(text) <= 18):
        expected = "last_event_id: expected a sequence number of this log"
        raise QueryError(f"{expected}, got {text!r}", parameter="last_event_id")
    return _filter(values, roles), None if text is None else int(text)


def read_absence_question(chronicle: str, pairs: Pairs, table: Table = ABSENCE_PARAMETERS) -> AbsenceQuestion:
    """Read the parameters of a request for near misses, or for what is awaited.

    Raises
    ------
    QueryError
        If a name is unknown or comes twice, or a value is malformed.

    Examples
    --------
    >>> question = read_absence_question("overtake", [("role.overtaker", "car7"), ("from", "5s")])
    >>> question.roles, question.start_us, question.limit
    ({'overtaker': 'car7'}, 5000000, 5)
    """
    values, roles = _sort_out(pairs, table, one_each=True)
    if len(roles) > MAX_ROLES:
        raise QueryError(f"role: expected at most {MAX_ROLES} roles, got {len(roles)}", parameter="role")
    times_us = {one: parse_media_us(values[one][0], parameter=one) for one in ("from", "to", "at") if one in values}
    return AbsenceQuestion(
        chronicle=chronicle,
        run=values.get("run", [None])[0],
        roles={name: actors[0] for name, actors in roles.items()},
        start_us=times_us.get("from"),
        end_us=times_us.get("to", times_us.get("at")),
        limit=_limit(values, DEFAULT_NEAR_MISSES, MAX_NEAR_MISSES),
    )


def describe_event_parameters(table: Table = EVENT_PARAMETERS) -> list[JsonObject]:
    """Describe the parameters of events, or of a stream of them, for OpenAPI."""
    return _described(
        table, _several(_TEXT), "An object that fills a role, as in `role.overtaker=car7`. Repeat for alternatives."
    )


def describe_absence_parameters(table: Table = ABSENCE_PARAMETERS, *, name: str) -> list[JsonObject]:
    """Describe the parameters of near misses; `name` is the part of the path that names the chronicle."""
    path: JsonObject = {"name": name, "in": "path", "required": True, "schema": _TEXT}
    return [path, *_described(table, _TEXT, "The object that fills a role, as in `role.overtaker=car7`.")]


def _described(table: Table, role: JsonObject, description: str) -> list[JsonObject]:
    described: list[JsonObject] = [
        {
            "name": name,
            "in": "query",
            "required": False,
            "description": one.description,
            "schema": _several(one.schema) if one.is_repeatable else one.schema,
        }
        for name, one in table.items()
    ]
    # Exploded, an object's members become parameters of their own: role.overtaker=car7&role.overtaken=car3.
    roles = {"type": "object", "patternProperties": {r"^role\..+$": role}, "additionalProperties": False}
    roles["maxProperties"] = MAX_ROLES
    named = {"name": "roles", "in": "query", "required": False, "description": description}
    return [*described, {**named, "style": "form", "explode": True, "schema": roles}]


def _several(schema: JsonObject) -> JsonObject:
    return {"type": "array", "items": schema, "maxItems": MAX_VALUES}


def _filter(values: Mapping[str, list[str]], roles: Mapping[str, list[str]]) -> EventFilter:
    return EventFilter(
        types=_all(values, "type"),
        from_=_time(values, "from"),
        to=_time(values, "to"),
        match=_one_word(values, "match", get_args(Match), "overlap"),
        actors=_all(values, "actor"),
        roles=tuple((name, tuple(actors)) for name, actors in sorted(roles.items())),
        roads=_all(values, "road"),
        sources=_all(values, "source"),
        runs=_all(values, "run"),
        statuses=tuple(_check_word("status", text, get_args(EventStatus)) for text in values.get("status", ())),
        min_confidence=_share(values, "min_confidence"),
        order=_one_word(values, "order", get_args(Order), "start"),
    )


def _sort_out(pairs: Pairs, table: Table, *, one_each: bool) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
    """Collect values by parameter, and actors by role; with `one_each`, a role takes one actor."""
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
    single |= {f"{ROLE_PREFIX}{name}": given for name, given in roles.items() if one_each}
    for name, given in single.items():
        if len(given) > 1:
            raise QueryError(f"{name}: expected one value, got {given!r}", parameter=name)
    return values, roles


def _all(values: Mapping[str, list[str]], name: str) -> tuple[str, ...]:
    return tuple(values.get(name, ()))


def _time(values: Mapping[str, list[str]], name: str) -> TimePoint | None:
    return parse_time(values[name][0], parameter=name) if name in values else None


def _share(values: Mapping[str, list[str]], name: str) -> float | None:
    if name not in values:
        return None
    text = values[name][0]
    if not (_NUMBER.fullmatch(text) and float(text) <= 1):
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
    text = values.get("limit", [str(default)])[0]
    if not (text.isascii() and text.isdigit() and len(text) <= 6 and 1 <= int(text) <= most):
        raise QueryError(f"limit: expected 1 to {most}, got {text!r}", parameter="limit")
    return int(text)
