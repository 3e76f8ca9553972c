"""Whether a vision object lies inside another one's body: against a look at every pair."""

import math

import numpy as np

from anchoring.linking.bodies import HEADING, X, Y
from anchoring.linking.fluents import _separate
from anchoring.linking.frame import Frame


def is_separate(frame: Frame, established: np.ndarray, column: int) -> bool:
    if established[column] or not frame.is_seen[column]:
        return True
    for other in np.flatnonzero(frame.is_seen):
        x_m, y_m = frame.state[X : Y + 1, column] - frame.state[X : Y + 1, other]
        cos, sin = math.cos(frame.state[HEADING, other]), math.sin(frame.state[HEADING, other])
        ahead_m, aside_m = abs(x_m * cos + y_m * sin), abs(y_m * cos - x_m * sin)
        is_inside = ahead_m < frame.length_m[other] / 2 and aside_m < frame.width_m[other] / 2
        if other != column and is_inside and (established[other] or other < column):
            return False
    return True


def test_only_what_lies_in_an_older_body_is_not_separate() -> None:
    rng = np.random.default_rng(1)
    said = set()
    for _ in range(30):
        count = int(rng.integers(1, 30))
        state = np.zeros((8, count))
        state[X : Y + 1], state[HEADING] = rng.uniform(0, 30, (2, count)), rng.uniform(-3, 3, count)
        is_seen, established = rng.random((2, count)) < 0.7
        length_m, width_m = rng.uniform(1, 18, count), rng.uniform(0.5, 3, count)
        frame = Frame(
            t_us=0,
            is_seen=is_seen,
            expected_m=state[X : Y + 1],
            state=state,
            clipped=~is_seen,
            length_m=length_m,
            width_m=width_m,
            sigma_m=np.full(count, np.nan),
            has_front=is_seen,
            places=np.full((3, count), -1, np.int32),
        )
        found = _separate(frame, established).tolist()
        assert found == [is_separate(frame, established, column) for column in range(count)]
        said |= set(found)
    assert said == {True, False}
