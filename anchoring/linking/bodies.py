"""What is known of every body that is followed? Its last state, two older ones, and its size; as a struct of arrays.

A body is a vision object that is not established yet, or a world object, linked or lost. The older states are snapshots
taken twice a second: what a body was like a moment ago tells whether its vision object has jumped to another vehicle,
and is what the body goes back to then.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from anchoring.hypotheses.hypotheses import Chain
from anchoring.linking.classes import CLASS_NAMES, UNKNOWN_CLASS, Norms
from anchoring.linking.ways import Looks, front_as
from anchoring.observations import BoolArray, FloatArray, IntArray, LongArray, Observations
from anchoring.settings import AnchoringSettings

# Rows of a state.
X, Y, VX, VY, HEADING, ALONG, ACROSS, TANGENT = range(8)

# Snapshots of a body: the newest state, one up to half a second old, one from half a second to a second old; where its
# vision object was seen first, and where the one before it was seen last; where the body was before it was last hidden.
NOW, RECENT, OLD, START, END, LOST = range(6)


class _Column(NamedTuple):
    """Declare an array with a column for each body: its type, its shape before them, and what a new one has there."""

    kind: type[np.generic]
    shape: tuple[int, ...]
    new: float


def _column(kind: type[np.generic], *shape: int, new: float = 0) -> Any:  # Any: instances have an array there
    return _Column(kind, shape, new)


class Bodies:
    """Hold n bodies; column k of every array belongs to ``chains[k]``.

    Attributes
    ----------
    chains : the links above each body.
    states : (6, 8, n) snapshot, row of the state.
    states_us : (6, n) when each was seen.
    roads : (6, n) index of the road, -1 for none.
    was_clipped : (6, n).
    linked_us : (n,) since when the present vision object is linked, or was first seen.
    seen_us : (n,) when each had a vision object last, right or wrong; ``states_us`` goes back when a link is refuted.
    unseen_us : (n,) the first frame in which each was not seen; -1 for those that are.
    codes : (n,) the fluents of the last frame, -1 for a body that is new.
    was_whole : (n,) True once the body was seen away from the edges of the view.
    length_m, width_m, classes : (n,) medians, and index into ``CLASS_NAMES``.
    sigma_m : (n,) standard deviation of each coordinate where it was seen last; nan if the tracker does not say.
    has_front : (n,) whether its vision object came so far ahead of where it began that it did not only stand there, and
        is not back; before, the front may be the other end. True if the tracker does not say how sure it is.
    has_moved : (n,) whether that is so, or was of one before it when the next one began elsewhere.
    born_us : (n,) when it was seen first, by its first vision object.
    seen_share, sure_share : (n,) of the last moments, how much each was seen, which fades out; and what that was when
        it was seen last.
    told_classes : (n,) the class that the tracker gave last, `UNKNOWN_CLASS` if none: it goes before that of the size.
    is_established : (n,) True for a world object, linked or lost; False for a vision object that may become one.
    waits : (n,) True if a condition of a link wants to see the next state even if it is like the last.
    is_returned : (n,) True for a world object that was lost and is linked to another vision object by evidence.
    is_contested : (n,) True for a vision object that looks like a lost car, clearly or not.
    car_number : (n,) number of the symbol while every link up to the car holds, else 0.
    norms : how classes are told by sizes, and what they allow.
    """

    states: FloatArray = _column(np.float64, 6, 8)
    states_us: LongArray = _column(np.int64, 6)
    roads: IntArray = _column(np.int32, 6, new=-1)
    was_clipped: BoolArray = _column(np.bool_, 6, new=True)
    linked_us: LongArray = _column(np.int64)
    seen_us: LongArray = _column(np.int64)
    unseen_us: LongArray = _column(np.int64, new=-1)
    codes: LongArray = _column(np.int64, new=-1)
    was_whole: BoolArray = _column(np.bool_)
    length_m: FloatArray = _column(np.float64)
    width_m: FloatArray = _column(np.float64)
    sigma_m: FloatArray = _column(np.float64, new=np.nan)
    has_moved: BoolArray = _column(np.bool_)
    has_front: BoolArray = _column(np.bool_)
    _had_moved: BoolArray = _column(np.bool_)
    born_us: LongArray = _column(np.int64)
    seen_share: FloatArray = _column(np.float64, new=1.0)
    sure_share: FloatArray = _column(np.float64, new=1.0)
    classes: IntArray = _column(np.int32, new=UNKNOWN_CLASS)
    told_classes: IntArray = _column(np.int32, new=UNKNOWN_CLASS)
    is_established: BoolArray = _column(np.bool_)
    is_returned: BoolArray = _column(np.bool_)
    is_contested: BoolArray = _column(np.bool_)
    waits: BoolArray = _column(np.bool_, new=True)
    car_number: LongArray = _column(np.int64)
    _sample_count: LongArray = _column(np.int64)
    _sampled_us: LongArray = _column(np.int64)

    def __init__(self, settings: AnchoringSettings, norms: Norms) -> None:
        self._settings = settings
        self.norms = norms
        self.chains: list[Chain] = []
        for name, column in _COLUMNS.items():
            setattr(self, name, np.zeros((*column.shape, 0), dtype=column.kind))
        self._samples_m: FloatArray = np.zeros((2, settings.size_samples, 0))
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
        for name, column in _COLUMNS.items():
            fresh = np.full((*column.shape, count), column.new, dtype=column.kind)
            setattr(self, name, np.concatenate([getattr(self, name), fresh], axis=-1))
        self._samples_m = np.concatenate([self._samples_m, np.zeros((*self._samples_m.shape[:2], count))], axis=-1)
        new = slice(len(self) - count, None)
        self.states[..., new] = state
        self.states_us[:, new] = self.linked_us[new] = self.seen_us[new] = self.born_us[new] = t_us
        self.states_us[START, new] = -1
        self.length_m[new], self.width_m[new] = size_m

    def drop(self, gone: list[int]) -> None:
        """Forget bodies by column."""
        kept = np.delete(np.arange(len(self)), gone)
        self.chains = [self.chains[column] for column in kept]
        for name in (*_COLUMNS, "_samples_m"):
            setattr(self, name, getattr(self, name).take(kept, axis=-1))

    def accept(
        self, t_us: int, columns: LongArray, *, state: FloatArray, road: IntArray, clipped: BoolArray
    ) -> LongArray:
        """Take over what was seen of bodies, (8, k), (k,) and (k,); return those of which nothing was for a while."""
        returned = columns[self.unseen_us[columns] >= 0]
        self.unseen_us[self.unseen_us < 0] = t_us
        self.unseen_us[columns] = -1
        if len(returned):
            for array in (self.states, self.states_us, self.roads, self.was_clipped):
                array[LOST][..., returned] = array[NOW][..., returned]
        self.states[NOW][:, columns] = state
        self.states_us[NOW, columns] = t_us
        self.seen_us[columns] = t_us
        self.roads[NOW, columns] = road
        self.was_clipped[NOW, columns] = clipped
        self.was_whole[columns] |= ~clipped
        first = columns[self.states_us[START, columns] < 0]
        if len(first):
            for array in (self.states, self.states_us, self.roads, self.was_clipped):
                array[START][..., first] = array[NOW][..., first]
        # The first speeds of a track are not sure yet.
        young = columns[t_us - self.states_us[START, columns] <= self._settings.settled_us]
        self.states[START, VX : HEADING + 1, young] = self.states[NOW, VX : HEADING + 1, young]
        return returned

    def note_motion(self, columns: LongArray, sigma_m: FloatArray) -> None:
        """Keep how sure the places of bodies, (k,), just accepted are, and who has driven away from where it began."""
        settings = self._settings
        self.sigma_m[columns] = sigma_m
        shift_m = self.states[NOW, X : Y + 1][:, columns] - self.states[START, X : Y + 1][:, columns]
        least_m = np.fmax(settings.moved_lengths * self.length_m[columns], settings.moved_sigmas * sigma_m)
        # Whoever comes away against its front may have been taken the wrong way round; whoever is back where it began
        # has only seemed to come away, by noise or by a slip to its neighbour.
        heading_rad = self.states[NOW, HEADING, columns]
        ahead_m = shift_m[0] * np.cos(heading_rad) + shift_m[1] * np.sin(heading_rad)
        is_away = np.where(self.has_front[columns], np.hypot(*shift_m), ahead_m) > least_m
        self.has_front[columns] = np.isnan(sigma_m) | is_away
        self.has_moved[columns] = self.has_front[columns] | self._had_moved[columns]

    def knows_front(self, columns: LongArray, velocity_mps: FloatArray) -> BoolArray:
        """Tell of which bodies, (k,), with velocities (2, k) the front is known: who came ahead, and who drives."""
        drives: BoolArray = np.hypot(*velocity_mps) >= self._settings.turn_mps
        return drives | self.has_front[columns]

    def note_seen(self, is_seen: BoolArray, elapsed_us: int) -> None:
        """Keep how much of the last moments all bodies, (n,), were seen."""
        self.seen_share += (is_seen - self.seen_share) * -math.expm1(-elapsed_us / self._settings.recent_us)
        self.sure_share[is_seen] = self.seen_share[is_seen]

    def confidence(self, columns: LongArray) -> FloatArray:
        """Say how sure it is, (k,), that each is one vehicle, by what was seen of it up to its last sight."""
        settings, sigma_m = self._settings, self.sigma_m[columns]
        age_us = self.states_us[NOW, columns] - self.born_us[columns]
        lengths = self.length_m[columns] / np.maximum(sigma_m, 1e-6)
        grown, fine = -np.expm1(-age_us / settings.grown_us), -np.expm1(-lengths / settings.coarse_lengths)
        confidence: FloatArray = np.where(np.isnan(sigma_m), 1.0, self.sure_share[columns] * grown * fine)
        return confidence

    def take_snapshots(self, t_us: int) -> None:
        """Let the snapshots grow older, twice a second."""
        if t_us - self._snapshot_us < self._settings.snapshot_us:
            return
        self._snapshot_us = t_us
        for array in (self.states, self.states_us, self.roads, self.was_clipped):
            array[RECENT : OLD + 1] = array[NOW : RECENT + 1].copy()

    def go_back(self, column: int, *, snapshot: int) -> None:
        """Return a body to a snapshot: what came later belongs to another vehicle."""
        for array in (self.states, self.states_us, self.roads, self.was_clipped):
            array[: OLD + 1, ..., column] = array[snapshot, ..., column]

    def move_over(self, source: LongArray, target: LongArray, t_us: int) -> None:
        """Give lost bodies, (k,), the states of the vision objects they are linked to from now on, (k,)."""
        known_rad = self.states[NOW, HEADING, target]
        way_m = np.hypot(*(self.states[START, X : Y + 1][:, source] - self.states[START, X : Y + 1][:, target]))
        is_elsewhere = way_m > self._settings.moved_lengths * self.length_m[target]
        self._had_moved[target] |= (self.has_front[target] & is_elsewhere) | self._had_moved[source]
        is_guess = self._had_moved[target] & ~self.knows_front(source, self.states[NOW, VX : VY + 1, source].T)
        for array in (self.states, self.states_us, self.roads, self.was_clipped):
            array[END][..., target] = array[LOST][..., target] = array[NOW][..., target]
            array[: OLD + 1, ..., target] = array[NOW][..., source]
            array[START][..., target] = array[START][..., source]
        for snapshot in (*range(OLD + 1), START):
            heading_rad = self.states[snapshot, HEADING, target]
            self.states[snapshot, HEADING, target] = front_as(heading_rad, known_rad, is_guess)
        self.is_returned[target] = self.waits[target] = True
        self.has_front[target] = self.has_front[source]
        self.has_moved[target] = self.has_front[target] | self._had_moved[target]
        self.sigma_m[target] = self.sigma_m[source]
        self.unseen_us[target] = -1
        self.linked_us[target] = self.seen_us[target] = t_us

    def tell_classes(self, columns: LongArray, words: tuple[str, ...]) -> None:
        """Take the classes that the tracker gives to bodies, (k,) and k words; "unknown" changes nothing."""
        told = np.array([CLASS_NAMES.index(word) for word in words], dtype=np.int32)
        is_told = told != UNKNOWN_CLASS
        self.told_classes[columns[is_told]] = self.classes[columns[is_told]] = told[is_told]

    def measure_sizes(self, t_us: int, columns: LongArray, length_m: FloatArray, width_m: FloatArray) -> None:
        """Take sizes of bodies seen in full, (k,) each, and smooth them."""
        settings, most = self._settings, self._settings.size_samples
        count = self._sample_count.take(columns)
        is_due = (count < settings.eager_samples) | (t_us - self._sampled_us.take(columns) >= settings.size_period_us)
        due = is_due.nonzero()[0]
        if not len(due):
            return
        columns, count = columns.take(due), count.take(due)
        place = count % most
        self._samples_m[0, place, columns] = length_m.take(due)
        self._samples_m[1, place, columns] = width_m.take(due)
        self._sampled_us[columns] = t_us
        count += 1
        self._sample_count[columns] = count
        filled = np.minimum(count, most)
        row = np.arange(len(columns))
        is_empty = np.arange(most)[:, None] >= filled
        sorted_m = np.where(is_empty, np.inf, self._samples_m.take(columns, axis=2))
        sorted_m.sort(axis=1)
        median_m = (sorted_m[:, (filled - 1) // 2, row] + sorted_m[:, filled // 2, row]) / 2
        self.length_m[columns], self.width_m[columns] = median_m
        told = self.told_classes.take(columns)
        by_size = self.norms.classify(median_m[0], median_m[1], settings)
        self.classes[columns] = np.where(told == UNKNOWN_CLASS, by_size, told)

    def looks(self, columns: LongArray, snapshot: int | LongArray) -> Looks:
        """Lay out what bodies (k,) were like in a snapshot, or in one each (k,), with the sizes known now."""
        state = self.states[snapshot, :, columns].T
        return looks_of(
            self.states_us[snapshot, columns],
            state,
            self.roads[snapshot, columns],
            np.stack([self.length_m[columns], self.width_m[columns]]),
            is_whole=self.was_whole[columns],
            has_front=self.knows_front(columns, state[VX : VY + 1]),
        )

    def usual_size_m(self) -> tuple[FloatArray, FloatArray]:
        """Tell the length and width usual here, (2,), and how far they spread; at first those of five usual cars."""
        known_m = np.stack([self.length_m, self.width_m])[:, self.is_established & self.is_measured()]
        mean_m, spread_m = self.norms.usual_m.T[:, :, None]
        sizes_m = np.concatenate([mean_m + spread_m * [-1.0, -1.0, 0.0, 1.0, 1.0], known_m], axis=1)
        return sizes_m.mean(axis=1), sizes_m.std(axis=1)

    def is_measured(self) -> BoolArray:
        """Tell which bodies have a size to rely on, (n,)."""
        return self._sample_count >= self._settings.eager_samples


_COLUMNS = {name: one for name, one in vars(Bodies).items() if isinstance(one, _Column)}


def state_of(seen: Observations) -> FloatArray:
    """Lay out vision objects as states, (8, n), with nothing known of roads."""
    state = np.full((8, len(seen.ids)), np.nan)
    state[X : Y + 1] = seen.centre_m.T
    state[VX : VY + 1] = seen.velocity_mps.T
    state[HEADING] = seen.heading_rad
    return state


def looks_of(
    t_us: LongArray, state: FloatArray, road: IntArray, size_m: FloatArray, *, is_whole: BoolArray, has_front: BoolArray
) -> Looks:
    """Lay out states for comparison; (k,), (8, k), (k,), (2, k), (k,), (k,)."""
    return Looks(
        t_us=t_us,
        centre_m=state[X : Y + 1].T,
        velocity_mps=state[VX : VY + 1].T,
        heading_rad=state[HEADING],
        has_front=has_front,
        length_m=size_m[0],
        width_m=size_m[1],
        is_whole=is_whole,
        road=road,
        along_m=state[ALONG],
        across_m=state[ACROSS],
        tangent_rad=state[TANGENT],
    )
