"""Which part of a vehicle's body do occluders hide from the camera? Measured on the very layers that are drawn."""

import cv2
import numpy as np
from numpy.typing import NDArray

from data_gen.drawing.ground.buildings import at_height
from data_gen.drawing.ground.paint import cover_of
from data_gen.drawing.occlusion.overlay import Overlay
from data_gen.drawing.rectangle import Rectangle
from data_gen.drawing.traffic.vehicle_models import height_m
from data_gen.drawing.view import CameraView, corners_m
from data_gen.simulation.states import FloatArray, VehicleStates


def hidden_shares(states: VehicleStates, rows: NDArray[np.intp], view: CameraView, overlay: Overlay) -> FloatArray:
    """Measure how much of some bodies an occluder hides.

    Parameters
    ----------
    states : vehicles.
    rows : (n,), those to measure; all lie in front of the camera.
    view : the camera.
    overlay : the occluders as drawn.

    Returns
    -------
    (n,) from 0 to 1: of the part of the body's outline that lies in the image; 0 where none of it does.
    """
    outlines_m = corners_m(states)
    return np.array(
        [_hidden_share(outlines_m[row], height_m(states.classes[row]), view, overlay) for row in rows],
        dtype=np.float64,
    )


def _hidden_share(footprint_m: FloatArray, up_m: float, view: CameraView, overlay: Overlay) -> float:
    foot_px, roof_px = at_height(footprint_m, 0.0, view), at_height(footprint_m, up_m, view)
    points_px = np.vstack((foot_px, roof_px))
    if (points_px.max(axis=0) < 0).any() or (points_px.min(axis=0) > np.array(view.size_px)).any():
        return 0.0
    silhouette_px = cv2.convexHull(points_px.astype(np.float32)).reshape(-1, 2).astype(np.float64)
    patch = cover_of([silhouette_px], view.size_px)
    if patch is None:
        return 0.0
    rows, columns = patch.window
    part = Rectangle(columns.start, rows.start, columns.stop, rows.stop)
    if not overlay.touches(part, view) or not patch.cover.any():
        return 0.0
    return float((patch.cover * overlay.opacity(part, view)).sum() / patch.cover.sum())
