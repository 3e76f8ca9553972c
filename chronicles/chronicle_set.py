"""Which chronicles do some texts define?

`load` reads and checks texts and gives a `ChronicleSet`, which every executor takes; a text with errors gives none.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256

from chronicles.compilation.compiler import compile_chronicle
from chronicles.compilation.cost import warn_unjoined
from chronicles.compilation.example_checks import check_examples
from chronicles.compilation.hierarchy import order_by_emission
from chronicles.compilation.names.symbols import Signature, collect_symbols
from chronicles.compilation.names.usage import canonical_texts, print_all, warn_unproduced, warn_unused
from chronicles.compilation.plan import Plan
from chronicles.errors import ChronicleError
from chronicles.language import model
from chronicles.language.parser import parse
from dyknow.language.diagnostics import Diagnostic, Reporter

_VERSION_LENGTH = 12


@dataclass(frozen=True, slots=True)
class ChronicleSet:
    """Chronicles that share one name space, checked and compiled.

    `plans` stand in an order in which every chronicle comes after those whose emitted events it looks at; `defaults`
    gives the value of an attribute before its first change where that is not "unknown"; `texts` the canonical text of
    each chronicle; `warnings` what the check found besides errors; `examples` the examples of the texts, with constants
    replaced by their values; `statement_places` file and line of each statement of each chronicle; `signatures` the
    attributes and messages that the texts declare.
    """

    plans: tuple[Plan, ...]
    defaults: tuple[tuple[str, str], ...]
    texts: tuple[tuple[str, str], ...]
    warnings: tuple[Diagnostic, ...]
    examples: tuple[model.Example, ...] = ()
    statement_places: tuple[tuple[str, tuple[tuple[str, int], ...]], ...] = ()
    signatures: tuple[Signature, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the chronicles in the order of `plans`."""
        return tuple(plan.name for plan in self.plans)

    def plan(self, name: str) -> Plan:
        """Give the plan of a chronicle.

        Raises
        ------
        ChronicleError
            If there is no such chronicle.
        """
        for plan in self.plans:
            if plan.name == name:
                return plan
        raise ChronicleError(f"chronicle set: expected one of {list(self.names)}, got {name!r}")

    @property
    def given(self) -> dict[str, tuple[str, ...]]:
        """Name the events that the chronicles give, with what stands in the places of their arguments."""
        return {name: arguments for plan in self.plans for name, arguments, _ in plan.given}

    def feeding(self, names: Collection[str]) -> "ChronicleSet":
        """Keep the chronicles that events of some names come from, directly or by way of others.

        Examples
        --------
        >>> text = "chronicle {}(t1) {{ event({}[], t1) when recognised {{ emit {}[] }} }}"
        >>> load(text.format("one", "x", "a") + text.format("two", "a", "b") + text.format("rest", "a", "c")).feeding(
        ...     {"b"}).names
        ('one', 'two')
        """
        wanted = set(names)
        for plan in self.plans * len(self.plans):  # what is found last may be what leads to all others
            if not wanted.isdisjoint((plan.name, *plan.produces)):
                wanted |= {plan.name} | plan.consumes | plan.asserts
        return replace(self, plans=tuple(plan for plan in self.plans if plan.name in wanted))


def load(text: str, *, name: str = "<text>") -> ChronicleSet:
    """Read one chronicle text.

    Parameters
    ----------
    text : the whole text.
    name : what messages call it, such as a file name.

    Raises
    ------
    ChronicleError
        With all diagnostics, if the text has an error.

    Examples
    --------
    >>> load("message honk[?car] chronicle twice[?car](t1, t2) { "
    ...      "event(honk[?car], t1) event(honk[?car], t2) t2 - t1 in ]0s, 2s] }").names
    ('twice',)
    >>> load("message honk[?car] chronicle once[?car](t1) { event(hnk[?car], t1) }")
    Traceback (most recent call last):
        ...
    chronicles.errors.ChronicleError: error[C0201]: expected an attribute or a message, got the unknown name 'hnk'
     --> <text>:1:53
      |
    1 | message honk[?car] chronicle once[?car](t1) { event(hnk[?car], t1) }
      |                                                     ^^^
      = help: did you mean 'honk'?
    """
    return load_texts([(name, text)])


