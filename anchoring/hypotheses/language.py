"""What does a linkage text say? Classes with their norms, and the links between them with their conditions.

The text is read with the workshop of our text languages. Formulas of usual shapes are compiled here; all others are for
a reader of formulas that is given from above, as this package knows no progressor.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import fields
from decimal import Decimal
from functools import partial
from importlib.resources import files
from typing import Any, NamedTuple, Protocol  # Any: the parts of a rule are words, nodes, or None

from anchoring.errors import LinkageError
from anchoring.hypotheses.conditions import Maker, NotLostFor, compiled
from anchoring.hypotheses.hypotheses import Linkage
from anchoring.linking.classes import CLASS_NAMES, VEHICLE, Norms, ObjectClass
from anchoring.linking.fluents import Fluent
from anchoring.observations import Level
from anchoring.settings import AnchoringSettings
from dyknow.language.diagnostics import Hint, near, suggest
from dyknow.language.durations import US_PER_UNIT, split_quantity, to_us
from dyknow.language.grammar import Grammar, load_grammar
from dyknow.language.places import Span
from dyknow.language.reading import Node, Reading, cut, report
from dyknow.language.wording import Misfit, described, listed
from dyknow.language.words import STRANGE, Source, Strange, Word, opened

FLUENTS = frozenset(str(fluent.name).lower() for fluent in Fluent)
LEVELS: Mapping[str, Level] = {"world_object": "world", "on_road_object": "on_road", VEHICLE: "car"}
LOWEST = "vision_object"
_CLASSES = (LOWEST, *LEVELS, *CLASS_NAMES[:-1])
_ENDED = frozenset({"ESTABLISH", "REESTABLISH", "MAINTAIN", ""})  # where a missing ';' shows
_CONDITIONS = ("establish", "reestablish", "maintain")
_UNITS = {"length": {"m": 1.0}, "width": {"m": 1.0}, "speed": {"m/s": 1.0, "km/h": 1 / 3.6}}


class FormulaReader(Protocol):
    """Read a formula that is not compiled; None if it is wrong, which it has told the source's reporter."""

    def __call__(self, words: Sequence[Word], source: Source, *, is_lasting: bool) -> Maker | None:
        """Take the words of a formula; `is_lasting` if it is to be maintained."""


class LinkageText(NamedTuple):
    """Hold what a text says: the links, lowest first, the classes, and how these are told apart."""

    linkages: tuple[Linkage, ...]
    classes: tuple[ObjectClass, ...]
    norms: Norms


def default_text() -> str:
    """Give the text that comes with the package."""
    return files("anchoring.hypotheses").joinpath("default.linkage").read_text(encoding="utf-8")


def default_linkage(settings: AnchoringSettings) -> LinkageText:
    """Read the text that comes with the package."""
    return read_linkage(default_text(), settings, name="default.linkage")


def read_linkage(
    text: str, settings: AnchoringSettings, *, name: str = "linkage", read_formula: FormulaReader | None = None
) -> LinkageText:
    """Read a linkage text.

    Parameters
    ----------
    text : the whole text.
    settings : their durations may be called by name.
    name : file name of the text, for messages.
    read_formula : of formulas of unusual shapes; without one they are refused.

    Raises
    ------
    LinkageError
        If the text is malformed or means nothing; it lists every error found.

    Examples
    --------
    >>> found = default_linkage(AnchoringSettings())
    >>> [(one.level, one.prefix) for one in found.linkages], [one.name for one in found.classes if one.length_m]
    ([('world', 'w'), ('on_road', 'r'), ('car', 'car')], ['car', 'truck', 'bus', 'motorcycle'])
    >>> read_linkage(default_text().replace("establish_us", "establsh_us", 1), AnchoringSettings(), name="my.linkage")
    Traceback (most recent call last):
    anchoring.errors.LinkageError: error[L0202]: expected a setting of time, got 'establsh_us'
      --> my.linkage:18:45
       |
    18 |     establish: (visible and separate) until[establsh_us, oo] (visible and separate and uncontested);
       |                                             ^^^^^^^^^^^
       = help: did you mean 'establish_us'?
    """
    source, words = opened(text, name, "L", _grammar(), _explain)
    pieces = cut(words, lambda before, word: word.kind in ("CLASS", "LINK") and word.line > before.line)
    trees = [tree.parts[0] for piece in pieces if (tree := _parse(piece, source)) is not None]
    source.reporter.raise_if_any(LinkageError)
    builder = _Builder(source, settings, read_formula)
    classes = tuple(builder.object_class(tree) for tree in trees if tree.rule == "class")
    linkages = tuple(builder.linkage(tree) for tree in trees if tree.rule == "link")
    end = words[-1].span(name) if words else Span(name, 1, 1, 1, 2)
    builder.check_whole(classes, end)
    source.reporter.raise_if_any(LinkageError)
    return LinkageText(linkages, classes, Norms(classes))


