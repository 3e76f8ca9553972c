"""Does a vision object follow another vehicle now than it did a moment ago?

Trackers exchange two vehicles that pass each other, or let one track slip on to a vehicle whose own track is lost.
Neither shows in one frame. So each body is predicted from its older snapshot, and if what is seen of it is far off, the
question is whether it fits another body better: one that is off as well, in exchange, or one that nobody sees.
"""

import numpy as np
from numpy.typing import NDArray

from anchoring.linking.bodies import NOW, OLD, VX, VY, Bodies, X, Y, looks_of
from anchoring.linking.frame import Frame, RoadMap
from anchoring.linking.linker import fit_costs
from anchoring.settings import AnchoringSettings

BoolArray = NDArray[np.bool_]
LongArray = NDArray[np.int64]

# A pair that misses a window costs this much here: more than any that fits.
_MISSED = 10.0
_SLIP_US = 600_000


def swapped(
    bodies: Bodies, frame: Frame, comparable: BoolArray, *, roads: RoadMap, settings: AnchoringSettings
) -> BoolArray:
    """Find the bodies whose vision object fits another body clearly better.

    Parameters
    ----------
    bodies : as they were before the frame.
    frame : what is seen and predicted now.
    comparable : (n,) bodies that are seen and have a snapshot from before that can be trusted.
    roads : to predict along.
    settings : windows, and how far off is far.

    Returns
    -------
    (n,).
    """
    result = np.zeros(len(bodies), dtype=np.bool_)
    old = bodies.states[OLD]
    elapsed_s = (frame.t_us - bodies.states_us[OLD]) * 1e-6
    off_x = frame.state[X] - old[X] - old[VX] * elapsed_s
    off_y = frame.state[Y] - old[Y] - old[VY] * elapsed_s
    # Straight on is good enough to pass over nearly all bodies.
    suspects = (comparable & (np.hypot(off_x, off_y) > settings.swap_m)).nonzero()[0]
    # A track slips when the other one is lost, not long after.
    is_lost_now = frame.t_us - bodies.states_us[NOW] <= _SLIP_US
    unseen = (bodies.is_established & ~frame.is_seen & is_lost_now).nonzero()[0]
    if len(suspects) + len(unseen) < 2 or not len(suspects):
        return result
    others = np.concatenate([suspects, unseen])
    costs = _costs(bodies, frame, (suspects, others), roads=roads, settings=settings)
    own = costs[np.arange(len(suspects)), np.arange(len(suspects))]
    exchanged = costs[:, : len(suspects)]
    gain = own[:, None] + own - exchanged - exchanged.T
    stolen = own[:, None] - costs[:, len(suspects) :]
    result[suspects] = (gain > 2 * settings.swap_cost).any(axis=1) | (stolen > settings.swap_cost).any(axis=1)
    return result


def _costs(
    bodies: Bodies,
    frame: Frame,
    columns: tuple[LongArray, LongArray],
    *,
    roads: RoadMap,
    settings: AnchoringSettings,
) -> NDArray[np.float64]:
    """Compare what is seen of some bodies with what was expected of others a moment ago."""
    suspects, others = columns
    expected = roads.predicted(bodies, frame.t_us, snapshot=OLD)[:, others]
    # Roads are left out: both are close, and the prediction has followed the road.
    nowhere = np.full(len(others), -1, dtype=np.int32)
    costs = fit_costs(
        looks_of(frame.state[:, suspects], nowhere[: len(suspects)], frame.length_m[suspects]),
        looks_of(expected, nowhere, bodies.length_m[others]),
        (frame.t_us - bodies.states_us[OLD, others]) * 1e-6,
        has_length=~frame.clipped[suspects],
        settings=settings,
    )
    return np.where(np.isfinite(costs), costs, _MISSED)
