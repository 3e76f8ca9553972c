"""Do chronicles find in their examples what the examples say they find?

An `example` in a chronicle text is a tiny stream and the occurrences expected in it. All chronicles of the loaded texts
run over the stream; those of the example's own text are compared: every expected occurrence must come, and no other.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from chronicles.chronicle_set import ChronicleSet, load_texts
from chronicles.events import Event, Occurrence
from chronicles.language import model
from chronicles.recogniser import recognise
from dyknow.language.durations import format_duration


@dataclass(frozen=True, slots=True)
class ExampleResult:
    """What came of one example.

    Attributes
    ----------
    title : of the example.
    file, line : where it starts.
    matched : occurrences that were expected and came, by time.
    missing : expected occurrences that did not come, as written.
    unexpected : occurrences that came and were not expected, by time.
    """

    title: str
    file: str
    line: int
    matched: tuple[Occurrence, ...]
    missing: tuple[model.ExpectedOccurrence, ...]
    unexpected: tuple[Occurrence, ...]

    @property
    def passed(self) -> bool:
        """Whether all that was expected came, and nothing else."""
        return not self.missing and not self.unexpected


def run_examples(texts: Sequence[tuple[str, str]]) -> tuple[ExampleResult, ...]:
    """Run all examples of some texts, (name, text) each, that share a name space.

    Returns
    -------
    One result an example, in the order of the texts; none if there is no example.

    Raises
    ------
    ChronicleError
        With all diagnostics, if a text has an error.

    Examples
    --------
    >>> text = '''message honk[?car]
    ... chronicle twice[?car](t1, t2) { event(honk[?car], t1) event(honk[?car], t2) t2 - t1 in ]0s, 2s] }
    ... example "two honks" { 1s honk[a] 2s honk[a] expect twice[car=a] 1s..3s }'''
    >>> [result] = run_examples([("horn", text)])
    >>> print(render(result))
    FAIL horn:3: two honks
      - twice[car=a] 1s..3s
      + twice[car=a] 1s..2s
    """
    loaded = load_texts(texts)
    return tuple(_run(example, loaded) for example in loaded.examples)


def render(result: ExampleResult) -> str:
    """Write a result for people: one line, and for a failed example what is missing (-) and what came instead (+)."""
    lines = [f"{'ok  ' if result.passed else 'FAIL'} {result.file}:{result.line}: {result.title}"]
    if not result.passed:
        lines += [f"    {_shown(one.chronicle, one.roles, one)}" for one in result.matched]
        lines += [f"  - {_shown(one.chronicle, dict(one.roles), one)}" for one in result.missing]
        lines += [f"  + {_shown(one.chronicle, one.roles, one)}" for one in result.unexpected]
    return "\n".join(lines)


def _run(example: model.Example, loaded: ChronicleSet) -> ExampleResult:
    events = [_event(one) for one in example.events]
    own = {name for name, places in loaded.statement_places if places[0][0] == example.span.file}
    found = [one for one in recognise(loaded, events, until_us=example.until_us) if one.chronicle in own]
    missing = list(example.expected)
    matched, unexpected = list[Occurrence](), list[Occurrence]()
    for one in found:
        equal = next((wanted for wanted in missing if _is_equal(wanted, one)), None)
        if equal is None:
            unexpected.append(one)
        else:
            matched.append(one)
            missing.remove(equal)
    place = example.span.file, example.span.line
    return ExampleResult(example.title, *place, tuple(matched), tuple(missing), tuple(unexpected))


def _event(one: model.ExampleEvent) -> Event:
    texts = [term.text for term in one.pattern.terms if isinstance(term, model.Literal)]
    arity = len(one.pattern.arguments)
    old, new = texts[arity:] or (None, None)
    return Event(one.pattern.name, tuple(texts[:arity]), one.t_us, old, new)


def _is_equal(expected: model.ExpectedOccurrence, found: Occurrence) -> bool:
    return (
        expected.chronicle == found.chronicle
        and dict(expected.roles) == found.roles
        and (expected.start_us, expected.end_us) == (found.start_us, found.end_us)
    )


def _shown(chronicle: str, roles: Mapping[str, str], interval: Occurrence | model.ExpectedOccurrence) -> str:
    inside = ", ".join(f"{name}={value}" for name, value in roles.items())
    return f"{chronicle}[{inside}] {format_duration(interval.start_us)}..{format_duration(interval.end_us)}"
