"""How is each part of an explanation said in a sentence?

Times are seconds with three decimals; six only where three would say that there is nothing.
"""

from collections.abc import Iterable, Sequence

from chronicles.events import Event
from chronicles.explanation.explanations import (
    BoundChange,
    ConstraintReading,
    CountReading,
    Failure,
    HoldReading,
    MissingEvent,
    ObligationReading,
    SameValue,
    ValueSpan,
)

_TOLD_AT_MOST = 3


def seconds(us: int) -> str:
    """Write a time or a duration.

    Examples
    --------
    >>> seconds(1_200_004), seconds(-1)
    ('1.200 s', '-0.000001 s')
    """
    return f"{us / 1_000_000:.6f} s" if 0 < abs(us) < 1_000 else f"{us / 1_000_000:.3f} s"


def place(file: str, line: int) -> str:
    """Say where a statement is.

    Examples
    --------
    >>> place("overtake.chronicle", 13), place("<text>", 1)
    ('overtake.chronicle:13', 'line 1')
    """
    return f"line {line}" if file.startswith("<") else f"{file}:{line}"


def of_event(event: Event) -> str:
    """Write an event without its time.

    Examples
    --------
    >>> of_event(Event("beside", ("a", "b"), 0, "false", "true"))
    'beside[a, b]: false -> true'
    """
    change = "" if event.new is None else f": {event.old or 'unknown'} -> {event.new}"
    return f"{event.name}[{', '.join(event.args)}]{change}"


def of_constraint(one: ConstraintReading) -> str:
    """Say what a time difference was, what was allowed, and how much room there was.

    Examples
    --------
    >>> reading = ConstraintReading("t2 - t1 in [100ms, 60s]", 4, "t2", "t1", 61_200_000, 100_000, 60_000_000)
    >>> of_constraint(reading)
    't2 - t1 was too long by 1.200 s: it was 61.200 s, allowed 0.100 s to 60.000 s'
    """
    difference, was = f"{one.later} - {one.earlier}", f"was {seconds(one.value_us)}, allowed {_allowed(one)}"
    wrong = _wrong(one)
    return f"{difference} was {wrong}: it {was}" if wrong else f"{difference} {was}: {_room(one)}"


def of_obligation(one: ObligationReading) -> str:
    """Say what was asked of an interval and what was seen in it."""
    if one.start_us is None or one.end_us is None:
        return f"{one.text} could not be asked, because an event is missing"
    if isinstance(one, HoldReading):
        return _hold(one, one.start_us, one.end_us)
    return _count(one, one.start_us, one.end_us)


def _hold(one: HoldReading, start_us: int, end_us: int) -> str:
    """Say which value was asked, and which was seen since when."""
    window = f"from {seconds(start_us)} to {seconds(end_us)}"
    wanted = "one known value" if one.wanted is None else one.wanted
    asked = f"{one.subject} should have been {wanted} {window}"
    if one.outcome == "open":
        return f"{asked}, and nothing is against it, but the events end before"
    if one.outcome == "met":
        return f"{one.subject} was {' and '.join(map(_span, one.spans))}, asked {window}"
    bad = one.contrary
    if not bad:
        return f"{asked}, but it was not reported by then"
    shown = [_clipped(span, start_us, end_us) for span in bad[:_TOLD_AT_MOST]]
    said = (
        f"{one.subject} was not {wanted} all the time"
        if len(bad) < len(one.spans)
        else f"{one.subject} was not {wanted}"
    )
    return f"{said}: asked {window}, but it was {_joined(shown, len(bad))}{_instead(one.alternatives)}"


def _count(one: CountReading, start_us: int, end_us: int) -> str:
    """Say how many events were asked, and how many came."""
    window = f"from {seconds(start_us)} to {seconds(end_us)}"
    came = _events(one.counted)
    if one.kind == "noevent":
        said = f"no event was allowed {window}, {'but' if one.counted else 'and'} {came}"
    else:
        most = "any number" if one.most is None else str(one.most)
        said = f"{one.least} to {most} events were asked {window}, and {came}"
    if one.outcome == "open":
        return f"{said} so far; the events end before"
    return said + _outside(one, start_us, end_us)


