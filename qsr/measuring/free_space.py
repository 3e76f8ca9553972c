"""How do the two objects of every pair lie to each other in the plane, whatever the roads are like?

Everything is measured twice, from either body: row 0 in the frame of a, row 1 in that of b.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from qsr.measuring.footprints import COS, HALF_LENGTH, HALF_PATH, HALF_WIDTH, SIN, FloatArray, X, Y


@dataclass(frozen=True, slots=True)
class FreeSpace:
    """Hold where the other object of every pair is.

    Attributes
    ----------
    x, y : (2, pairs) of the other one's centre, from this one's.
    ahead, left : (2, pairs) the same, in the frame of this one's body.
    cos_between : (pairs,) cosine of the angle between the headings.
    turn_cos, turn_sin : (pairs,) cosine and sine of that angle, without their signs.

    Examples
    --------
    >>> ends = np.zeros((13, 2, 1))                  # a heads east from the origin, b heads north 8 m in front of it
    >>> ends[X, 1], ends[COS, 0], ends[SIN, 1], ends[HALF_LENGTH], ends[HALF_WIDTH] = 8.0, 1.0, 1.0, 2.0, 1.0
    >>> free = FreeSpace.of(ends)
    >>> free.ahead.tolist(), free.left.tolist(), free.apart_m(ends).tolist()
    ([[8.0], [0.0]], [[0.0], [8.0]], [5.0])
    """

    x: FloatArray
    y: FloatArray
    ahead: FloatArray
    left: FloatArray
    cos_between: FloatArray
    turn_cos: FloatArray
    turn_sin: FloatArray

    @classmethod
    def of(cls, ends: FloatArray) -> Self:
        """Measure pairs.

        Parameters
        ----------
        ends : (13, 2, pairs) columns of the object table: a and b of each pair.
        """
        cos, sin = ends[COS], ends[SIN]
        x, y = ends[X, ::-1] - ends[X], ends[Y, ::-1] - ends[Y]
        cos_between = cos[0] * cos[1] + sin[0] * sin[1]
        return cls(
            x=x,
            y=y,
            ahead=x * cos + y * sin,
            left=y * cos - x * sin,
            cos_between=cos_between,
            turn_cos=np.abs(cos_between),
            turn_sin=np.abs(cos[0] * sin[1] - sin[0] * cos[1]),
        )

    def reach(self, ends: FloatArray, half_width: int) -> tuple[FloatArray, FloatArray]:
        """Add up how far the body, and the box around the other one that is parallel to it, reach forward and aside.

        Parameters
        ----------
        ends : as in `of`.
        half_width : row of the object table: of the body, or of its path.

        Returns
        -------
        (2, pairs) each.
        """
        length, width = ends[HALF_LENGTH], ends[half_width]
        other_length, other_width = length[::-1], width[::-1]
        forward = length + other_length * self.turn_cos + other_width * self.turn_sin
        aside = width + other_length * self.turn_sin + other_width * self.turn_cos
        return forward, aside

    def depth_m(self, ends: FloatArray) -> FloatArray:
        """Measure how far one body would have to be pushed until the two are apart, (pairs,); below 0 where they are.

        Bodies count as no wider than their paths: tracks often begin too wide.
        """
        forward, aside = self.reach(ends, HALF_PATH)
        depth_m: FloatArray = np.minimum(forward - np.abs(self.ahead), aside - np.abs(self.left)).min(axis=0)
        return depth_m

    def apart_m(self, ends: FloatArray) -> FloatArray:
        """Measure between the bodies, (pairs,); 0 where they overlap.

        From either body, the distance to the box around the other one is a lower bound, exact for parallel bodies; the
        larger is off by a few decimetres at most, which is nothing at the distances where cars are called close.
        """
        forward, aside = self.reach(ends, HALF_WIDTH)
        ahead_m = np.maximum(np.abs(self.ahead) - forward, 0.0)
        aside_m = np.maximum(np.abs(self.left) - aside, 0.0)
        apart_m: FloatArray = np.hypot(ahead_m, aside_m).max(axis=0)
        return apart_m
