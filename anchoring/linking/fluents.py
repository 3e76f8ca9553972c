"""What can conditions talk about? The fluents of one body at one time, packed into a number.

Most bodies have the same values most of the time, so states are shared: a number per body, a mapping per number.

Trackers exchange two vehicles that pass each other, or let one track slip on to a vehicle whose own track is lost.
Neither shows in one frame. So each body is predicted from its older snapshot, and if what is seen of it is far off, the
question is whether it fits another body better: one that is off as well, in exchange, or one that nobody sees.
"""

import math
from collections.abc import Mapping
from enum import IntFlag
from types import MappingProxyType

import numpy as np
from scipy.spatial import KDTree

from anchoring.linking.bodies import HEADING, NOW, OLD, VX, VY, Bodies, X, Y
from anchoring.linking.classes import is_plausible_size
from anchoring.linking.evidence import explained
from anchoring.linking.frame import Frame, RoadMap
from anchoring.observations import BoolArray, FloatArray, LongArray
from anchoring.settings import AnchoringSettings

# What is as unlikely as this for a body is something else; how much more unlikely tells nothing.
_LEAST_NATS = -30.0


class Fluent(IntFlag):
    """Name the fluents; the names in states are those in lower case.

    visible: the vision object is seen in this frame, not guessed.
    separate: it is not inside the body of another object that is older.
    uncontested: it does not look like a car that is lost at the moment.
    on_road: its centre is on a road or in a junction; always, where no roads are known.
    size_ok, speed_ok: a vehicle can be like this; the speed by the norm of its class, as far as that is known.
    no_jump: it is where it was expected.
    same_heading, same_speed, same_size: no vehicle can change so quickly.
    not_swapped: what is seen of it does not fit another body better.
    fits: an unlinked vision object clearly matches a certain lost world object.
    """

    VISIBLE = 1
    SEPARATE = 2
    UNCONTESTED = 4
    ON_ROAD = 8
    SIZE_OK = 16
    SPEED_OK = 32
    NO_JUMP = 64
    SAME_HEADING = 128
    SAME_SPEED = 256
    SAME_SIZE = 512
    NOT_SWAPPED = 1024
    FITS = 2048


class StateTable(dict[int, Mapping[str, bool]]):
    """Turn packed fluents into states, which are read-only, making each state once.

    Examples
    --------
    >>> states = StateTable()
    >>> state = states[Fluent.VISIBLE | Fluent.ON_ROAD]
    >>> state["visible"], state["fits"], states[9] is state
    (True, False, True)
    """

    def __missing__(self, code: int) -> Mapping[str, bool]:
        """Make a state that was not asked for before."""
        values = {str(fluent.name).lower(): bool(code & fluent) for fluent in Fluent}
        return self.setdefault(code, MappingProxyType(values))


def measure(bodies: Bodies, frame: Frame, roads: RoadMap, settings: AnchoringSettings) -> LongArray:
    """Evaluate the fluents of every body, all but ``fits``.

    Parameters
    ----------
    bodies : as they were before the frame.
    frame : what is seen and predicted now.
    roads : without any, everything is on the road.
    settings : limits.

    Returns
    -------
    (n,) int64, the sum of `Fluent` values.
    """
    speed_mps = np.hypot(frame.state[VX], frame.state[VY])
    comparable = _comparable(bodies, frame, settings)
    waits_us = settings.establish_us + settings.contested_us
    values = {
        Fluent.VISIBLE: frame.is_seen,
        Fluent.SEPARATE: _separate(frame, bodies.is_established),
        Fluent.UNCONTESTED: ~bodies.is_contested | (frame.t_us - bodies.linked_us >= waits_us),
        Fluent.ON_ROAD: (frame.places[[0, 2]] >= 0).any(axis=0) | (not roads.has_roads),
        Fluent.SIZE_OK: is_plausible_size(frame.length_m, frame.width_m, settings),
        Fluent.SPEED_OK: bodies.norms.is_plausible_speed(speed_mps, bodies.classes),
        Fluent.NO_JUMP: _no_jump(bodies, frame, settings),
        **_same_motion(bodies, frame, speed_mps, comparable, settings),
        Fluent.NOT_SWAPPED: ~swapped(bodies, frame, comparable, settings),
        Fluent.SAME_SIZE: _same_size(bodies, frame, settings),
    }
    codes: LongArray = np.array([*values], dtype=np.int64) @ np.array([*values.values()])
    return codes


def _comparable(bodies: Bodies, frame: Frame, settings: AnchoringSettings) -> BoolArray:
    """Tell which bodies are seen well, now and in a snapshot that is older but not too old."""
    comparable: BoolArray = frame.is_seen & ~frame.clipped & ~bodies.was_clipped[OLD]
    comparable &= frame.t_us - bodies.states_us[OLD] <= settings.oldest_us
    comparable &= bodies.states_us[OLD] >= bodies.linked_us + settings.settled_us
    return comparable


