"""Which map of the image plane carries some points to others, though some of the pairs are wrong? A robust homography.

Two pictures of flat ground differ by a homography. Random samples of two pairs (a similarity: shift, turn, scale) find
the pairs that belong together; all of those then fix the homography by least squares whose weights fall with the
residual (Tukey's biweight), so that what the sampling let pass does no harm.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from vision.objects import BoolArray, FloatArray
from vision.registration.settings import RegistrationSettings


@dataclass(frozen=True, slots=True)
class PlaneFit:
    """A homography and which pairs it explains.

    Attributes
    ----------
    matrix : (3, 3), target from source, last entry 1.
    source_px : (n, 2) the pairs' first points.
    is_inlier : (n,) pairs within `close_px`.
    """

    matrix: FloatArray
    source_px: FloatArray
    is_inlier: BoolArray


def fit_plane(source_px: FloatArray, target_px: FloatArray, settings: RegistrationSettings) -> PlaneFit | None:
    """Fit the homography between two pictures of a plane.

    Parameters
    ----------
    source_px, target_px : (n, 2), pair by pair.
    settings : of this room.

    Returns
    -------
    The fit; None where no map explains at least `least_pairs` pairs.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> source = rng.uniform(0, 600, (60, 2))
    >>> target = source @ np.array([[0.99, 0.05], [-0.05, 0.99]]) + [12.0, -3.0]
    >>> target[:20] = rng.uniform(0, 600, (20, 2))               # a third of the pairs is wrong
    >>> fit = fit_plane(source, target, RegistrationSettings())
    >>> bool(fit.is_inlier[20:].all()), transform(fit.matrix, np.array([[100.0, 100.0]])).round(3).tolist()
    (True, [[106.0, 101.0]])
    """
    rough_px, close_px, least_pairs = settings.rough_px, settings.close_px, settings.least_pairs
    reaches_px = (rough_px, close_px, close_px)
    if len(source_px) < least_pairs:
        return None
    similarity, chosen = cv2.estimateAffinePartial2D(
        source_px, target_px, method=cv2.RANSAC, ransacReprojThreshold=rough_px, maxIters=500, confidence=0.999
    )
    if similarity is None or np.count_nonzero(chosen) < least_pairs:
        return None
    rough = np.asarray(chosen).ravel() > 0
    matrix = _refine(np.vstack([similarity, [0.0, 0.0, 1.0]]), source_px[rough], target_px[rough], *reaches_px)
    error_px = np.hypot(*(transform(matrix, source_px) - target_px).T)
    near = error_px <= rough_px
    if np.any(near & ~rough) and np.count_nonzero(near) >= least_pairs:
        # Pairs that the similarity missed and the homography explains.
        matrix = _refine(matrix, source_px[near], target_px[near], *reaches_px)
        error_px = np.hypot(*(transform(matrix, source_px) - target_px).T)
    is_inlier = error_px <= close_px
    if np.count_nonzero(is_inlier) < least_pairs:
        return None
    return PlaneFit(matrix, source_px, is_inlier)


def transform(matrix: FloatArray, points: FloatArray) -> FloatArray:
    """Map points of a plane by a homography.

    Parameters
    ----------
    matrix : (3, 3).
    points : (..., 2).

    Returns
    -------
    (..., 2).
    """
    mapped = points @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(mapped[..., :2] / mapped[..., 2:])


def _refine(start: FloatArray, source_px: FloatArray, target_px: FloatArray, *reaches_px: float) -> FloatArray:
    """Improve a homography by Gauss-Newton steps, far pairs weighing less; the first step bends it to all pairs."""
    scale = 1.0 / max(float(np.abs(source_px).max()), 1.0)
    # In coordinates near 1 the normal equations are well conditioned.
    shrink = np.diag([scale, scale, 1.0])
    matrix = shrink @ start @ np.linalg.inv(shrink)
    source, target = source_px * scale, target_px * scale
    for reach_px in reaches_px:
        mapped = source @ matrix[:, :2].T + matrix[:, 2]
        depth = mapped[:, 2:]
        image = mapped[:, :2] / depth
        error = target - image
        weight = np.clip(1.0 - np.sum(error**2, axis=1) / (2 * (reach_px * scale)) ** 2, 0.0, None) ** 2
        slope = np.zeros((2, len(source), 8))  # of x and of y by the eight free entries
        slope[0, :, :2] = slope[1, :, 3:5] = source / depth
        slope[0, :, 2] = slope[1, :, 5] = 1 / depth[:, 0]
        slope[:, :, 6:] = -image.T[:, :, None] * slope[0, :, :2]
        rows = slope.reshape(-1, 8)
        weighted = rows * np.tile(weight, 2)[:, None]
        normal = weighted.T @ rows + np.diag(np.full(8, 1e-12))
        change = np.linalg.solve(normal, weighted.T @ error.T.ravel())
        matrix = matrix + np.append(change, 0.0).reshape(3, 3)
    result = np.linalg.inv(shrink) @ matrix @ shrink
    return np.asarray(result / result[2, 2])
