"""How is an explanation shown as text?"""

from collections.abc import Iterable, Sequence

from chronicles.explanation import sentences
from chronicles.explanation.explanations import (
    ConstraintReading,
    CountReading,
    Explanation,
    HoldReading,
    MatchedEvent,
    NearMiss,
    ObligationReading,
    RoleValue,
    WhyNot,
)
from chronicles.explanation.sentences import seconds

_COLUMNS = 48


def render(explanation: Explanation | WhyNot) -> str:
    """Write an explanation for people.

    Parameters
    ----------
    explanation : as given by `why` or `why_not`.

    Returns
    -------
    Several lines, each ended by a newline.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> from chronicles.events import Event
    >>> from chronicles.explanation.why_not import why_not
    >>> stay = load("chronicle stay[?car](t1, t2) { event(enter[?car], t1) event(left[?car], t2) t2 - t1 in [0s, 9s] }")
    >>> print(render(why_not(stay, "stay", [Event("enter", ("a",), 0), Event("left", ("a",), 9_500_000)])), end="")
    stay: not recognised; 1 near miss, the nearest first
    <BLANKLINE>
    1. car=a: 1 statement is not met, by 0.500 s
       first: t2 - t1 was too long by 0.500 s: it was 9.500 s, allowed 0.000 s to 9.000 s
         (line 1: t2 - t1 in [0s, 9s])
       it would match with t2 - t1 in [0s, 9500ms] instead of t2 - t1 in [0s, 9s] (line 1): a change of 0.500 s
       time from 0.000 s to 9.500 s
       t1 |^...............................................| 0.000 s  enter[a]
       t2 |...............................................^| 9.500 s  left[a]
    """
    lines = _why(explanation, "") if isinstance(explanation, Explanation) else _why_not(explanation)
    return "".join(f"{line}".rstrip() + "\n" for line in lines)


def _why(one: Explanation, indent: str) -> list[str]:
    span = f"{seconds(one.start_us)} to {seconds(one.end_us)}"
    lines = [f"{one.chronicle}[{_roles(one.roles)}] from {span} was recognised", ""]
    lines += _timeline(one.events, one.obligations)
    lines += ["", "time constraints, the tightest first"]
    for constraint in one.constraints:
        lines += [
            f"  {sentences.of_constraint(constraint)}",
            f"    ({sentences.place(one.file, constraint.line)}: {constraint.text})",
        ]
    lines += ["  none"] * (not one.constraints)
    lines += ["", "what else was asked, the tightest first"]
    for obligation in one.obligations:
        outcome = "" if obligation.outcome == "met" else f"{obligation.outcome.upper()}: "
        slack = "" if obligation.slack_us is None else f": {seconds(obligation.slack_us)} to spare"
        lines += [f"  {outcome}{sentences.of_obligation(obligation)}{slack}"]
        lines += [f"    ({sentences.place(one.file, obligation.line)}: {obligation.text})"]
    lines += ["  nothing"] * (not one.obligations)
    lines += ["", "roles", *(f"  {role.name} = {role.value}, from {role.source}" for role in one.roles)]
    lines += ["", "emitted"] * bool(one.emitted)
    lines += [f"  {sentences.of_event(event)} at {seconds(event.t_us)}" for event in one.emitted]
    for event in one.events:
        if event.emitted_by is not None:
            lines += ["", f"{event.label} was emitted by another chronicle:", *_why(event.emitted_by, indent + "  ")]
    return [indent + line for line in lines] if indent else lines