class _Builder:
    """Builds classes and links out of their trees."""

    def __init__(self, source: Source, settings: AnchoringSettings, read_formula: FormulaReader | None) -> None:
        self._source, self._read_formula = source, read_formula
        values = ((one.name, getattr(settings, one.name)) for one in fields(settings))
        self._settings_us: dict[str, int] = {name: value for name, value in values if name.endswith("_us")}
        self._classes: dict[str, Span] = {}
        self._prefixes: dict[str, Span] = {}
        self._top = LOWEST  # of the chain of links so far

    def object_class(self, tree: Node) -> ObjectClass:
        name, parent, *norms = tree.parts
        self._expect(name, _CLASSES, "a class that DyKnow knows")
        self._note(name.text, name.span(self._source.file), self._classes, "class")
        if parent is not None:
            self._expect(parent, [one for one in self._classes if one != name.text], "a class from further above")
        found: dict[str, Any] = {}  # Any: values of the fields of a class
        places: dict[str, Span] = {}
        for norm in (one for one in norms if one is not None):
            self._note(norm.rule, norm.span, places, "norm")
            if norm.rule == "sensor":
                self._expect(name, ["world_object"], "'world_object' as what has others per sensor")
                self._expect(norm.parts[0], [LOWEST], "the lowest class")
                found["is_per_sensor"] = True
                continue
            amounts = tuple(self._amount(word, norm.rule) for word in norm.parts)
            found.update({"top_speed_mps": amounts[0]} if norm.rule == "speed" else {f"{norm.rule}_m": amounts})
        return ObjectClass(name.text, "" if parent is None else parent.text, **found)

    def linkage(self, tree: Node) -> Linkage:
        lower, upper, prefix, *conditions = tree.parts
        self._expect(lower, [self._top], "the upper class of the link above" if self._prefixes else "the lowest class")
        above = {LOWEST: ["world_object"], "world_object": ["on_road_object", VEHICLE]}.get(self._top, [VEHICLE])
        self._expect(upper, [one for one in above if one in self._classes], "a class of objects above")
        self._note(prefix.text, prefix.span(self._source.file), self._prefixes, "name of objects")
        if prefix.text[-1].isdigit():  # car1 and 2 would be car and 12
            self._error("L0208", f"expected a name that ends in no digit, got {prefix.text!r}", prefix)
        self._top = upper.text
        places: dict[str, Span] = {}
        unused: Maker = partial(NotLostFor, {})  # in the place of a condition that is missing or wrong
        makers = dict.fromkeys(_CONDITIONS, unused)
        for condition in conditions:
            kind, *parts = condition.parts
            self._note(kind.text, kind.span(self._source.file), places, "condition")
            makers[kind.text] = self._condition(parts, is_lasting=kind.text == "maintain") or unused
        missing = [kind for kind in _CONDITIONS if kind not in places]
        if missing:
            self._error("L0205", f"expected {listed(map(repr, missing))} as well, got {len(places)} conditions", upper)
        return Linkage(LEVELS.get(upper.text, "car"), prefix.text, **makers)

    def check_whole(self, classes: Sequence[ObjectClass], end: Span) -> None:
        """Check what no statement says alone."""
        if self._top != VEHICLE:
            self._source.reporter.error("L0204", f"expected links up to {VEHICLE!r}, got an end at {self._top!r}", end)
        if not any(one.name in CLASS_NAMES and one.length_m and one.width_m for one in classes):
            self._source.reporter.error("L0206", "expected a class with length and width, got none", end)

    def _condition(self, parts: list[Any], *, is_lasting: bool) -> Maker | None:
        words = list(self._with_durations(parts))
        maker = compiled(" ".join(word.text for word in words), FLUENTS, is_lasting=is_lasting)
        if maker is None and self._read_formula is not None:
            return self._read_formula(words, self._source, is_lasting=is_lasting)
        if maker is None:
            self._error("L0207", "expected a formula of a shape that is compiled, got another", words[0])
        return maker

    def _with_durations(self, parts: list[Any]) -> Iterator[Word]:
        """Put microseconds in the place of settings and of other units of time."""
        for part in parts:
            if isinstance(part, Word):
                us = _us(part)
                yield part if us is None else part._replace(text=f"{us}us")
                continue
            factor, setting, more = part.parts
            self._expect(setting, self._settings_us, "a setting of time", "L0202")
            us = int(Decimal(factor.text if factor else 1) * self._settings_us.get(setting.text, 0))
            more_us = _us(more) if more else 0
            if more_us is None:
                self._error("L0202", f"expected a duration, got {more.text!r}", more)
            yield Word("QUANTITY", f"{us + (more_us or 0)}us", part.span.line, part.span.column, part.span.end_column)

    def _amount(self, word: Word, norm: str) -> float:
        digits, unit = split_quantity(word.text)
        if unit not in _UNITS[norm] or not 0 < float(digits) < 1e6:
            expected = f"a {norm} above 0 in {listed(_UNITS[norm])}"
            self._error("L0301", f"expected {expected}, got {word.text!r}", word)
        return float(digits) * _UNITS[norm].get(unit, 1.0)

    def _expect(self, word: Word, known: Collection[str], expected: str, code: str = "L0201") -> None:
        if word.text not in known:
            self._error(code, f"expected {expected}, got {word.text!r}", word, suggest(word.text, known))

    def _note(self, name: str, span: Span, places: dict[str, Span], what: str) -> None:
        if name in places:
            message = f"expected a new {what}, got {name!r} again"
            self._source.reporter.error("L0203", message, span, related=[(places[name], "the first")])
        places.setdefault(name, span)

    def _error(self, code: str, message: str, word: Word, hint: str | Hint = "") -> None:
        self._source.reporter.error(code, message, word.span(self._source.file), hint)


