"""How is an explanation written as JSON?

One schema covers both kinds (`explanation.schema.json`, JSON Schema 2020-12). Times are integers in microseconds;
each part also has its sentence, so that a page need not know how to say it.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.resources import files
from typing import Any  # JSON values

from chronicles.events import Event
from chronicles.explanation import sentences
from chronicles.explanation.explanations import (
    BoundChange,
    ConstraintReading,
    CountReading,
    Explanation,
    Failure,
    HoldReading,
    MatchedEvent,
    MissingEvent,
    NearMiss,
    ObligationReading,
    RoleValue,
    WhyNot,
)

VERSION = 1

Json = dict[str, Any]  # Any: a JSON object


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
        "start_us": explanation.start_us,
        "end_us": explanation.end_us,
        "recognised": explanation.recognised,
        "is_complete": explanation.is_complete,
        "near_misses": [_near_miss(one) for one in explanation.near_misses],
    }


def _why(one: Explanation) -> Json:
    return {
        "kind": "why",
        "chronicle": {"name": one.chronicle, "version": one.version},
        "start_us": one.start_us,
        "end_us": one.end_us,
        "roles": _roles(one.roles),
        "events": [_matched(event) for event in one.events],
        "constraints": [_constraint(constraint) for constraint in one.constraints],
        "obligations": [_obligation(obligation) for obligation in one.obligations],
        "emitted": [_event(event) for event in one.emitted],
    }


def _near_miss(one: NearMiss) -> Json:
    return {
        "roles": _roles(one.roles),
        "distance": {"unmet": one.unmet_count, "short_us": one.short_us},
        "failures": [_failure(failure) for failure in one.failures],
        "events": [_matched(event) for event in one.events],
        "missing": [_missing(missing) for missing in one.missing],
        "constraints": [_constraint(constraint) for constraint in one.constraints],
        "obligations": [_obligation(obligation) for obligation in one.obligations],
        "change": None if one.change is None else _change(one.change),
    }


def _roles(roles: Sequence[RoleValue]) -> list[Json]:
    return [{"name": one.name, "value": one.value or None, "source": one.source} for one in roles]


def _event(one: Event) -> Json:
    return {
        "name": one.name,
        "args": list(one.args),
        "t_us": one.t_us,
        "old": one.old,
        "new": one.new,
        "hypotheses": list(one.hypotheses),
    }


def _event_or_none(one: Event | None) -> Json | None:
    return None if one is None else _event(one)


def _matched(one: MatchedEvent) -> Json:
    cause = None if one.emitted_by is None else _why(one.emitted_by)
    return {"label": one.label, "pattern": one.pattern, "event": _event(one.event), "emitted_by": cause}


def _missing(one: MissingEvent) -> Json:
    return {
        "label": one.label,
        "pattern": one.pattern,
        "earliest_us": one.earliest_us,
        "latest_us": one.latest_us,
        "outside": _event_or_none(one.outside),
        "outside_us": one.outside_us,
        "other": _event_or_none(one.other),
        "mismatches": [{"field": miss.field, "wanted": miss.wanted, "got": miss.got} for miss in one.mismatches],
        "emitters": list(one.emitters),
        "sentence": sentences.of_missing(one),
    }


def _constraint(one: ConstraintReading) -> Json:
    return {
        "text": one.text,
        "line": one.line,
        "later": one.later,
        "earlier": one.earlier,
        "value_us": one.value_us,
        "low_us": one.low_us,
        "high_us": one.high_us,
        "slack_low_us": one.slack_low_us,
        "slack_high_us": one.slack_high_us,
        "slack_us": one.slack_us,
        "is_met": one.is_met,
        "sentence": sentences.of_constraint(one),
    }


def _obligation(one: ObligationReading) -> Json:
    return {
        "statement": one.kind,
        "text": one.text,
        "line": one.line,
        "outcome": one.outcome,
        "start_us": one.start_us,
        "end_us": one.end_us,
        "slack_us": one.slack_us,
        "shifts": [{"side": shift.side, "by_us": shift.by_us} for shift in one.shifts],
        "value": _value(one) if isinstance(one, HoldReading) else None,
        "count": _count(one) if isinstance(one, CountReading) else None,
        "sentence": sentences.of_obligation(one),
    }


def _value(one: HoldReading) -> Json:
    return {
        "subject": one.subject,
        "wanted": one.wanted,
        "spans": [
            {
                "value": span.value,
                "start_us": span.start_us,
                "end_us": span.end_us,
                "change": _event_or_none(span.change),
            }
            for span in one.spans
        ],
        "alternatives": list(one.alternatives),
    }


def _count(one: CountReading) -> Json:
    return {
        "least": one.least,
        "most": one.most,
        "events": [_event(event) for event in one.counted],
        "before": _event_or_none(one.before),
        "after": _event_or_none(one.after),
    }


def _failure(one: Failure) -> Json:
    return {"kind": one.kind, "t_us": one.t_us, "sentence": sentences.of_failure(one)}


def _change(one: BoundChange) -> Json:
    return {
        "line": one.line,
        "before": one.before,
        "after": one.after,
        "size": one.size,
        "unit": one.unit,
        "sentence": sentences.of_change(one),
    }
