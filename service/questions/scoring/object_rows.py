"""Where were things, frame by frame? The form in which both sides of a score are compared."""

from __future__ import annotations

from dataclasses import dataclass

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