def _us(word: Word) -> int | None:
    digits, unit = split_quantity(word.text) if word.kind == "QUANTITY" else ("", "")
    return to_us(digits, US_PER_UNIT[unit]) if unit in US_PER_UNIT else None


def _grammar() -> Grammar:
    return load_grammar("anchoring.hypotheses", "linkage.lark", "statement")


def _parse(words: list[Word], source: Source) -> Node | None:
    """Parse a statement; None if the words do not fit or one is strange, which is reported already."""
    if any(word.kind == STRANGE for word in words):
        return None
    reading = Reading(_grammar(), "statement", words, source.file)
    if reading.failed_at is None:
        tree: Node = reading.tree
        return tree
    misfit, spellings = reading.misfit(reading.failed_at), _grammar().spellings
    hint = near(misfit.text(), [spellings[kind] for kind in misfit.expected if spellings.get(kind, ":").isalpha()])
    if misfit.expected == {"$END"}:
        hint = near(misfit.text(), ["class", "link"]) or Hint("statements start with 'class' or 'link'")
    elif "SEMICOLON" in misfit.expected and misfit.kind() in _ENDED:
        hint = Hint("conditions and classes end with ';'")
    elif "NAME" in misfit.expected and misfit.text().isidentifier():
        hint = Hint(f"{misfit.text()!r} is a word of the language; choose another name")
    report(source, misfit, misfit.message(_expected(misfit, spellings), "statement"), hint)
    return None


def _expected(misfit: Misfit, spellings: Mapping[str, str]) -> str:
    if "SIGN" in misfit.expected:
        return "a formula" + (" or ';'" if "SEMICOLON" in misfit.expected else "")
    return listed(described(misfit.expected, _KINDS, spellings))


_KINDS = {
    "NAME": "a name",
    "QUANTITY": "a quantity such as 4.5 m",
    "SETTING": "a setting of time such as swap_us",
    "$END": "the end of the statement",
}


def _explain(text: str, at: int, _before: str) -> Strange:
    return Strange(text[at], Hint(next((hint for characters, hint in _HINTS.items() if text[at] in characters), "")))


_HINTS = {"±": "write 4.5 m spread 0.8 m", "{}": "a ':' opens, ';' ends", "&∧": "write 'and'", "|∨": "write 'or'"}
