"""Which instances break exactly one bound of a chronicle, by how much?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chronicles.compilation.network import minimise
from chronicles.compilation.plan import Plan
from chronicles.explanation.assignments import Assignment
from chronicles.explanation.chronicle_text import End, WrittenConstraint
from chronicles.explanation.obligation_readings import ObligationReader


@dataclass(frozen=True, slots=True)
class LoosenedBound:
    """A bound that may be broken: `plan` is compiled with this one bound far out."""

    plan: Plan
    constraint: WrittenConstraint
    end: End
    reader: ObligationReader

    def distance_us(self, nearer_us: int, farther_us: int) -> Sequence[Sequence[int]] | None:
        """Give the minimal network of instances that break the bound by `nearer_us` to `farther_us`.

        Returns
        -------
        None if there can be none.
        """
        points = dict(self.plan.points)
        later, earlier = points[self.constraint.later], points[self.constraint.earlier]
        if later.position == earlier.position:
            return None
        low_us, high_us = self._shell(nearer_us, farther_us)
        offset_us = earlier.offset_us - later.offset_us
        matrix = np.array(self.plan.distance_us, dtype=np.int64)
        for start, end, most_us in (
            (earlier.position, later.position, high_us + offset_us),
            (later.position, earlier.position, -low_us - offset_us),
        ):
            matrix[start, end] = min(matrix[start, end], most_us)
        least = minimise(matrix)
        return None if least is None else [[int(entry) for entry in row] for row in least]

    def broken_by_us(self, assignment: Assignment) -> int:
        """Say by how much an instance breaks the bound."""
        value_us = self.constraint.value_us(self.plan, assignment.times)
        assert value_us is not None, "all events of the instance are there"
        return abs(value_us - self.constraint.bound_us(self.end))

    def _shell(self, nearer_us: int, farther_us: int) -> tuple[int, int]:
        bound_us = self.constraint.bound_us(self.end)
        if self.end == "low":
            return bound_us - farther_us, bound_us - nearer_us
        return bound_us + nearer_us, bound_us + farther_us
