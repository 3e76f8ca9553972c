"""Which statements does a KPL text have, and where is it malformed?

The words are read once and cut into statements; each is parsed on its own, so one reading finds one malformed place in
each statement.
"""

from typing import Any  # the parts of a rule are words, nodes, or None

from dyknow.errors import KplError
from dyknow.kpl import model
from dyknow.kpl.model import Constraint, ConstraintKind
from dyknow.kpl.syntax_errors import STATEMENT_WORDS, describe_misfit, explain_character
from dyknow.language.diagnostics import Reporter
from dyknow.language.durations import LARGEST_US, US_PER_UNIT, split_quantity, to_us
from dyknow.language.grammar import Grammar, load_grammar
from dyknow.language.reading import Node, Reading, cut, report
from dyknow.language.words import STRANGE, Source, Word, opened
from dyknow.streams.mediation import MediationKind

_STATEMENT_KINDS = frozenset(word.upper() for word in STATEMENT_WORDS)


def parse_kpl(text: str, *, name: str = "kpl") -> model.Specification:
    """Read a KPL text.

    Parameters
    ----------
    text : the whole text.
    name : its file name, for messages.

    Returns
    -------
    The statements in their order; whether they mean anything is for `dyknow.kpl.checks` to say.

    Raises
    ------
    KplError
        If the text is malformed; it lists one error for each malformed statement.

    Examples
    --------
    >>> parse_kpl("source float gps; strmgen pos = gps;").statements[1]
    GeneratorDeclaration(label=Label(name=Name(text='pos'), arguments=()), function=Name(text='gps'), inputs=())
    >>> parse_kpl("stream fast = pos with sample evry 100ms;")
    Traceback (most recent call last):
    dyknow.errors.KplError: error[K0102]: expected 'every' after 'sample', got 'evry'
     --> kpl:1:31
      |
    1 | stream fast = pos with sample evry 100ms;
      |                               ^^^^
      = help: did you mean 'every'?
    """
    specification, _, reporter = open_kpl(text, name)
    reporter.raise_if_any(KplError)
    return specification


def open_kpl(text: str, name: str) -> tuple[model.Specification, frozenset[str], Reporter]:
    """Read the statements that are well formed and report the others; see `parse_kpl`.

    Returns
    -------
    The statements, every name in the malformed ones (those may be what they were to declare), and who has the findings.

    Examples
    --------
    >>> specification, doubtful, reporter = open_kpl("source float gps strmgen pos = gps;", "kpl")
    >>> len(specification.statements), "pos" in doubtful, reporter.error_count
    (0, True, 1)
    """
    source, words = _opened(text, name)
    builder = TreeBuilder(source)
    statements: list[model.Statement] = []
    doubtful: set[str] = set()
    for piece in cut(words, _starts_statement):
        tree = _parse(piece, "statement", source)
        if tree is None:
            doubtful.update(word.text for word in piece if word.text.isidentifier())
        else:
            statements.append(builder.statement(tree))
    return model.Specification(tuple(statements)), frozenset(doubtful), source.reporter


def open_constraints(text: str, name: str) -> tuple[tuple[model.Constraint, ...], Reporter]:
    """Read the constraints of a policy that stands alone.

    Examples
    --------
    >>> constraints, _ = open_constraints("sample every 200ms, max delay oo", "policy")
    >>> [(one.kind.value, one.us) for one in constraints]
    [('sample every', 200000), ('max delay', None)]
    """
    source, words = _opened(text, name)
    tree = _parse(words, "policy", source)
    return TreeBuilder(source).constraints(tree) if tree is not None else (), source.reporter


def parse_type(text: str, *, name: str = "type") -> model.Type:
    """Read a type that stands alone.

    Raises
    ------
    KplError
        If the text is malformed.

    Examples
    --------
    >>> str(parse_type("set(<float,float>)"))
    'set(<float, float>)'
    """
    source, words = _opened(text, name)
    tree = _parse(words, "type", source)
    type_ = TreeBuilder(source).type(tree) if tree is not None else None
    source.reporter.raise_if_any(KplError)
    assert type_ is not None
    return type_


def _grammar() -> Grammar:
    return load_grammar("dyknow.kpl", "kpl.lark", "statement", "policy", "type")


def _opened(text: str, name: str) -> tuple[Source, list[Word]]:
    return opened(text, name, "K", _grammar(), explain_character)


def _starts_statement(before: Word, word: Word) -> bool:
    """Tell whether a statement begins: behind a ';', and, where one is missing, with its word in a new line."""
    return before.kind == "SEMICOLON" or (word.kind in _STATEMENT_KINDS and word.line > before.line)


def _parse(words: list[Word], start: str, source: Source) -> Node | None:
    """Parse words from a start symbol; None if they do not fit or if one is strange, which is reported already."""
    if any(word.kind == STRANGE for word in words):
        return None
    reading = Reading(_grammar(), start, words, source.file)
    if reading.failed_at is None:
        tree: Node = reading.tree
        return tree
    misfit = reading.misfit(reading.failed_at)
    if misfit.kind() == "COMMA" and "COMMA" not in misfit.expected and "POLICY_COMMA" in misfit.expected:
        # The comma is not at fault: what follows does not start a constraint, and nothing else may follow here.
        words[misfit.index] = words[misfit.index]._replace(kind="POLICY_COMMA")
        misfit = reading.misfit(misfit.index + 1)
    report(source, misfit, *describe_misfit(misfit, _grammar().spellings))
    return None


