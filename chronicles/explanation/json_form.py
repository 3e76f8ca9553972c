"""How is an explanation written as JSON?

One schema covers both kinds (`explanation.schema.json`, JSON Schema 2020-12). Times are integers in microseconds;
each part also has its sentence, so that a page need not know how to say it.
"""

import json
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from importlib.resources import files
from typing import Any  # JSON values

from chronicles.explanation import sentences
from chronicles.explanation.explanations import (
    BoundChange,
    ConstraintReading,
    CountReading,
    Explanation,
    Failure,
    HoldReading,
    MissingEvent,
    NearMiss,
    ObligationReading,
    RoleValue,
    WhyNot,
)

VERSION = 1

Json = dict[str, Any]  # Any: a JSON object

# Parts that are worked out, and those that are sentences, behind the fields of a value.
_WORKED_OUT: dict[type, tuple[str, ...]] = {ConstraintReading: ("slack_low_us", "slack_high_us", "slack_us", "is_met")}
_SENTENCES: dict[type, Callable[[Any], str]] = {
    MissingEvent: sentences.of_missing,
    ConstraintReading: sentences.of_constraint,
    BoundChange: sentences.of_change,
}


def schema() -> Json:
    """Give the schema that every result of `to_json` fits.

    Examples
    --------
    >>> schema()["$schema"]
    'https://json-schema.org/draft/2020-12/schema'
    """
    text = files("chronicles.explanation").joinpath("explanation.schema.json").read_text(encoding="utf-8")
    read: Json = json.loads(text)
    return read


def to_json(explanation: Explanation | WhyNot) -> Json:
    """Write an explanation as plain values: objects, lists, texts, integers, booleans and None.

    Examples
    --------
    >>> to_json(WhyNot("stay", "0a", (("car", "a"),), None, None, 0, (), True))["roles"]
    {'car': 'a'}
    """
    if isinstance(explanation, Explanation):
        return {"version": VERSION, **_why(explanation)}
    return {
        "version": VERSION,
        "kind": "why_not",
        "chronicle": {"name": explanation.chronicle, "version": explanation.version},
        "roles": dict(explanation.roles),
        **_parts(explanation, "start_us", "end_us", "recognised", "floor", "doubtful", "is_complete", "near_misses"),
    }


def _plain(value: Any) -> Any:  # Any: a part of an explanation, and its JSON
    """Write a part: the fields of a value under their names, unless its form is another one."""
    if isinstance(value, tuple):
        return [_plain(one) for one in value]
    form = _FORMS.get(type(value))
    if form is not None:
        return form(value)
    if not is_dataclass(value):
        return value
    names = [field.name for field in fields(value)] + [*_WORKED_OUT.get(type(value), ())]
    written = {name: _plain(getattr(value, name)) for name in names}
    say = _SENTENCES.get(type(value))
    return written if say is None else {**written, "sentence": say(value)}


def _why(one: Explanation) -> Json:
    return {
        "kind": "why",
        "chronicle": {"name": one.chronicle, "version": one.version},
        **_parts(one, "start_us", "end_us", "file", "roles", "events", "constraints", "obligations", "emitted"),
    }


def _near_miss(one: NearMiss) -> Json:
    return {
        "file": one.file,
        "roles": _plain(one.roles),
        "distance": {"unmet": one.unmet_count, "short_us": one.short_us},
        **_parts(one, "failures", "events", "missing", "constraints", "obligations", "change"),
    }


def _obligation(one: ObligationReading) -> Json:
    return {
        "statement": one.kind,
        **_parts(one, "text", "line", "outcome", "start_us", "end_us", "slack_us", "shifts"),
        "value": _parts(one, "subject", "wanted", "spans", "alternatives") if isinstance(one, HoldReading) else None,
        "count": _count(one) if isinstance(one, CountReading) else None,
        "sentence": sentences.of_obligation(one),
    }


def _count(one: CountReading) -> Json:
    return {**_parts(one, "least", "most"), "events": _plain(one.counted), **_parts(one, "before", "after")}


def _parts(one: object, *names: str) -> Json:
    return {name: _plain(getattr(one, name)) for name in names}


def _role(one: RoleValue) -> Json:
    return {"name": one.name, "value": one.value or None, "source": one.source}


def _failure(one: Failure) -> Json:
    said = {"kind": one.kind, "t_us": one.t_us, "sentence": sentences.of_failure(one)}
    return {**said, "because": one.because} if one.because else said


_FORMS: dict[type, Callable[[Any], Json]] = {
    Explanation: _why,
    NearMiss: _near_miss,
    HoldReading: _obligation,
    CountReading: _obligation,
    RoleValue: _role,
    Failure: _failure,
}
