"""Which features and sorts may a text of formulas speak of, and which values can the features have?"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from dyknow.mtl.kinds import Kind


@dataclass(frozen=True, slots=True)
class Signature:
    """What a text may speak of.

    Attributes
    ----------
    features : each with its number of arguments.
    sorts : of the objects that quantifiers and monitors go over.
    kinds : of the values of features; a feature that is left out can be compared with anything.
    values : all the words that a feature can be; a feature that is left out takes any.

    Examples
    --------
    >>> from dyknow.errors import FormulaError
    >>> from dyknow.mtl.parser import parse_formula
    >>> traffic = Signature({"speed": 1, "class": 1}, kinds={"speed": Kind.SPEED}, values={"class": ("car", "bus")})
    >>> try:
    ...     parse_formula('always (speed[x] < 50 m or class[x] = "cra")', signature=traffic)
    ... except FormulaError as error:
    ...     print((error.line, error.column), *[one.message for one in error.diagnostics], sep="\\n")
    (1, 20)
    expected a speed, as 'speed[x]' is, got a length
    expected a value that 'class' can have, got 'cra'
    """

    features: Mapping[str, int]
    sorts: Collection[str] = ()
    kinds: Mapping[str, Kind] = field(default_factory=dict)
    values: Mapping[str, Collection[str]] = field(default_factory=dict)
