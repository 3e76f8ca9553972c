"""Builders of rows to be scored."""

from collections.abc import Sequence

import numpy as np

from service.questions.scoring.object_rows import ObjectRows

Row = tuple[int, str, float, float]


def rows(
    of: Sequence[Row],
    *,
    border: Sequence[int] = (),
    standing: Sequence[int] = (),
    kind: str = "car",
    length_m: float = 4.5,
) -> ObjectRows:
    """Build rows (frame, name, x_m, y_m) of cars heading east; `border` and `standing` list row numbers."""
    table = sorted(enumerate(of), key=lambda pair: pair[1][0])
    count = len(of)
    return ObjectRows(
        frame=np.array([row[0] for _, row in table], np.int64),
        name=np.array([row[1] for _, row in table], np.str_),
        centre_m=np.array([row[2:] for _, row in table], np.float64).reshape(-1, 2),
        heading_rad=np.zeros(count),
        length_m=np.full(count, length_m),
        width_m=np.full(count, 1.8),
        is_border=np.array([number in border for number, _ in table], np.bool_),
        is_standing=np.array([number in standing for number, _ in table], np.bool_),
        kind=np.full(count, kind),
    )
