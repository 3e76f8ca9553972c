"""Which part of each vehicle does a picture show? Upright boxes, and shares counted on a picture of names.

The silhouettes that are drawn are drawn once more, far ones first, each in a number of its own; what of a number is
left at the end is what the picture shows of that vehicle.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from data_gen.drawing.cameras import CameraPath
from data_gen.drawing.ground.standing import Standing
from data_gen.drawing.overlay import Overlay
from data_gen.drawing.traffic.solid_painter import Meshes
from data_gen.drawing.traffic.solids import Solid, hidden_by
from data_gen.drawing.view import CameraView, Rectangle, rectangle_around
from data_gen.simulation.states import FloatArray, IntArray, VehicleStates

_Cell = TypeVar("_Cell", bound=np.generic)

_FINENESS = 2
"""Pixels of the names a pixel of the image, each way."""


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """What one picture shows of its vehicles."""

    rows: IntArray
    """(k,), of the states, rising; those of which some pixel would show if it were alone."""
    share: FloatArray
    """(k,), 0 to 1: of the pixels that the body has in the image, those that nothing hides."""
    box_px: FloatArray
    """(k, 4), left, top, right, bottom of the body in the image; a border of the image is half a pixel outside."""


class ShownCounter:
    """Tells for the pictures of one camera what they show.

    Parameters
    ----------
    path : of the camera, which has poses.
    overlay : what hangs over the road.
    standing : what stands beside it, for a low camera.
    """

    def __init__(self, path: CameraPath, overlay: Overlay, standing: Standing | None = None) -> None:
        self._meshes = Meshes(detailed=path.sees_sides)
        self._overlay = overlay
        self._standing = standing
        width_px, height_px = path.views[0].size_px
        self._names = np.zeros((height_px * _FINENESS, width_px * _FINENESS), dtype=np.uint16)

    def look(self, states: VehicleStates, view: CameraView) -> Shown:
        """Count what a picture shows.

        Parameters
        ----------
        states : vehicles at the picture's time.
        view : the camera.
        """
        self._names[:] = 0
        found: list[tuple[Solid, Rectangle, int, FloatArray]] = []
        for solid in self._meshes.placed(states, view):
            around_px = solid.around_px()
            part = rectangle_around(around_px, view.size_px)
            if part is None:
                continue
            width_px, height_px = part.size_px
            body = np.zeros((height_px * _FINENESS, width_px * _FINENESS), dtype=np.uint8)
            solid.fill(body, part, _FINENESS, ((face, (1,)) for face in solid.seen_faces(panels=False)))
            if count := int(cv2.countNonZero(body)):
                found.append((solid, part, count, around_px))
                self._names[_window(part)][body > 0] = len(found)
                if self._standing is not None:
                    hidden = hidden_by(self._standing, solid, part, states, view)
                    hidden &= self._standing.bgra[part.window][:, :, 3] > 127
                    self._names[_window(part)][_finer(hidden) & (body > 0)] = 0
        order = sorted(range(len(found)), key=lambda place: found[place][0].row)
        share = [self._left(place + 1, found[place][1], view) / found[place][2] for place in order]
        return Shown(
            rows=np.array([found[place][0].row for place in order], dtype=np.int64),
            share=np.array(share, dtype=np.float64),
            box_px=np.array([_box(found[place][3], view.size_px) for place in order]).reshape(-1, 4),
        )

    def _left(self, name: int, part: Rectangle, view: CameraView) -> float:
        """Count the pixels of a name that are left, those under occluders by what shows through."""
        left = self._names[_window(part)] == name
        if self._overlay.is_empty:
            return float(np.count_nonzero(left))
        clear = 1 - self._overlay.opacity(part, view)
        return float((left * _finer(clear)).sum())


def _finer(picture: NDArray[_Cell]) -> NDArray[_Cell]:
    return picture.repeat(_FINENESS, axis=0).repeat(_FINENESS, axis=1)


def shown_in(
    states: Sequence[VehicleStates], path: CameraPath, overlay: Overlay, standing: Standing | None
) -> tuple[Shown, ...] | None:
    """Tell what each picture of a clip shows; None for a camera straight above, which shows all bodies whole."""
    if path.track is None:
        return None
    counter = ShownCounter(path, overlay, standing)
    return tuple(counter.look(step, view) for step, view in zip(states, path.views, strict=True))


def _window(part: Rectangle) -> tuple[slice, slice]:
    rows, columns = part.window
    return (
        slice(rows.start * _FINENESS, rows.stop * _FINENESS),
        slice(columns.start * _FINENESS, columns.stop * _FINENESS),
    )


def _box(points_px: FloatArray, size_px: tuple[int, int]) -> FloatArray:
    last = np.array(size_px) - 0.5
    return np.concatenate((np.clip(points_px.min(axis=0), -0.5, last), np.clip(points_px.max(axis=0), -0.5, last)))
