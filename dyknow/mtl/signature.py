"""Which features and sorts may a text of formulas speak of?"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Signature:
    """What a text may speak of: features with their number of arguments, and sorts."""

    features: Mapping[str, int]
    sorts: Collection[str] = ()
