"""Which parameters does `GET /api/v1/events` take, and what do they mean?

One table says it for both sides: requests are read by it, and OpenAPI shows it. (Declaring them in the route's
signature instead makes the framework spend more time on them than the database needs for the answer.)
"""

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar, get_args  # Any: JSON schemas

from msgspec import Struct

from service.errors import QueryError
from service.questions.queries import DEFAULT_LIMIT, MAX_LIMIT, EventFilter, Match, Order
from service.records import EventStatus
from service.times import TimePoint, parse_time

JsonObject = dict[str, Any]
Pairs = Sequence[tuple[str, str]]
_Word = TypeVar("_Word", bound=str)

ROLE_PREFIX = "role."

_TEXT: JsonObject = {"type": "string"}
_TIME: JsonObject = {"type": "string", "examples": ["12500000", "12.5s", "01:23.5", "2026-05-01T08:00:00Z"]}
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


def _words(kind: object) -> list[str]:
    return list(get_args(kind))


PARAMETERS: Mapping[str, Parameter] = {
    "type": Parameter("Event type.", _TEXT, is_repeatable=True),
    "from": Parameter(f"Start of the window: {_TIME_FORMS}.", _TIME),
    "to": Parameter(f"End of the window, excluded: {_TIME_FORMS}.", _TIME),
    "match": Parameter("How an event must lie to the window.", _TEXT | {"enum": _words(Match), "default": "overlap"}),
    "actor": Parameter("An object that takes part in any role.", _TEXT, is_repeatable=True),
    "road": Parameter("The road on which the event began.", _TEXT, is_repeatable=True),
    "source": Parameter("Name of the input.", _TEXT, is_repeatable=True),
    "run": Parameter("Identifier of a run.", _TEXT, is_repeatable=True),
    "status": Parameter("What is known of the event.", _TEXT | {"enum": _words(EventStatus)}, is_repeatable=True),
    "order": Parameter("Earliest or latest start first.", _TEXT | {"enum": _words(Order), "default": "start"}),
    "limit": Parameter(
        "Events on a page.", {"type": "integer", "minimum": 1, "maximum": MAX_LIMIT, "default": DEFAULT_LIMIT}
    ),
    "cursor": Parameter("`next_cursor` of the page before, with the same filters.", _TEXT),
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
    values, roles = _sort_out(pairs)
    wanted = EventFilter(
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
        order=_one_word(values, "order", get_args(Order), "start"),
    )
    return EventQuestion(wanted, _limit(values), values.get("cursor", [None])[0])


def describe_parameters() -> list[JsonObject]:
    """Describe the parameters for OpenAPI."""
    described = [
        {
            "name": name,
            "in": "query",
            "required": False,
            "description": one.description,
            "schema": {"type": "array", "items": one.schema} if one.is_repeatable else one.schema,
        }
        for name, one in PARAMETERS.items()
    ]
    # Exploded, an object's members become parameters of their own: role.overtaker=car7&role.overtaken=car3.
    roles: JsonObject = {
        "type": "object",
        "patternProperties": {r"^role\..+$": {"type": "array", "items": _TEXT}},
        "additionalProperties": False,
    }
    description = "An object that fills a role, as in `role.overtaker=car7`. Repeat for alternatives."
    role = {"name": "roles", "in": "query", "required": False, "description": description}
    return [*described, {**role, "style": "form", "explode": True, "schema": roles}]


def _sort_out(pairs: Pairs) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
    """Collect values by parameter, and actors by role."""
    values: dict[str, list[str]] = {}
    roles: dict[str, list[str]] = {}
    for name, value in pairs:
        if name.startswith(ROLE_PREFIX) and name != ROLE_PREFIX:
            roles.setdefault(name.removeprefix(ROLE_PREFIX), []).append(value)
        elif name in PARAMETERS:
            values.setdefault(name, []).append(value)
        else:
            raise QueryError(f"query: expected {', '.join(PARAMETERS)} or role.NAME, got {name!r}", parameter=name)
    for name, given in values.items():
        if len(given) > 1 and not PARAMETERS[name].is_repeatable:
            raise QueryError(f"{name}: expected one value, got {given!r}", parameter=name)
    return values, roles


def _all(values: Mapping[str, list[str]], name: str) -> tuple[str, ...]:
    return tuple(values.get(name, ()))


def _time(values: Mapping[str, list[str]], name: str) -> TimePoint | None:
    return parse_time(values[name][0], parameter=name) if name in values else None


def _one_word(values: Mapping[str, list[str]], name: str, words: tuple[_Word, ...], default: _Word) -> _Word:
    return _check_word(name, values[name][0], words) if name in values else default


def _check_word(name: str, text: str, words: tuple[_Word, ...]) -> _Word:
    for word in words:
        if word == text:
            return word
    raise QueryError(f"{name}: expected {' or '.join(words)}, got {text!r}", parameter=name)


def _limit(values: Mapping[str, list[str]]) -> int:
    if "limit" not in values:
        return DEFAULT_LIMIT
    text = values["limit"][0]
    if not (text.isascii() and text.isdigit() and len(text) <= 6 and 1 <= int(text) <= MAX_LIMIT):
        raise QueryError(f"limit: expected 1 to {MAX_LIMIT}, got {text!r}", parameter="limit")
    return int(text)
