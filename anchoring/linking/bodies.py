"""What is known of every body that is followed? Its last state, two older ones, and its size; as a struct of arrays.

A body is a vision object that is not established yet, or a world object, linked or lost. The older states are snapshots
taken twice a second: what a body was like a moment ago tells whether its vision object has jumped to another vehicle,
and is what the body goes back to then.
"""

import numpy as np
from numpy.typing import NDArray

from anchoring.hypotheses.hypotheses import Chain
from anchoring.linking.classes import CLASS_NAMES, UNKNOWN_CLASS, classify
from anchoring.linking.linker import Looks

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int32]
LongArray = NDArray[np.int64]

# Rows of a state.
X, Y, VX, VY, HEADING, ALONG, ACROSS, TANGENT = range(8)

# Snapshots of a body: the newest state, one up to half a second old, and one from half a second to a second old.
NOW, RECENT, OLD = range(3)
_SNAPSHOT_US = 500_000

# A size is the median of this many samples, taken at most so often once there are a few.
_SIZE_SAMPLES = 15
_SIZE_PERIOD_US = 200_000
_EAGER_SAMPLES = 5

_ARRAYS = (
    "states",
    "states_us",
    "roads",
    "was_clipped",
    "linked_us",
    "seen_us",
    "codes",
    "was_whole",
    "length_m",
    "width_m",
    "classes",
    "told_classes",
    "is_established",
    "is_contested",
    "waits",
    "car_number",
    "_samples_m",
    "_sample_count",
    "_sampled_us",
)


