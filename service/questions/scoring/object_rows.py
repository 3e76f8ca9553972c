"""Where were things, frame by frame? The form in which both sides of a score are compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.questions.scoring.pairs import BoolArray, FloatArray, IntArray, StrArray
from service.questions.scoring.tracks import TrackRows
from vision.objects import Table


@dataclass(frozen=True, slots=True, eq=False)
class ObjectRows(Table):
    """One row an object and frame, ordered by frame; so must be the rows that are selected.

    Attributes
    ----------
    frame : (n,) frame numbers. name : (n,) which object.
    centre_m : (n, 2). heading_rad, length_m, width_m : (n,) of the footprint.
    is_border : (n,) of true rows: neither right to find nor wrong to miss; of found rows: cut by the view, so never
        counted as wrong.
    is_standing : (n,) of true rows: part of a stop (`truth_rows.STANDING_US`); False for found rows.
    kind : (n,) class of vehicle, empty if not known.
    box_px : (n, 4) left, top, width, height in the image; None where only the ground counts.
    """

    frame: IntArray
    name: StrArray
    centre_m: FloatArray
    heading_rad: FloatArray
    length_m: FloatArray
    width_m: FloatArray
    is_border: BoolArray
    is_standing: BoolArray
    kind: StrArray
    box_px: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.frame)

    def tracks(self) -> TrackRows:
        """Number the objects."""
        _, track = np.unique(self.name, return_inverse=True)
        return TrackRows(self.frame, track.astype(np.int64))


def join_scenes(scenes: Sequence[tuple[ObjectRows, ObjectRows]]) -> tuple[ObjectRows, ObjectRows]:
    """Lay the true and found rows of several scenes one after another, as if they were one long scene.

    Figures of the whole are then figures of all rows, and no mean of means. Frames and names of different scenes are
    kept apart; image boxes are dropped unless all scenes have them.

    Parameters
    ----------
    scenes : (true, found) of each; at least one.
    """
    true, found, first_frame = [], [], 0
    for number, (true_rows, found_rows) in enumerate(scenes):
        true.append(_moved(true_rows, first_frame, f"{number}/"))
        found.append(_moved(found_rows, first_frame, f"{number}/"))
        first_frame = 1 + max((int(rows.frame[-1]) for rows in (true[-1], found[-1]) if len(rows)), default=first_frame)
    return ObjectRows.joined(true), ObjectRows.joined(found)


def _moved(rows: ObjectRows, first_frame: int, prefix: str) -> ObjectRows:
    return replace(rows, frame=rows.frame + first_frame, name=np.char.add(prefix, rows.name.astype(np.str_)))