def jump_limit_m(sigma_m: FloatArray, unseen_s: FloatArray | float, settings: AnchoringSettings) -> FloatArray:
    """Say how far from where it was expected one may be that is known so well, and was unseen for so long."""
    # From low above the road a pixel may be metres: a place that is known no better may move by as much.
    unsure_m: FloatArray = settings.jump_sigmas * np.fmax(sigma_m, 0.0)
    return settings.jump_m + unsure_m + settings.jump_growth_mps2 * unseen_s**2


def _no_jump(bodies: Bodies, frame: Frame, settings: AnchoringSettings) -> BoolArray:
    apart_m = np.hypot(*(frame.state[X : Y + 1] - frame.expected_m))
    unseen_s = (frame.t_us - bodies.states_us[NOW]) * 1e-6
    no_jump: BoolArray = ~frame.is_seen | (apart_m <= jump_limit_m(frame.sigma_m, unseen_s, settings))
    return no_jump


def _same_motion(
    bodies: Bodies, frame: Frame, speed_mps: FloatArray, comparable: BoolArray, settings: AnchoringSettings
) -> dict[Fluent, BoolArray]:
    """Compare what bodies do now with what they did a moment ago."""
    old = bodies.states[OLD]
    age_s = (frame.t_us - bodies.states_us[OLD]) * 1e-6
    old_mps = np.hypot(old[VX], old[VY])
    # By the course: which end is the front of a vehicle that stood is known only some time after it has moved off.
    along = frame.state[VX] * old[VX] + frame.state[VY] * old[VY]
    turned = along < math.cos(settings.turn_rad) * speed_mps * old_mps
    turned &= np.minimum(speed_mps, old_mps) > settings.turn_mps
    slack_mps = settings.speed_slack_mps + settings.acceleration_mps2 * age_s
    rushed = np.abs(speed_mps - old_mps) > slack_mps
    return {Fluent.SAME_HEADING: ~(turned & comparable), Fluent.SAME_SPEED: ~(rushed & comparable)}


def _same_size(bodies: Bodies, frame: Frame, settings: AnchoringSettings) -> BoolArray:
    longer = np.maximum(frame.length_m, bodies.length_m)
    shorter = np.minimum(frame.length_m, bodies.length_m)
    comparable = frame.is_seen & ~frame.clipped & bodies.is_measured()
    same: BoolArray = ~((longer > settings.size_ratio * shorter) & comparable)
    return same


def _separate(frame: Frame, established: BoolArray) -> BoolArray:
    """Tell which bodies are not inside the body of a world object, or of an older vision object."""
    separate: BoolArray = np.ones(len(established), dtype=np.bool_)
    if not (~established & frame.is_seen).any():
        return separate
    seen = frame.is_seen.nonzero()[0]
    centre_m = frame.state[X : Y + 1, seen].T
    reach_m = np.hypot(frame.length_m[seen], frame.width_m[seen]).max() / 2
    near = KDTree(centre_m).query_pairs(reach_m, output_type="ndarray")
    new, other = np.concatenate([near, near[:, ::-1]]).T
    x, y = (centre_m[new] - centre_m[other]).T
    new, other = seen[new], seen[other]
    cos, sin = np.cos(frame.state[HEADING, other]), np.sin(frame.state[HEADING, other])
    inside = np.abs(x * cos + y * sin) < frame.length_m[other] / 2
    inside &= np.abs(y * cos - x * sin) < frame.width_m[other] / 2
    inside &= ~established[new] & (established[other] | (other < new))
    separate[new[inside]] = False
    return separate


def swapped(bodies: Bodies, frame: Frame, comparable: BoolArray, settings: AnchoringSettings) -> BoolArray:
    """Find the bodies whose vision object fits another body clearly better.

    Parameters
    ----------
    bodies : as they were before the frame.
    frame : what is seen and predicted now.
    comparable : (n,) bodies that are seen and have a snapshot from before that can be trusted.
    settings : spreads, and how far off is far.

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
    is_lost_now = frame.t_us - bodies.states_us[NOW] <= settings.slip_us
    unseen = (bodies.is_established & ~frame.is_seen & is_lost_now).nonzero()[0]
    if len(suspects) + len(unseen) < 2 or not len(suspects):
        return result
    others = np.concatenate([suspects, unseen])
    fits = np.maximum(explained(frame.looks(suspects), bodies.looks(others, OLD), settings), _LEAST_NATS)
    own = fits[np.arange(len(suspects)), np.arange(len(suspects))]
    exchanged = fits[:, : len(suspects)]
    gain = exchanged + exchanged.T - own[:, None] - own
    stolen = fits[:, len(suspects) :] - own[:, None]
    result[suspects] = (gain > 2 * settings.margin_nats).any(axis=1) | (stolen > settings.margin_nats).any(axis=1)
    return result
