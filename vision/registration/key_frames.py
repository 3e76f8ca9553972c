"""What does a moving camera know of the places where it was? Pictures with their maps to the ground, kept as landmarks.

A key frame holds the corners that the picture has to offer. Following them in a later picture tells how the camera has
moved since; as every picture is compared with a key frame and not with the one before, errors do not add up, and
coming back to a place brings back its first key frame, and with it the first frame's map.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from vision.objects import ByteArray, FloatArray
from vision.registration.plane_fit import PlaneFit, fit_plane, transform
from vision.registration.settings import RegistrationSettings

# Pyramid levels and steps of Lucas-Kanade.
LEVELS = 3
FLOW_STEPS = 12
FLOW_ACCURACY_PX = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class KeyFrame:
    """A picture with its map to the ground.

    Attributes
    ----------
    luma : (h, w) at half size.
    pixel_from_ground : (3, 3) of the full-size picture.
    corners_px : (n, 2) full-size positions of corners that can be followed.
    """

    luma: ByteArray
    pixel_from_ground: FloatArray
    corners_px: FloatArray

    def follow(self, luma: ByteArray, guess: FloatArray, settings: RegistrationSettings) -> tuple[PlaneFit | None, int]:
        """Find the corners in another picture.

        Parameters
        ----------
        luma : at half size.
        guess : (3, 3) pixel_from_ground of the other picture, some pixels off.
        settings : of this room.

        Returns
        -------
        The map from this picture to the other one, None if there is none; and how many corners should be in view.
        """
        moved = guess @ np.linalg.inv(self.pixel_from_ground)
        expected = transform(moved, self.corners_px)
        first_px, last_px = settings.corner_border_px, np.array(luma.shape[::-1]) * 2.0 - 1 - settings.corner_border_px
        is_in_view = np.all((expected >= first_px) & (expected <= last_px), axis=1)
        corners, expected = self.corners_px[is_in_view], expected[is_in_view]
        if len(corners) == 0:
            return None, 0
        flow, is_found, _ = cv2.calcOpticalFlowPyrLK(
            self.luma,
            luma,
            to_half(corners).astype(np.float32),
            to_half(expected).astype(np.float32),
            winSize=(settings.window_px, settings.window_px),
            maxLevel=LEVELS - 1,
            criteria=(cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, FLOW_STEPS, FLOW_ACCURACY_PX),
            flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        )
        good = np.asarray(is_found).ravel() > 0
        # What is left between guess and picture is nearly a similarity, however much the camera has tilted.
        fit = fit_plane(expected[good], to_full(np.asarray(flow, np.float64)[good]), settings)
        if fit is not None:
            fit = replace(fit, matrix=fit.matrix @ moved, source_px=corners[good])
        return fit, len(corners)


def corners_of(luma: ByteArray, vehicles_px: Sequence[FloatArray], settings: RegistrationSettings) -> FloatArray:
    """Choose corners of a picture that can be followed.

    Parameters
    ----------
    luma : at half size.
    vehicles_px : outlines (k, 2) in the full-size picture, of things that may move; no corner is taken there.
    settings : of this room.

    Returns
    -------
    (n, 2) full-size positions.
    """
    mask = np.zeros(luma.shape, np.uint8)
    inner = slice(settings.corner_border_px, -settings.corner_border_px)
    mask[inner, inner] = 255
    for outline in vehicles_px:
        cv2.fillPoly(mask, [np.rint(to_half(outline)).astype(np.int32)], (0,))
    corners = np.zeros((0, 2))
    spacing_px = settings.corner_spacing * float(np.sqrt(luma.size / settings.corners))
    for quality in settings.corner_quality / np.array([1, 5, 25]):
        found = cv2.goodFeaturesToTrack(luma, settings.corners, quality, spacing_px, mask=mask)
        if found is not None:
            corners = to_full(np.asarray(found, np.float64).reshape(-1, 2))
        if len(corners) >= settings.enough_corners:
            break
    return corners


class Landmarks:
    """Key frames by the looks of their corners: finds a place again from nothing."""

    def __init__(self, settings: RegistrationSettings) -> None:
        self._settings = settings
        self._orb = cv2.ORB.create(nfeatures=settings.descriptors)
        self._matcher = cv2.BFMatcher(cv2.NORM_HAMMING)
        self._described: dict[int, tuple[FloatArray, ByteArray]] = {}

    def guess(self, luma: ByteArray, candidates: Sequence[KeyFrame]) -> list[tuple[KeyFrame, FloatArray]]:
        """Guess from where a picture was taken.

        Parameters
        ----------
        luma : at half size.
        candidates : key frames to compare with.

        Returns
        -------
        Those that have something in common with the picture, with its pixel_from_ground by each; to be checked.
        """
        points, descriptors = self._describe(luma)
        guesses = []
        for frame in candidates:
            if id(frame) not in self._described:
                self._described[id(frame)] = self._describe(frame.luma)
            known_points, known = self._described[id(frame)]
            if len(descriptors) < 2 or len(known) < 2:
                continue
            pairs = [
                (first.queryIdx, first.trainIdx)
                for first, second in self._matcher.knnMatch(known, descriptors, k=2)
                if first.distance < self._settings.match_ratio * second.distance
            ]
            source, target = np.array(pairs, np.intp).reshape(-1, 2).T
            fit = fit_plane(known_points[source], points[target], self._settings)
            if fit is not None:
                guesses.append((frame, fit.matrix @ frame.pixel_from_ground))
        return guesses

    def forget(self, frame: KeyFrame) -> None:
        """Drop what is known of a key frame that is no longer kept."""
        self._described.pop(id(frame), None)

    def _describe(self, luma: ByteArray) -> tuple[FloatArray, ByteArray]:
        found, descriptors = self._orb.detectAndCompute(luma, None)
        if not found:
            return np.zeros((0, 2)), np.zeros((0, 32), np.uint8)
        return to_full(np.array([one.pt for one in found], np.float64)), np.asarray(descriptors, np.uint8)


def half_size(luma: ByteArray) -> ByteArray:
    """Shrink a picture to half its size, each pixel the mean of four; an odd last row or column is left out."""
    height, width = luma.shape[0] // 2, luma.shape[1] // 2
    even = luma[: 2 * height, : 2 * width]
    return np.asarray(cv2.resize(even, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def to_half(points_px: FloatArray) -> FloatArray:
    """Convert full-size positions to the half-size picture, whose pixel (0, 0) covers the first two by two."""
    return (points_px - 0.5) / 2


def to_full(points_px: FloatArray) -> FloatArray:
    """Convert positions in the half-size picture to full-size ones."""
    return points_px * 2 + 0.5
