"""Does a formula compare what can be compared? Checked while it is read, where the places in the text are known.

What a feature is, and which words it can be, is said by the signature. Numbers, texts and variables tell by themselves,
so that ``3 m < 5 s`` is refused without one.
"""

from __future__ import annotations

from dyknow.language.diagnostics import Reporter, suggest
from dyknow.language.reading import Node
from dyknow.mtl.formula import Comparison, Feature, Number, Scaled, Sum, Term, Text, Variable
from dyknow.mtl.kinds import NUMERIC, Kind, Signature, are_comparable, kind_of_unit, units_of, with_article
from dyknow.mtl.printer import print_term


class KindChecker:
    """Reports what has the wrong kind in one text.

    Parameters
    ----------
    reporter : takes what is found.
    signature : kinds of features and the words that they can be; what it does not say is not checked.
    """

    def __init__(self, reporter: Reporter, signature: Signature) -> None:
        self._reporter = reporter
        self._signature = signature

    def check_proposition(self, feature: Feature, tree: Node) -> None:
        """Check a feature that stands alone."""
        kind = self._signature.kinds.get(feature.name, Kind.TRUTH)
        if kind is not Kind.TRUTH:
            message = f"expected a truth value, got {print_term(feature)!r}, which is {with_article(kind)}"
            self._reporter.error("F0401", message, tree.span, f"compare it: {print_term(feature)} = ...")

    def check_comparison(self, comparison: Comparison, tree: Node) -> None:
        """Check both sides of a comparison, and that they go together."""
        left_tree, sign, right_tree = tree.parts
        left, right = comparison.left, comparison.right
        kinds = self._kind_of(left, left_tree), self._kind_of(right, right_tree)
        if kinds[0] is not None and kinds[1] is not None and not are_comparable(kinds[0], kinds[1]):
            if _has_feature(left) or not _has_feature(right):
                self._mismatch(left, kinds[0], kinds[1], right_tree)
            else:
                self._mismatch(right, kinds[1], kinds[0], left_tree)
            return
        unordered = next((kind for kind in kinds if kind is not None and kind not in NUMERIC), None)
        if unordered is not None and comparison.comparator not in ("=", "!="):
            message = f"expected '=' or '!=' between {unordered.value}s, got {comparison.comparator!r}"
            self._reporter.error("F0403", message, sign.span)
            return
        self._check_word(left, right, right_tree)
        self._check_word(right, left, left_tree)

    def _kind_of(self, term: Term, tree: Node) -> Kind | None:
        """Give the kind of a term; None where it is not known, or was wrong and has been reported."""
        match term:
            case Variable():
                return Kind.OBJECT
            case Text():
                return Kind.WORD
            case Number(unit=unit):
                return kind_of_unit(unit)
            case Feature(name):
                return self._signature.kinds.get(name)
            case Scaled(feature=feature):
                return self._number(feature, tree.parts[1])
            case Sum():
                return self._kind_of_sum(term, tree)

    def _kind_of_sum(self, term: Sum, tree: Node) -> Kind | None:
        left_tree, right_tree = tree.parts
        left, right = self._number(term.left, left_tree), self._number(term.right, right_tree)
        if left is None or right is None:
            return left or right
        if not are_comparable(left, right):
            self._mismatch(term.left, left, right, right_tree)
            return None
        return right if left is Kind.NUMBER else left

    def _number(self, term: Term, tree: Node) -> Kind | None:
        kind = self._kind_of(term, tree)
        if kind is None or kind in NUMERIC:
            return kind
        message = f"expected a number to reckon with, got {print_term(term)!r}, which is {with_article(kind)}"
        self._reporter.error("F0404", message, tree.span)
        return None

    def _mismatch(self, sound: Term, expected: Kind, came: Kind, tree: Node) -> None:
        message = f"expected {with_article(expected)}, as {print_term(sound)!r} is, got {with_article(came)}"
        hint = ""
        if units_of(expected) and came in NUMERIC:
            hint = f"units of {expected.value} are {', '.join(units_of(expected))}"
        elif expected is Kind.TRUTH and isinstance(sound, Feature):
            hint = f"truth values stand alone: {print_term(sound)}, or not {print_term(sound)}"
        elif expected is Kind.WORD:
            hint = 'words are written in "quotes"'
        self._reporter.error("F0402", message, tree.span, hint)

    def _check_word(self, feature: Term, word: Term, tree: Node) -> None:
        """Check a word against all that the feature can be: of others the comparison would always say the same."""
        if not isinstance(feature, Feature) or not isinstance(word, Text):
            return
        known = self._signature.values.get(feature.name)
        if known is not None and word.text not in known:
            message = f"expected a value that {feature.name!r} can have, got {word.text!r}"
            self._reporter.error("F0405", message, tree.span, suggest(word.text, known))


def _has_feature(term: Term) -> bool:
    if isinstance(term, Sum):
        return _has_feature(term.left) or _has_feature(term.right)
    return isinstance(term, Feature | Scaled)