_DEEPEST = 20
_WRONG = -1  # microseconds of a duration that was reported; none is negative


class TreeBuilder:
    """Builds the statements of one text; reports durations that are none."""

    def __init__(self, source: Source) -> None:
        self._file, self._reporter = source.file, source.reporter

    def statement(self, tree: Node) -> model.Statement:  # noqa: PLR0911 - one form each
        """Build one statement from its tree."""
        [inner] = tree.parts
        parts: list[Any] = inner.parts  # Any: words, trees, and None for what may be left out
        match inner.rule:
            case "sort":
                return model.SortDeclaration(self._name(parts[0]), self.type(parts[1]) if parts[1] else None)
            case "object":
                return model.ObjectDeclaration(self._name(parts[0]), self._names(parts[1:]))
            case "feature":
                return model.FeatureDeclaration(self.type(parts[0]), self._name(parts[1]), self._names(parts[2:]))
            case "source":
                return model.SourceDeclaration(self.type(parts[0]), self._name(parts[1]))
            case "compunit":
                return model.UnitDeclaration(
                    self.type(parts[0]), self._name(parts[1]), tuple(map(self.type, parts[2:]))
                )
            case "configuration":
                return model.ConfigurationDeclaration(self._name(parts[0]), self.type(parts[1]))
            case "strmgen":
                return self._process(self._label(parts[0]), parts[1], parts[2:])
            case "configure":
                label = model.Label(self._name(parts[0]), (), parts[0].span(self._file))
                return model.ConfigureDeclaration(label, self._name(parts[1]), self._term(parts[2]))
            case _:
                return model.StreamDeclaration(self._name(parts[0]), self._term(parts[1]))

    def constraints(self, policy: Node) -> tuple[Constraint, ...]:
        """Build the constraints of a policy in their order, none if one is wrong; `from a to b` becomes two."""
        parts = [part for part in policy.parts if isinstance(part, Node)]  # not the commas
        constraints = [constraint for part in parts for constraint in self._constraint(part)]
        return () if _WRONG in (constraint.us for constraint in constraints) else tuple(constraints)

    def type(self, tree: Node, depth: int = 0) -> model.Type:
        """Build a type from its tree; ``depth`` counts the types around it."""
        parts: list[Any] = tree.parts
        if depth > _DEEPEST:
            message = f"expected at most {_DEEPEST} types inside each other, got more"
            self._reporter.error("K0106", message, tree.span, "name the inner ones by 'sort'")
            return model.TupleType(())
        match tree.rule:
            case "tuple":
                return model.TupleType(tuple(self.type(part, depth + 1) for part in parts))
            case "set":
                return model.SetType(self.type(parts[0], depth + 1))
            case "collected":
                return model.CollectedType(self.type(parts[0], depth + 1))
            case _:
                return model.NamedType(self._name(parts[0]))

    def _process(self, label: model.Label, made_of: Node | Word, inputs: list[Node | None]) -> model.Producer:
        if isinstance(made_of, Word):
            return model.GeneratorDeclaration(
                label, self._name(made_of), tuple(self._term(one) for one in inputs if one)
            )
        type_, policy, control = made_of.parts
        kind = MediationKind(made_of.rule)
        constraints = self.constraints(policy) if policy else ()
        return model.MediationDeclaration(label, kind, self.type(type_), constraints, model.Term(self._label(control)))

    def _term(self, tree: Node) -> model.Term:
        label, policy = tree.parts
        return model.Term(self._label(label), self.constraints(policy) if policy else ())

    def _constraint(self, tree: Node) -> list[Constraint]:
        kind = ConstraintKind(tree.rule.replace("_", " "))
        values = [self._microseconds(part) for part in tree.parts if part]
        span = tree.span
        if kind is ConstraintKind.FROM and len(values) > 1:
            return [Constraint(kind, values[0], span), Constraint(ConstraintKind.TO, values[1], span)]
        return [Constraint(kind, values[0] if values else None, span)]

    def _microseconds(self, part: Node | Word) -> int | None:
        if isinstance(part, Word):  # now, oo
            return None
        [word] = part.parts
        digits, unit = split_quantity(word.text)
        if not unit and digits.strip("0."):
            message = f"expected a duration with a unit, got {word.text!r}"
            self._reporter.error("K0104", message, part.span, "units are " + ", ".join(US_PER_UNIT))
            return _WRONG
        us = to_us(digits, US_PER_UNIT[unit or "us"])
        if us is None or us > LARGEST_US:
            message = f"expected a whole number of microseconds up to 35 years, got {word.text!r}"
            self._reporter.error("K0105", message, part.span)
            return _WRONG
        return us

    def _name(self, word: Word) -> model.Name:
        return model.Name(word.text, word.span(self._file))

    def _names(self, words: list[Word | None]) -> tuple[model.Name, ...]:
        return tuple(self._name(word) for word in words if word)

    def _label(self, tree: Node) -> model.Label:
        name, *arguments = tree.parts
        return model.Label(self._name(name), self._names(arguments), tree.span)