def _why_not(one: WhyNot) -> list[str]:
    asked = f"[{', '.join(f'{name}={value}' for name, value in one.roles)}]" if one.roles else ""
    count = len(one.near_misses)
    misses = "1 near miss" if count == 1 else f"{count} near misses"
    order = ", the nearest first" if count else ""
    often = {0: "not recognised", 1: "recognised once"}.get(one.recognised, f"recognised {one.recognised} times")
    lines = [f"{one.chronicle}{asked}{_window(one)}: {often}; {misses}{order}"]
    floor = f"below the floor of {one.floor:g}"
    lines += [f"not told: one that is sure to {confidence:.2f}, {floor}" for confidence in one.doubtful]
    for number, miss in enumerate(one.near_misses, 1):
        lines += ["", *_near_miss(number, miss)]
    if not one.is_complete:
        lines += ["", "The search was cut short: there may be nearer ones. Give roles or a time window."]
    return lines


def _near_miss(number: int, miss: NearMiss) -> list[str]:
    count = "1 statement is" if miss.unmet_count == 1 else f"{miss.unmet_count} statements are"
    short = "" if miss.short_us is None else f", by {seconds(miss.short_us)}"
    lines = [f"{_roles(miss.roles) or 'no roles known'}: {count} not met{short}"]
    for index, failure in enumerate(miss.failures):
        order, said, subject = "also" if index else "first", sentences.of_failure(failure), failure.subject
        # What happened on the road comes before what it did to the statement.
        lines += [f"{order}: {failure.because}", f"  so {said}"] if failure.because else [f"{order}: {said}"]
        if isinstance(subject, ConstraintReading | HoldReading | CountReading):
            lines.append(f"  ({sentences.place(miss.file, subject.line)}: {subject.text})")
    unasked = sum(one.outcome == "not asked" for one in miss.obligations)
    if unasked:
        lines.append(f"{unasked} of these could not be asked, because they hang on what is missing")
    if miss.change is not None:
        lines.append(sentences.of_change(miss.change, miss.file))
    lines += _timeline(miss.events, miss.obligations)
    head = f"{number}. "
    return [head + lines[0], *(" " * len(head) + line for line in lines[1:])]


def _window(one: WhyNot) -> str:
    start = "" if one.start_us is None else f" from {seconds(one.start_us)}"
    return start + ("" if one.end_us is None else f" to {seconds(one.end_us)}")


def _roles(roles: Iterable[RoleValue]) -> str:
    return ", ".join(f"{role.name}={role.value}" for role in roles if role.value)


def _timeline(events: Sequence[MatchedEvent], obligations: Sequence[ObligationReading]) -> list[str]:
    """Draw events as ^ and the intervals of obligations as =, or as x where they are not met."""
    asked = [
        (one.start_us, one.end_us, one) for one in obligations if one.start_us is not None and one.end_us is not None
    ]
    times = [one.event.t_us for one in events]
    times += [t_us for start_us, end_us, _ in asked for t_us in (start_us, end_us)]
    if not times:
        return []
    first_us, span_us = min(times), max(1, max(times) - min(times))
    width = max(len(name) for name in (*(one.label for one in events), *(one.kind for _, _, one in asked)))

    def column(t_us: int) -> int:
        """Give the column of a time."""
        return (t_us - first_us) * (_COLUMNS - 1) // span_us

    lines = [f"time from {seconds(first_us)} to {seconds(first_us + span_us)}"]
    for one in events:
        place = column(one.event.t_us)
        bar = "." * place + "^" + "." * (_COLUMNS - 1 - place)
        lines.append(f"{one.label:{width}} |{bar}| {seconds(one.event.t_us)}  {sentences.of_event(one.event)}")
    for start_us, end_us, obligation in sorted(asked, key=lambda entry: (entry[0], entry[1], entry[2].line)):
        start, end = column(start_us), max(column(start_us), column(end_us))
        sign = "=" if obligation.outcome == "met" else "x"
        bar = "." * start + sign * (end - start + 1) + "." * (_COLUMNS - 1 - end)
        lines.append(f"{obligation.kind:{width}} |{bar}| {_said(obligation)}")
    return lines


def _said(one: ObligationReading) -> str:
    return f"{one.subject} {one.wanted or 'known'}" if isinstance(one, HoldReading) else one.text