def of_missing(one: MissingEvent) -> str:
    """Say which event did not come, when it should have come, and what came instead."""
    if one.earliest_us is None or one.latest_us is None:
        said = f"{one.label}: no {one.pattern} was found"
    else:
        said = f"{one.label}: no {one.pattern} came from {seconds(one.earliest_us)} to {seconds(one.latest_us)}"
    if one.outside is not None:
        word = "late" if one.outside_us > 0 else "early"
        said += f"; the nearest came at {seconds(one.outside.t_us)}, {seconds(abs(one.outside_us))} too {word}"
    if one.other is not None:
        wrong = [f"its {miss.field} is {miss.got}, not {miss.wanted}" for miss in one.mismatches]
        why = ", ".join(wrong) or "it has one value for two variables that must differ"
        said += f"; {of_event(one.other)} came at {seconds(one.other.t_us)}, but {why}"
    if one.emitters:
        said += f"; such events are emitted by {' and '.join(one.emitters)}"
    return said


def of_failure(one: Failure) -> str:
    """Say what went wrong."""
    match one.subject:
        case None if one.kind == "not selected":
            return "everything is met, but another occurrence was selected"
        case None:
            return "everything is met, but the events end before that is certain"
        case MissingEvent():
            said = of_missing(one.subject)
            return f"{said}; the events end before" if one.kind == "open" else said
        case SameValue(first, second, value):
            return f"?{first} and ?{second} must differ, but both were {value}"
        case ConstraintReading():
            return of_constraint(one.subject)
        case _:
            return of_obligation(one.subject)


def of_change(one: BoundChange, file: str = "<text>") -> str:
    """Say which bound would have to change, and by how much."""
    size = seconds(one.size) if one.unit == "us" else f"{one.size} {'event' if one.size == 1 else 'events'}"
    return f"it would match with {one.after} instead of {one.before} ({place(file, one.line)}): a change of {size}"


def _allowed(one: ConstraintReading) -> str:
    if one.low_us is None:
        return "any time" if one.high_us is None else f"at most {seconds(one.high_us)}"
    low = seconds(one.low_us)
    return f"at least {low}" if one.high_us is None else f"{low} to {seconds(one.high_us)}"


def _wrong(one: ConstraintReading) -> str:
    low_us, high_us = one.slack_low_us, one.slack_high_us
    if low_us is not None and low_us < 0:
        return f"too short by {seconds(-low_us)}"
    return "" if high_us is None or high_us >= 0 else f"too long by {seconds(-high_us)}"


def _room(one: ConstraintReading) -> str:
    low_us, high_us = one.slack_low_us, one.slack_high_us
    parts = [] if low_us is None else [f"{seconds(low_us)} above the least"]
    parts += [] if high_us is None else [f"{seconds(high_us)} below the most"]
    return ", ".join(parts) or "no bound"


def _span(one: ValueSpan) -> str:
    start = "from the beginning" if one.start_us is None else f"from {seconds(one.start_us)}"
    end = "on" if one.end_us is None else f"to {seconds(one.end_us)}"
    return f"{one.value} {start} {end}"


def _clipped(one: ValueSpan, start_us: int, end_us: int) -> str:
    """Say when a value was seen inside an interval, and which event set it."""
    first_us = start_us if one.start_us is None else max(start_us, one.start_us)
    last_us = end_us if one.end_us is None else min(end_us, one.end_us)
    reason = "never reported" if one.change is None else f"since {of_event(one.change)} at {seconds(one.change.t_us)}"
    return f"{one.value} from {seconds(first_us)} to {seconds(last_us)} ({reason})"


def _instead(alternatives: Sequence[str]) -> str:
    if not alternatives:
        return ""
    return f"; throughout that time there was {_joined(alternatives[:_TOLD_AT_MOST], len(alternatives))}"


def _events(events: Sequence[Event]) -> str:
    if not events:
        return "none came"
    shown = [f"{of_event(one)} at {seconds(one.t_us)}" for one in events[:_TOLD_AT_MOST]]
    return f"{len(events)} came: {_joined(shown, len(events))}"


def _outside(one: CountReading, start_us: int, end_us: int) -> str:
    """Say how far off the nearest events outside the interval were."""
    near = [] if one.before is None else [(start_us - one.before.t_us, "before")]
    near += [] if one.after is None else [(one.after.t_us - end_us, "after")]
    if not near:
        return ""
    by_us, word = min(near)
    return f"; the nearest outside came {seconds(by_us)} {word} it"


def _joined(parts: Iterable[str], count: int) -> str:
    shown = list(parts)
    return ", ".join(shown) + (f" and {count - len(shown)} more" if count > len(shown) else "")
