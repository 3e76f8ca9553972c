"""Where do new cars come from? From the edge of all that was ever seen, and seldom from its middle."""

import numpy as np

from anchoring.linking.ways import Looks
from anchoring.observations import BoolArray, FloatArray
from anchoring.settings import AnchoringSettings

_ANGLES_RAD = np.arange(32) * (2 * np.pi / 32)
_DIRECTIONS = np.stack([np.cos(_ANGLES_RAD), np.sin(_ANGLES_RAD)], axis=1)


class Outline:
    """Keep how far something was ever seen in each direction: a convex outline of the view, learned from the traffic.

    Examples
    --------
    >>> outline = Outline()
    >>> outline.widen(np.array([[0.0, 100.0], [0.0, 0.0]]))
    >>> outline.holds(np.array([[50.0, 120.0], [0.0, 0.0]]), slack_m=2.0).tolist()
    [True, False]
    """

    def __init__(self) -> None:
        self._reach_m: FloatArray = np.full((len(_DIRECTIONS), 1), -np.inf)

    def widen(self, centre_m: FloatArray) -> None:
        """Take in places where something is seen, (2, n)."""
        np.maximum(
            self._reach_m, (_DIRECTIONS @ centre_m).max(axis=1, keepdims=True, initial=-np.inf), out=self._reach_m
        )

    def holds(self, points_m: FloatArray, *, slack_m: float) -> BoolArray:
        """Tell which points, (2, n), lie inside, or outside by less than the slack."""
        return np.asarray((_DIRECTIONS @ points_m <= self._reach_m + slack_m).all(axis=0))

    def births_per_m(self, begun: Looks, clipped: BoolArray, settings: AnchoringSettings) -> FloatArray:
        """Tell how many new cars are expected where something began, (n,); ``clipped`` by the edge of the picture."""
        # Of what stands nobody knows from which side it came.
        back_m = settings.edge_m * begun.has_front * np.stack([np.cos(begun.heading_rad), np.sin(begun.heading_rad)])
        inside = self.holds(begun.centre_m.T - back_m, slack_m=settings.outline_slack_m)
        return np.where(clipped | ~inside, settings.edge_births_per_m, settings.births_per_m)
