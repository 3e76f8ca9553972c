"""Where is a car that nobody sees? On along its road at constant speed; off the roads, straight on."""

import numpy as np

from anchoring.observations import FloatArray, IntArray
from gis.polyline import ReferenceLines


def predict(
    state: FloatArray, road: IntArray, elapsed_s: FloatArray, lines: ReferenceLines | None, *, lateral_s: float
) -> tuple[FloatArray, FloatArray]:
    """Predict bodies from when they were last seen.

    Parameters
    ----------
    state : (8, n) rows x, y, vx, vy, heading, along, across, tangent, as in `anchoring.linking.bodies`.
    road : (n,) -1 for none.
    elapsed_s : (n,) seconds since then.
    lines : the roads' reference lines; None if there are no roads.
    lateral_s : a change of lane that has begun goes on for about this long.

    Returns
    -------
    (2, n) centres, and (n,) turns: by how much heading and velocity have turned with the road.
    """
    centre_m = state[:2] + state[2:4] * elapsed_s
    turn_rad = np.zeros(len(elapsed_s))
    rows = (road >= 0).nonzero()[0]
    if lines is None or not len(rows):
        return centre_m, turn_rad
    then = state.take(rows, axis=1)
    _, _, vx, vy, _, along_m, across_m, tangent_rad = then
    elapsed_s = elapsed_s.take(rows)
    cos, sin = np.cos(tangent_rad), np.sin(tangent_rad)
    ahead_m = (vx * cos + vy * sin) * elapsed_s
    aside_m = (vy * cos - vx * sin) * lateral_s * -np.expm1(-elapsed_s / lateral_s)
    # Only the difference of two points of the line is used, so a prediction starts exactly where the car was.
    road, count = road.take(rows), len(rows)
    points_m, line_rad = lines.points(
        np.concatenate((road, road)),
        np.concatenate((along_m, along_m + ahead_m)),
        np.concatenate((across_m, across_m + aside_m)),
    )
    centre_m[:, rows] = then[:2] + points_m[:, count:] - points_m[:, :count]
    turn_rad[rows] = line_rad[count:] - line_rad[:count]
    return centre_m, turn_rad
