"""How well are vehicles seen where they are? Detections of single frames against the truth, whatever their names.

Within a frame, true vehicles that count and objects found are matched one to one: as many pairs as possible no farther
apart than `REACH_M`, and then as near as possible. What is found beside them is *border* where the truth is: a vehicle
half out of view or behind a tree may be found or not. Everything else found is wrong.
"""

from dataclasses import dataclass

import numpy as np

from service.questions.scoring.object_rows import ObjectRows
from service.questions.scoring.pairs import BoolArray, FloatArray, IntArray, Pairs, assign, box_pairs, ground_pairs
from service.questions.scoring.proportions import share, wilson_interval
from service.questions.scoring.tracks import TrackScore, score_tracks

REACH_M = 2.0
# Similarity of tracks falls to 0 here, so that the threshold 0.5 of IDF1 is the reach of a detection.
TRACK_REACH_M = 2 * REACH_M


@dataclass(frozen=True, slots=True, eq=False)
class Settled:
    """Hold both sides without their border, and who stands for whom.

    Attributes
    ----------
    true, found : the rows that count.
    true_row, found_row : (p,) matches. distance_m : (p,) between their centres.
    found_border : how many found rows were left out.
    """

    true: ObjectRows
    found: ObjectRows
    true_row: IntArray
    found_row: IntArray
    distance_m: FloatArray
    found_border: int


@dataclass(frozen=True, slots=True)
class DetectionScore:
    """Count rows, a row being one vehicle in one frame.

    Attributes
    ----------
    right, wrong, missed : matches, found rows without truth, countable truth that was not found.
    border : found rows that do not count.
    mean_error_m, most_error_m : of the centres of right rows: mean, and what 95 % stay below; nan without any.
    standing_right, standing_missed : the same counts for vehicles that stand.
    by_kind : right and missed rows by class of vehicle.
    """

    right: int
    wrong: int
    missed: int
    border: int
    mean_error_m: float
    most_error_m: float
    standing_right: int
    standing_missed: int
    by_kind: dict[str, tuple[int, int]]

    @property
    def precision(self) -> float | None:
        """Return right / (right + wrong); None when nothing was found."""
        return share(self.right, self.right + self.wrong)

    @property
    def recall(self) -> float | None:
        """Return right / (right + missed); None when there was nothing to find."""
        return share(self.right, self.right + self.missed)

    @property
    def standing_recall(self) -> float | None:
        """Return the recall of standing vehicles; None when none stood."""
        return share(self.standing_right, self.standing_right + self.standing_missed)

    def as_record(self) -> dict[str, object]:
        """Return the figures as plain data, for JSON."""
        standing = self.standing_right + self.standing_missed
        return {
            "right": self.right,
            "wrong": self.wrong,
            "missed": self.missed,
            "border": self.border,
            "precision": self.precision,
            "precision_interval": wilson_interval(self.right, self.right + self.wrong),
            "recall": self.recall,
            "recall_interval": wilson_interval(self.right, self.right + self.missed),
            "mean_error_m": self.mean_error_m if self.right else None,
            "most_error_m": self.most_error_m if self.right else None,
            "standing_rows": standing,
            "standing_recall": self.standing_recall,
            "standing_recall_interval": wilson_interval(self.standing_right, standing),
            "by_kind": {kind: {"right": right, "missed": missed} for kind, (right, missed) in self.by_kind.items()},
        }


def settle(true: ObjectRows, found: ObjectRows) -> Settled:
    """Match true and found rows within each frame, and set aside what does not count.

    Parameters
    ----------
    true, found : of the same frames.
    """
    countable = np.flatnonzero(~true.is_border)
    kept_true = true.select(countable)
    near = ground_pairs(kept_true.frame, kept_true.centre_m, found.frame, found.centre_m, reach_m=REACH_M)
    distance_m = (1 - near.similarity) * REACH_M
    # The first part of the score makes one more pair worth more than any nearness.
    chosen = assign(near, kept_true.frame[near.true_row], 1000.0 + near.similarity)
    is_matched = np.zeros(len(found), np.bool_)
    is_matched[near.found_row[chosen]] = True
    is_excused = ~is_matched & (found.is_border | _is_at_border(true.select(true.is_border), found))
    new_row = np.cumsum(~is_excused) - 1
    return Settled(
        true=kept_true,
        found=found.select(~is_excused),
        true_row=near.true_row[chosen],
        found_row=new_row[near.found_row[chosen]],
        distance_m=distance_m[chosen],
        found_border=int(is_excused.sum()),
    )


def score_detection(settled: Settled) -> DetectionScore:
    """Count what was found, missed and made up, and how far off the right ones were."""
    is_found = np.zeros(len(settled.true), np.bool_)
    is_found[settled.true_row] = True
    standing, kind = settled.true.is_standing, settled.true.kind
    error_m = settled.distance_m
    return DetectionScore(
        right=len(error_m),
        wrong=len(settled.found) - len(error_m),
        missed=len(settled.true) - len(error_m),
        border=settled.found_border,
        mean_error_m=float(error_m.mean()) if len(error_m) else float("nan"),
        most_error_m=float(np.percentile(error_m, 95)) if len(error_m) else float("nan"),
        standing_right=int((standing & is_found).sum()),
        standing_missed=int((standing & ~is_found).sum()),
        by_kind={
            str(one): (int((is_found & (kind == one)).sum()), int((~is_found & (kind == one)).sum()))
            for one in np.unique(kind)
        },
    )


def score_settled_tracks(settled: Settled) -> TrackScore:
    """Score the names of the same rows: by centres on the ground, or by image boxes where both sides have them.

    On the ground, similarity is 1 - distance / `TRACK_REACH_M`, not below 0.
    """
    true, found = settled.true, settled.found
    pairs: Pairs
    if true.box_px is not None and found.box_px is not None:
        pairs = box_pairs(true.frame, true.box_px, found.frame, found.box_px)
    else:
        pairs = ground_pairs(true.frame, true.centre_m, found.frame, found.centre_m, reach_m=TRACK_REACH_M)
    return score_tracks(true.tracks(), found.tracks(), pairs)


def _is_at_border(border: ObjectRows, found: ObjectRows) -> BoolArray:
    """Tell which found centres lie in the footprint of a border vehicle, or within the reach of it."""
    at_border = np.zeros(len(found), np.bool_)
    if len(border) == 0 or len(found) == 0:
        return at_border
    reach_m = float(np.hypot(border.length_m, border.width_m).max()) / 2 + 2 * REACH_M
    near = ground_pairs(border.frame, border.centre_m, found.frame, found.centre_m, reach_m=reach_m)
    offset_m = found.centre_m[near.found_row] - border.centre_m[near.true_row]
    heading = border.heading_rad[near.true_row]
    along_m = np.abs(offset_m[:, 0] * np.cos(heading) + offset_m[:, 1] * np.sin(heading))
    across_m = np.abs(offset_m[:, 1] * np.cos(heading) - offset_m[:, 0] * np.sin(heading))
    over_m = np.hypot(
        np.clip(along_m - border.length_m[near.true_row] / 2, 0, None),
        np.clip(across_m - border.width_m[near.true_row] / 2, 0, None),
    )
    at_border[near.found_row[over_m <= REACH_M]] = True
    return at_border
