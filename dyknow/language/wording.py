"""How is a syntax error said to somebody who has never heard of terminals? "expected ... after ..., got ..."

What is expected is written as a user types it, so no name from inside a grammar ever reaches a message. What may start
where, and which hint helps, is for each language to say.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from dyknow.language.words import Word


@dataclass(frozen=True, slots=True)
class Misfit:
    """A word that does not fit: `words[index]`, or the end of the words; `expected` are the kinds that would."""

    words: Sequence[Word]
    index: int
    expected: frozenset[str]

    @property
    def is_end(self) -> bool:
        """Return whether the words end too early."""
        return self.index == len(self.words)

    def kind(self, offset: int = 0) -> str:
        """Give the kind of the word, or of one near it; "" beyond the words."""
        at = self.index + offset
        return self.words[at].kind if 0 <= at < len(self.words) else ""

    def text(self, offset: int = 0) -> str:
        """Give the word, or one near it; "" beyond the words."""
        at = self.index + offset
        return self.words[at].text if 0 <= at < len(self.words) else ""

    def message(self, expected: str, end: str) -> str:
        """Say what was expected and what came; `end` is what the words are the end of."""
        after = f" after {self.text(-1)!r}" if self.index else ""
        return f"expected {expected}{after}, got {f'the end of the {end}' if self.is_end else repr(self.text())}"


def listed(texts: Iterable[str], nothing: str = "the end") -> str:
    """Join what could have come, each once; what has no text says nothing.

    Examples
    --------
    >>> listed(["','", "", "')'", "a name"]), listed([])
    ("',', ')' or a name", 'the end')
    """
    found = [text for text in dict.fromkeys(texts) if text]
    if len(found) <= 1:
        return "".join(found) or nothing
    return ", ".join(found[:-1]) + " or " + found[-1]


def described(
    kinds: Collection[str], names: Mapping[str, str], spellings: Mapping[str, str], first: Sequence[str] = ()
) -> list[str]:
    """Write kinds of words as a reader would, in the order of their kinds, those of `first` before all.

    Parameters
    ----------
    names : of kinds that have many spellings, or that are said otherwise; the others are quoted as they are typed.

    Examples
    --------
    >>> described({"NAME", "EVERY", "RPAR"}, {"NAME": "a name"}, {"EVERY": "every", "RPAR": ")"}, ["RPAR"])
    ["')'", "'every'", 'a name']
    """
    rank = {kind: place for place, kind in enumerate(first)}
    ordered = sorted(kinds, key=lambda kind: (rank.get(kind, len(rank)), kind))
    return [names[kind] if kind in names else repr(spellings[kind]) for kind in ordered]
