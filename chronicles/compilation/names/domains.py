"""Which values does a domain expression allow?"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ValueSet:
    """A finite set of values, or everything but a finite set (`complement`)."""

    texts: frozenset[str]
    complement: bool = False

    def __contains__(self, text: str) -> bool:
        return (text in self.texts) != self.complement

    @property
    def is_empty(self) -> bool:
        """Whether no value at all is allowed."""
        return not self.complement and not self.texts

    def union(self, other: ValueSet) -> ValueSet:
        """Give the values of either.

        Examples
        --------
        >>> ANY_VALUE.difference(one_of("a")).union(one_of("a")) == ANY_VALUE
        True
        """
        return self.inverse().intersection(other.inverse()).inverse()

    def difference(self, other: ValueSet) -> ValueSet:
        """Give the values of this set that the other lacks."""
        return self.intersection(other.inverse())

    def intersection(self, other: ValueSet) -> ValueSet:
        """Give the values of both.

        Examples
        --------
        >>> sorted(one_of("a", "b").intersection(one_of("b").inverse()).texts)
        ['a']
        """
        if self.complement and other.complement:
            return ValueSet(self.texts | other.texts, complement=True)
        if self.complement:
            return ValueSet(other.texts - self.texts)
        if other.complement:
            return ValueSet(self.texts - other.texts)
        return ValueSet(self.texts & other.texts)

    def inverse(self) -> ValueSet:
        """Give everything else."""
        return ValueSet(self.texts, complement=not self.complement)


ANY_VALUE = ValueSet(frozenset(), complement=True)


def one_of(*texts: str) -> ValueSet:
    """Make the set of exactly these values."""
    return ValueSet(frozenset(texts))