def load_texts(texts: Sequence[tuple[str, str]]) -> ChronicleSet:
    """Read several texts, (name, text) each, into one name space.

    Raises
    ------
    ChronicleError
        With all diagnostics of all texts, if one has an error.
    """
    loaded, diagnostics = _read(texts)
    if loaded is None:
        raise ChronicleError.from_diagnostics(diagnostics)
    return loaded


def check_texts(texts: Sequence[tuple[str, str]], produced: Collection[str] | None = None) -> tuple[Diagnostic, ...]:
    """Give everything that is wrong or doubtful in some texts, empty if nothing is.

    Parameters
    ----------
    texts : (name, text) each, as for `load_texts`.
    produced : names of the messages and attributes that the stream has; chronicles that look at others, which no
        chronicle emits either, are doubtful. None if that is not known.
    """
    return _read(texts, produced)[1]


def _read(
    texts: Sequence[tuple[str, str]], produced: Collection[str] | None = None
) -> tuple[ChronicleSet | None, tuple[Diagnostic, ...]]:
    for name, text in texts:
        if not isinstance(text, str):
            raise ChronicleError(f"{name}: expected a chronicle text, got {type(text).__name__} {text!r:.50}")
    names = [name for name, _ in texts]
    doubled = [name for name in set(names) if names.count(name) > 1]
    if doubled:  # messages tell places by the name of the text
        raise ChronicleError(f"chronicle texts: expected names that differ, got {min(doubled)!r} twice")
    reporter = Reporter(dict(texts))
    files = [parse(text, name, reporter) for name, text in texts]
    symbols = collect_symbols(files, reporter)
    chronicles = _chronicles(files, reporter)
    examples = check_examples(files, {one.name: one for one in chronicles}, symbols, reporter)
    printed = print_all(files)
    canonical = canonical_texts(printed)
    digests = {name: sha256(text.encode()).hexdigest()[:_VERSION_LENGTH] for name, text in canonical.items()}
    plans = [compile_chronicle(one, symbols, digests[one.name], reporter) for one in chronicles]
    compiled = [plan for plan in plans if plan is not None]
    places = {one.name: one.name_span for one in chronicles}
    ordered = order_by_emission(compiled, places, reporter)
    if not reporter.error_count:  # what could not be read may be a use
        warn_unused(printed, reporter)
    if produced is not None:
        warn_unproduced(files, produced, reporter)
    for plan in compiled:
        warn_unjoined(plan, places[plan.name], reporter)
    found = reporter.diagnostics
    if reporter.errors:
        return None, found
    texts_of = tuple((plan.name, canonical[plan.name]) for plan in ordered)
    statement_places = tuple((one.name, tuple(part.span[:2] for part in one.statements)) for one in chronicles)
    signatures = tuple(symbols.signatures.values())
    defaults = tuple((one.name, one.default) for one in signatures if one.value is not None)
    return ChronicleSet(ordered, defaults, texts_of, found, examples, statement_places, signatures), found


def _chronicles(files: Iterable[model.ChronicleFile], reporter: Reporter) -> list[model.Chronicle]:
    found: dict[str, model.Chronicle] = {}
    for file in files:
        for one in file.declarations:
            if not isinstance(one, model.Chronicle):
                continue
            if one.name in found:
                first = found[one.name].name_span
                message = f"expected one chronicle {one.name!r}, got another one than at {first.file}:{first.line}"
                related = [(first, "the first")]
                reporter.error("C0206", message, one.name_span, "choose another name", related=related)
            found.setdefault(one.name, one)
    return list(found.values())