class Bodies:
    """Hold n bodies; column k of every array belongs to ``chains[k]``.

    Attributes
    ----------
    chains : the links above each body.
    states : (3, 8, n) snapshot, row of the state.
    states_us : (3, n) when each was seen.
    roads : (3, n) index of the road, -1 for none.
    was_clipped : (3, n).
    linked_us : (n,) since when the present vision object is linked, or was first seen.
    seen_us : (n,) when each had a vision object last, right or wrong; ``states_us`` goes back when a link is refuted.
    codes : (n,) the fluents of the last frame, -1 for a body that is new.
    was_whole : (n,) True once the body was seen away from the edges of the view.
    length_m, width_m, classes : (n,) medians, and index into ``CLASS_NAMES``.
    told_classes : (n,) the class that the tracker gave last, `UNKNOWN_CLASS` if none: it goes before that of the size.
    is_established : (n,) True for a world object, linked or lost; False for a vision object that may become one.
    waits : (n,) True if a condition of a link wants to see the next state even if it is like the last.
    is_contested : (n,) True for a vision object that looks like a lost car, clearly or not.
    car_number : (n,) number of the symbol while every link up to the car holds, else 0.
    """

    def __init__(self) -> None:
        self.chains: list[Chain] = []
        self.states: FloatArray = np.zeros((3, 8, 0))
        self.states_us: LongArray = np.zeros((3, 0), dtype=np.int64)
        self.roads: IntArray = np.zeros((3, 0), dtype=np.int32)
        self.was_clipped: BoolArray = np.zeros((3, 0), dtype=np.bool_)
        self.linked_us: LongArray = np.zeros(0, dtype=np.int64)
        self.seen_us: LongArray = np.zeros(0, dtype=np.int64)
        self.codes: LongArray = np.zeros(0, dtype=np.int64)
        self.was_whole: BoolArray = np.zeros(0, dtype=np.bool_)
        self.length_m: FloatArray = np.zeros(0)
        self.width_m: FloatArray = np.zeros(0)
        self.classes: IntArray = np.zeros(0, dtype=np.int32)
        self.told_classes: IntArray = np.zeros(0, dtype=np.int32)
        self.is_established: BoolArray = np.zeros(0, dtype=np.bool_)
        self.waits: BoolArray = np.zeros(0, dtype=np.bool_)
        self.is_contested: BoolArray = np.zeros(0, dtype=np.bool_)
        self.car_number: LongArray = np.zeros(0, dtype=np.int64)
        self._samples_m: FloatArray = np.zeros((2, _SIZE_SAMPLES, 0))
        self._sample_count: LongArray = np.zeros(0, dtype=np.int64)
        self._sampled_us: LongArray = np.zeros(0, dtype=np.int64)
        self._snapshot_us = 0

    def __len__(self) -> int:
        return len(self.chains)

    def append(self, t_us: int, chains: list[Chain], state: FloatArray, size_m: FloatArray) -> None:
        """Add bodies that are seen for the first time.

        Parameters
        ----------
        t_us : time of the frame.
        chains : one each.
        state : (8, k). size_m : (2, k) length and width.
        """
        count = len(chains)
        self.chains += chains
        fresh = {
            "states": np.repeat(state[None], 3, axis=0),
            "states_us": np.full((3, count), t_us),
            "roads": np.full((3, count), -1, dtype=np.int32),
            "was_clipped": np.ones((3, count), dtype=np.bool_),
            "linked_us": np.full(count, t_us),
            "seen_us": np.full(count, t_us),
            "codes": np.full(count, -1),
            "was_whole": np.zeros(count, dtype=np.bool_),
            "length_m": size_m[0],
            "width_m": size_m[1],
            "classes": np.full(count, UNKNOWN_CLASS, dtype=np.int32),
            "told_classes": np.full(count, UNKNOWN_CLASS, dtype=np.int32),
            "is_established": np.zeros(count, dtype=np.bool_),
            "is_contested": np.zeros(count, dtype=np.bool_),
            "waits": np.ones(count, dtype=np.bool_),
            "car_number": np.zeros(count, dtype=np.int64),
            "_samples_m": np.zeros((2, _SIZE_SAMPLES, count)),
            "_sample_count": np.zeros(count, dtype=np.int64),
            "_sampled_us": np.zeros(count, dtype=np.int64),
        }
        for name in _ARRAYS:
            setattr(self, name, np.concatenate([getattr(self, name), fresh[name]], axis=-1))

    def drop(self, gone: set[int]) -> None:
        """Forget bodies by column."""
        kept = np.array([column for column in range(len(self)) if column not in gone], dtype=np.int64)
        self.chains = [self.chains[column] for column in kept]
        for name in _ARRAYS:
            setattr(self, name, getattr(self, name).take(kept, axis=-1))

    def accept(self, t_us: int, columns: LongArray, *, state: FloatArray, road: IntArray, clipped: BoolArray) -> None:
        """Take over what was seen of bodies; (8, k), (k,) and (k,)."""
        self.states[NOW][:, columns] = state
        self.states_us[NOW, columns] = t_us
        self.seen_us[columns] = t_us
        self.roads[NOW, columns] = road
        self.was_clipped[NOW, columns] = clipped
        self.was_whole[columns] |= ~clipped

    def take_snapshots(self, t_us: int) -> None:
        """Let the snapshots grow older, twice a second."""
        if t_us - self._snapshot_us < _SNAPSHOT_US:
            return
        self._snapshot_us = t_us
        for array in (self.states, self.states_us, self.roads, self.was_clipped):
            array[1:] = array[:-1].copy()

    def go_back(self, column: int) -> None:
        """Return a body to its oldest snapshot: what came later belongs to another vehicle."""
        for array in (self.states, self.states_us, self.roads, self.was_clipped):
            array[..., column] = array[OLD, ..., column]

    def move_over(self, source: int, target: int, t_us: int) -> None:
        """Give a lost body the state of the vision object it is linked to from now on."""
        for array in (self.states, self.states_us, self.roads, self.was_clipped):
            array[..., target] = array[NOW, ..., source]
        self.linked_us[target] = self.seen_us[target] = t_us

    def tell_classes(self, columns: LongArray, words: tuple[str, ...]) -> None:
        """Take the classes that the tracker gives to bodies, (k,) and k words; "unknown" changes nothing."""
        told = np.array([CLASS_NAMES.index(word) for word in words], dtype=np.int32)
        is_told = told != UNKNOWN_CLASS
        self.told_classes[columns[is_told]] = self.classes[columns[is_told]] = told[is_told]

    def measure_sizes(self, t_us: int, columns: LongArray, length_m: FloatArray, width_m: FloatArray) -> None:
        """Take sizes of bodies seen in full, (k,) each, and smooth them."""
        count = self._sample_count.take(columns)
        is_due = (count < _EAGER_SAMPLES) | (t_us - self._sampled_us.take(columns) >= _SIZE_PERIOD_US)
        due = is_due.nonzero()[0]
        if not len(due):
            return
        columns, count = columns.take(due), count.take(due)
        place = count % _SIZE_SAMPLES
        self._samples_m[0, place, columns] = length_m.take(due)
        self._samples_m[1, place, columns] = width_m.take(due)
        self._sampled_us[columns] = t_us
        count += 1
        self._sample_count[columns] = count
        filled = np.minimum(count, _SIZE_SAMPLES)
        row = np.arange(len(columns))
        is_empty = np.arange(_SIZE_SAMPLES)[:, None] >= filled
        sorted_m = np.where(is_empty, np.inf, self._samples_m.take(columns, axis=2))
        sorted_m.sort(axis=1)
        median_m = (sorted_m[:, (filled - 1) // 2, row] + sorted_m[:, filled // 2, row]) / 2
        self.length_m[columns], self.width_m[columns] = median_m
        told = self.told_classes.take(columns)
        self.classes[columns] = np.where(told == UNKNOWN_CLASS, classify(median_m[0], median_m[1]), told)

    def is_measured(self) -> BoolArray:
        """Tell which bodies have a size to rely on, (n,)."""
        return self._sample_count >= _EAGER_SAMPLES


def looks_of(state: FloatArray, road: IntArray, length_m: FloatArray) -> Looks:
    """Lay out states for the linker; (8, k), (k,), (k,)."""
    return Looks(
        centre_m=state[X : Y + 1].T,
        velocity_mps=state[VX : VY + 1].T,
        heading_rad=state[HEADING],
        length_m=length_m,
        road=road,
        along_m=state[ALONG],
        across_m=state[ACROSS],
        tangent_rad=state[TANGENT],
    )
