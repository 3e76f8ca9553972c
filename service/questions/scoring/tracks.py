"""How well does a set of tracks keep to the true objects? HOTA, IDF1 and the CLEAR counts.

The definitions are those of J. Luiten et al. (2021), "HOTA: a higher order metric for evaluating multi-object
tracking" (HOTA and its parts), E. Ristani et al. (2016), "Performance measures and a data set for multi-target,
multi-camera tracking" (IDF1), and K. Bernardin and R. Stiefelhagen (2008), "Evaluating multiple object tracking
performance: the CLEAR MOT metrics". Where those leave something open we do as the reference program TrackEval does;
docs/evaluation.md says how the agreement is tested.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from service.questions.scoring.pairs import BoolArray, FloatArray, IntArray, Pairs, assign, choose, groups_of, is_alone

# Similarities at which HOTA is computed, to be averaged; and the one of IDF1 and CLEAR.
HOTA_THRESHOLDS = tuple(step / 20 for step in range(1, 20))
MATCH_THRESHOLD = 0.5
# A match that goes on outweighs any similarity (CLEAR's rule that a match is kept while it is allowed).
KEEP_BONUS = 1000.0
ROUNDING = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, slots=True, eq=False)
class TrackRows:
    """One row an object and frame.

    Attributes
    ----------
    frame : (n,) frame numbers, ascending.
    track : (n,) which object, 0, 1, ... without holes; an object has at most one row a frame.
    """

    frame: IntArray
    track: IntArray

    def __len__(self) -> int:
        return len(self.frame)


@dataclass(frozen=True, slots=True)
class TrackScore:
    """Hold the figures; shares lie in [0, 1], `mota` may be negative.

    Attributes
    ----------
    hota, det_a, ass_a, loc_a : HOTA and its parts, averaged over the thresholds.
    idf1, idp, idr : of the best one-to-one matching of whole tracks.
    mota : 1 - (missed + wrong + switches) / true rows.
    id_switches, fragmentations : how often a true object changes its track; how often it is lost and found again.
    true_rows, found_rows, true_tracks, found_tracks : sizes of the two sides.
    """

    hota: float
    det_a: float
    ass_a: float
    loc_a: float
    idf1: float
    idp: float
    idr: float
    mota: float
    id_switches: int
    fragmentations: int
    true_rows: int
    found_rows: int
    true_tracks: int
    found_tracks: int


def score_tracks(true: TrackRows, found: TrackRows, pairs: Pairs) -> TrackScore:
    """Score tracks against the truth.

    Parameters
    ----------
    true, found : the two sides.
    pairs : their candidate pairs with similarity.

    Examples
    --------
    One vehicle over four frames, followed by two tracks one after the other, exactly where it is:

    >>> true = TrackRows(np.arange(4), np.zeros(4, np.int64))
    >>> found = TrackRows(np.arange(4), np.array([0, 0, 1, 1]))
    >>> score = score_tracks(true, found, Pairs(np.arange(4), np.arange(4), np.ones(4)))
    >>> score.idf1, score.id_switches, score.det_a, score.ass_a
    (0.5, 1, 1.0, 0.5)
    """
    sizes = np.bincount(true.track), np.bincount(found.track)
    return TrackScore(
        *_hota(true, found, pairs, sizes),
        *_identity(true, found, pairs),
        *_clear(true, found, pairs),
        *(len(true), len(found), len(sizes[0]), len(sizes[1])),
    )


def _hota(
    true: TrackRows, found: TrackRows, pairs: Pairs, sizes: tuple[IntArray, IntArray]
) -> tuple[float, float, float, float]:
    """Return HOTA, DetA, AssA and LocA."""
    # Which tracks go together is judged over the whole sequence first, then each frame is assigned by it.
    true_sum = np.bincount(pairs.true_row, pairs.similarity, len(true))
    found_sum = np.bincount(pairs.found_row, pairs.similarity, len(found))
    spread = true_sum[pairs.true_row] + found_sum[pairs.found_row] - pairs.similarity
    # Pairs of tracks that ever meet, by a code, and which of them each pair of rows is of.
    count = max(1, len(sizes[1]))
    code = true.track[pairs.true_row] * count + found.track[pairs.found_row]
    couple, of_pair = np.unique(code, return_inverse=True)
    together = np.bincount(of_pair, pairs.similarity / spread, len(couple))
    length = sizes[0][couple // count] + sizes[1][couple % count]
    alignment = together / (length - together)
    score = alignment[of_pair] * pairs.similarity
    chosen = assign(pairs, true.frame[pairs.true_row], score)
    similarity, of_match = pairs.similarity[chosen], of_pair[chosen]
    figures = np.array(
        [_at_threshold(similarity, of_match, length, (len(true), len(found)), at) for at in HOTA_THRESHOLDS]
    )
    hota = np.sqrt(figures[:, 0] * figures[:, 1])
    det_a, ass_a, loc_a = figures.mean(axis=0).tolist()
    return float(hota.mean()), det_a, ass_a, loc_a


def _at_threshold(
    similarity: FloatArray, of_match: IntArray, length: IntArray, rows: tuple[int, int], threshold: float
) -> tuple[float, float, float]:
    """Return DetA, AssA and LocA of the matches that are similar enough."""
    is_match = similarity >= threshold - ROUNDING
    matches = int(is_match.sum())
    together = np.bincount(of_match[is_match], minlength=len(length))
    ass_a = float((together * (together / np.maximum(1, length - together))).sum()) / max(1, matches)
    loc_a = max(1e-10, float(similarity[is_match].sum())) / max(1e-10, matches)
    return matches / max(1, rows[0] + rows[1] - matches), ass_a, loc_a


def _identity(true: TrackRows, found: TrackRows, pairs: Pairs) -> tuple[float, float, float]:
    """Return IDF1, IDP and IDR: each true object goes with at most one track, so that most rows agree."""
    near = pairs.select(pairs.similarity >= MATCH_THRESHOLD)
    agreed = 0.0
    if len(near):
        table = np.zeros((int(true.track.max()) + 1, int(found.track.max()) + 1))
        np.add.at(table, (true.track[near.true_row], found.track[near.found_row]), 1)
        agreed = float(table[linear_sum_assignment(-table)].sum())
    idf1 = agreed / max(1.0, (len(true) + len(found)) / 2)
    return idf1, agreed / max(1, len(found)), agreed / max(1, len(true))


def _clear(true: TrackRows, found: TrackRows, pairs: Pairs) -> tuple[float, int, int]:
    """Return MOTA, the identity switches and the fragmentations."""
    near = pairs.select(pairs.similarity >= MATCH_THRESHOLD - ROUNDING)
    live = np.intersect1d(true.frame, found.frame)
    step = np.searchsorted(live, true.frame[near.true_row])  # frames where one side is empty do not end a match
    chosen = _keep_matches(near, step, true.track[near.true_row], found.track[near.found_row])
    object_, track, step = true.track[near.true_row][chosen], found.track[near.found_row][chosen], step[chosen]
    order = np.lexsort((step, object_))
    object_, track, step = object_[order], track[order], step[order]
    goes_on = object_[1:] == object_[:-1]
    switches = int((goes_on & (track[1:] != track[:-1])).sum())
    fragmentations = int((goes_on & (np.diff(step) > 1)).sum())
    matches = len(object_)
    wrong = len(found) - matches
    return (matches - wrong - switches) / max(1, len(true)), switches, fragmentations


def _keep_matches(near: Pairs, step: IntArray, object_: IntArray, track: IntArray) -> BoolArray:
    """Assign step by step; whoever was matched at the step before stays so where that is possible."""
    chosen = is_alone(near)
    before: dict[int, dict[int, int]] = {}  # the rivals' matches by step
    alone: dict[int, dict[int, int]] = {}
    for at_step, one, name in np.column_stack((step, object_, track))[chosen].tolist():
        alone.setdefault(at_step, {})[one] = name
    rivals = np.flatnonzero(~chosen)
    for group in groups_of(step[rivals]):
        at = rivals[group]
        now = int(step[at[0]])
        kept = alone.get(now - 1, {}) | before.get(now - 1, {})
        bonus = np.array([KEEP_BONUS * (kept.get(int(object_[i]), -1) == track[i]) for i in at])
        taken = at[choose(near.true_row[at], near.found_row[at], near.similarity[at] + bonus)]
        chosen[taken] = True
        before = {now: dict(zip(object_[taken].tolist(), track[taken].tolist(), strict=True))}
    return chosen
