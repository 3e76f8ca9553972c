"""Which names does a specification declare, and as what?

There are five kinds of names: sorts, objects, features, host code (sources, units and configurations), and labels (of
processes and of streams). One name may be of several kinds, but is declared only once in each.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import TypeVar

from dyknow.kpl import model
from dyknow.kpl.model import Label, Name
from dyknow.language.diagnostics import Hint, Reporter, suggest
from dyknow.language.ways import reached

BASIC_TYPES = ("bool", "int", "float", "string", "time", "object")
_NUMERIC = ("float", "int")
_HOST_CODE = "source, unit or configuration"
_MOST_SUGGESTIONS = 50  # looking for the nearest of thousands of names takes milliseconds

Function = model.SourceDeclaration | model.UnitDeclaration
_Value = TypeVar("_Value")


class Vocabulary:
    """Keeps what the statements of one text declare; reports what is declared twice.

    Parameters
    ----------
    specification : the statements.
    reporter : takes the errors.
    doubtful : names that malformed statements may declare; it is no error to use those.
    """

    def __init__(
        self, specification: model.Specification, reporter: Reporter, doubtful: frozenset[str] = frozenset()
    ) -> None:
        self.sorts: dict[str, model.SortDeclaration] = {}
        self.objects: dict[str, Name] = {}  # each with the name of its sort
        self.features: dict[str, model.FeatureDeclaration] = {}
        self.functions: dict[str, Function] = {}
        self.configurations: dict[str, model.ConfigurationDeclaration] = {}
        self.processes: dict[str, model.Producer] = {}
        self.configures: dict[str, model.ConfigureDeclaration] = {}  # processes without values
        self.streams: dict[str, model.StreamDeclaration] = {}
        self.reporter = reporter
        self._doubtful = doubtful
        self._suggestions_left = _MOST_SUGGESTIONS
        self._declared: dict[tuple[str, str], Name | Label] = {}
        for statement in specification.statements:
            self._enter(statement)

    def knows(self, table: Mapping[str, object], kind: str, name: Name | Label, *, hint: str | Hint = "") -> bool:
        """Tell whether a table has a name; report it if not.

        Parameters
        ----------
        table : one of the tables of this vocabulary.
        kind : what it is a table of, for the message.
        hint : said instead of the nearest known name.
        """
        text = str(name)
        if text in table:
            return True
        stem = name.name.text if isinstance(name, Label) else text
        if stem not in self._doubtful:
            message = f"expected a declared {kind}, got {text!r}"
            self.reporter.error("K0202", message, name.span, hint or self.nearest(text, table))
        return False

    def nearest(self, text: str, known: Iterable[str]) -> Hint:
        """Suggest the nearest of the known names; after many suggestions, which nobody reads, nothing any more."""
        self._suggestions_left -= 1
        return suggest(text, known) if self._suggestions_left >= 0 else Hint()

    def meaning(self, type_: model.Type) -> model.Type:
        """Follow the names of sorts to the type that they stand for, but not into its parts."""
        followed: set[str] = set()
        while isinstance(type_, model.NamedType) and type_.name.text not in followed:
            followed.add(type_.name.text)
            sort = self.sorts.get(type_.name.text)
            type_ = sort.type if sort is not None and sort.type is not None else type_
        return type_

    def output_of(self, process: model.Producer) -> model.Type | None:
        """Give what the stream of a process carries; None if its source or unit is not declared."""
        if isinstance(process, model.MediationDeclaration):
            return process.output
        function = self.functions.get(process.function.text)
        return function.type if function else None

    def are_same(self, one: model.Type, other: model.Type, *, is_interpolated: bool = False) -> bool:
        """Tell whether two types are the same when all sorts are replaced by what they stand for.

        Between two whole numbers of the ``other`` type lies a float, if it is interpolated.
        Each pair is compared once: written out, a few sorts of sorts may be longer than any memory.
        """
        waiting, seen = [(one, other)], set[tuple[model.Type, model.Type]]()
        while waiting:
            pair = waiting.pop()
            if pair in seen:
                continue
            seen.add(pair)
            match self.meaning(pair[0]), self.meaning(pair[1]):
                case model.TupleType(parts), model.TupleType(others) if len(parts) == len(others):
                    waiting += zip(parts, others, strict=True)
                case model.SetType(element), model.SetType(other_element):
                    waiting.append((element, other_element))
                case model.CollectedType(value), model.CollectedType(other_value):
                    waiting.append((value, other_value))
                case model.NamedType(name), model.NamedType(other_name):
                    is_float = is_interpolated and other_name.text == "int"
                    if name.text != ("float" if is_float else other_name.text):
                        return False
                case _:
                    return False
        return True

    def is_numeric(self, type_: model.Type) -> bool:
        """Tell whether values of a type are numbers or tuples of numbers."""
        return all(
            isinstance(leaf, model.TupleType) or (isinstance(leaf, model.NamedType) and leaf.name.text in _NUMERIC)
            for leaf in map(self.meaning, self._tuple_parts(type_))
        )

    def is_made_of_itself(self, name: Name) -> bool:
        """Tell whether a sort occurs in what it stands for."""
        return name.text in reached(self._names_inside(name.text), self._names_inside)

    def _names_inside(self, sort: str) -> list[str]:
        declared = self.sorts.get(sort)
        return [] if declared is None or declared.type is None else [one.text for one in names_in(declared.type)]

    def _tuple_parts(self, type_: model.Type) -> frozenset[model.Type]:
        """Give a type and everything inside it that is reached through tuples alone."""

        def parts_of(one: model.Type) -> tuple[model.Type, ...]:
            inside = self.meaning(one)
            return inside.parts if isinstance(inside, model.TupleType) else ()

        return reached([type_], parts_of)

    def _enter(self, statement: model.Statement) -> None:
        match statement:
            case model.SortDeclaration(name):
                self._declare(self.sorts, "sort", name, statement)
            case model.ObjectDeclaration(sort, names):
                for name in names:
                    self._declare(self.objects, "object", name, sort)
            case model.FeatureDeclaration(_, name):
                self._declare(self.features, "feature", name, statement)
            case model.SourceDeclaration(_, name) | model.UnitDeclaration(_, name):
                self._declare(self.functions, _HOST_CODE, name, statement)
            case model.ConfigurationDeclaration(name):
                self._declare(self.configurations, _HOST_CODE, name, statement)
            case model.GeneratorDeclaration(label) | model.MediationDeclaration(label):
                self._declare(self.processes, "label", label, statement)
            case model.ConfigureDeclaration(label):
                self._declare(self.configures, "label", label, statement)
            case model.StreamDeclaration(name):
                self._declare(self.streams, "label", name, statement)

    def _declare(self, table: dict[str, _Value], kind: str, name: Name | Label, value: _Value) -> None:
        text = str(name)
        earlier = self._declared.setdefault((kind, text), name)
        if kind == "sort" and text in BASIC_TYPES:
            self.reporter.error("K0203", f"expected a new name for a sort, got the basic type {text!r}", name.span)
        elif earlier is not name:
            message = f"expected a new {kind}, got {text!r}, declared in line {earlier.span.line}"
            self.reporter.error("K0201", message, name.span, related=[(earlier.span, "the first")])
        else:
            table[text] = value


def names_in(type_: model.Type) -> Iterator[Name]:
    """Give the names that are written in a type."""
    match type_:
        case model.NamedType(name):
            yield name
        case model.TupleType(parts):
            for part in parts:
                yield from names_in(part)
        case model.SetType(inner) | model.CollectedType(inner):
            yield from names_in(inner)
