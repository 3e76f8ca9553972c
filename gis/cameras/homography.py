"""Which homography maps some points of a plane to others, with the least error, and does the lens bend them besides?

Normalised direct linear transformation (Hartley and Zisserman 2004, Multiple View Geometry, sections 4.1 and 4.4),
then least squares on the error in the second plane. We whiten the points instead of only scaling them: a road seen
along its length fills a long thin strip, which isotropic scaling leaves badly conditioned.
"""

import numpy as np

from gis.cameras.lens import MAX_RADIAL, Lens
from gis.errors import GisError
from gis.polyline import FloatArray

# Clicks are good to about a pixel, so points within this of one line fix no plane.
_MIN_SPREAD_PX = 1.0
_MIN_SPREAD_RATIO = 1e-6
# Singular values of the equations, and condition of the result, in whitened coordinates; sound sets lie far away.
_MIN_SINGULAR_RATIO = 1e-6
_MAX_CONDITION = 1e6
# Eight pairs give sixteen numbers for nine unknowns; of fewer, clicks of a pixel pass for a lens.
LEAST_PAIRS_FOR_LENS = 8
# So rarely would a straight lens seem bent: by an F test of one more unknown. The bend clip has .05, the intersection
# 1e-21.
_LENS_CHANCE = 1e-3


def fit_homography(ground_m: FloatArray, pixels_px: FloatArray) -> FloatArray:
    """Fit the map from ground points to pixels.

    Parameters
    ----------
    ground_m : (n, 2), n >= 4.
    pixels_px : (n, 2), the same points in the image.

    Returns
    -------
    (3, 3), of no particular scale or sign, with the least sum of squared errors in pixels.

    Raises
    ------
    GisError
        If there are fewer than four pairs, a number is not finite, or the points leave the map open: all or all but
        one on a line, or some of them equal.
    """
    if len(ground_m) != len(pixels_px) or len(ground_m) < 4:
        came = f"{len(pixels_px)} pixels and {len(ground_m)} ground points"
        raise GisError(f"camera: expected at least 4 pairs of points, got {came}")
    if not (np.isfinite(ground_m).all() and np.isfinite(pixels_px).all()):
        raise GisError("camera: expected finite coordinates in all point pairs, got nan or infinity")
    from_ground = _whitening(ground_m, "ground points", 0.0)
    from_pixels = _whitening(pixels_px, "pixels", _MIN_SPREAD_PX)
    white = _solve(transform(from_ground, ground_m), transform(from_pixels, pixels_px))
    fitted = np.linalg.inv(from_pixels) @ white @ from_ground
    return _refine(fitted, from_ground, ground_m, pixels_px)


def fit_camera(
    ground_m: FloatArray, pixels_px: FloatArray, size_px: tuple[int, int] | None = None, radial: float | None = None
) -> tuple[FloatArray, Lens | None]:
    """Fit the map from ground points to pixels, with a lens where one is needed.

    Parameters
    ----------
    ground_m, pixels_px : as of `fit_homography`.
    size_px : width and height of the picture; without it the lens is taken for straight.
    radial : of the lens where it is known, 0 for a straight one; None fits one, from eight pairs on, and keeps it only
        where the errors fall by more than a straight lens with errors of that size would explain.

    Returns
    -------
    The map from the ground to the straight picture as `fit_homography` gives it, and the lens that bends the picture.

    Raises
    ------
    GisError
        As `fit_homography`, or if `radial` is out of range.
    """
    if size_px is not None and radial:
        lens = Lens(size_px, radial)
        return fit_homography(ground_m, lens.straighten(pixels_px)), lens
    plane = fit_homography(ground_m, pixels_px)
    if size_px is None or radial is not None or len(pixels_px) < LEAST_PAIRS_FOR_LENS:
        return plane, None
    from scipy.optimize import least_squares
    from scipy.special import fdtrc

    from_ground = _whitening(ground_m, "ground points", 0.0)
    white_ground, size = transform(from_ground, ground_m), size_px

    def lens_of(unknowns: FloatArray) -> Lens:
        return Lens(size, float(np.clip(unknowns[9], -MAX_RADIAL, MAX_RADIAL)))

    def errors_px(unknowns: FloatArray) -> FloatArray:
        straight_px = transform(unknowns[:9].reshape(3, 3), white_ground)
        return (lens_of(unknowns).bend(straight_px) - pixels_px).ravel()

    start = (plane @ np.linalg.inv(from_ground)).ravel()
    start = np.append(start / np.linalg.norm(start), 0.0)
    before = errors_px(start)
    if not np.isfinite(before).all():
        return plane, None
    scale = np.maximum(np.abs(start), [*np.full(9, 1e-9), 0.1])
    solution = least_squares(errors_px, start, x_scale=scale)
    left, free = float((solution.fun**2).sum()), len(before) - 9
    gain = float((before**2).sum()) - left
    if gain <= 1e-12 * len(before) or fdtrc(1, free, gain * free / max(left, 1e-12)) > _LENS_CHANCE:
        return plane, None
    return np.asarray(solution.x[:9].reshape(3, 3) @ from_ground), lens_of(solution.x)


def _whitening(points: FloatArray, what: str, min_spread: float) -> FloatArray:
    """Give the affine map that turns points into a set with zero mean and unit covariance."""
    mean = points.mean(axis=0)
    _, spread, axes = np.linalg.svd((points - mean) / np.sqrt(len(points)), full_matrices=False)
    if spread[1] <= max(min_spread, _MIN_SPREAD_RATIO * spread[0]):
        raise GisError(f"camera: expected {what} that spread over an area, got points on one line: {points.tolist()!r}")
    linear = axes / spread[:, None]
    matrix = np.eye(3)
    matrix[:2, :2], matrix[:2, 2] = linear, -linear @ mean
    return matrix


def _solve(source: FloatArray, target: FloatArray) -> FloatArray:
    point = np.column_stack((source, np.ones(len(source))))
    zero = np.zeros_like(point)
    equations = np.vstack(
        (np.hstack((point, zero, -target[:, :1] * point)), np.hstack((zero, point, -target[:, 1:] * point)))
    )
    _, singular, axes = np.linalg.svd(equations)
    matrix: FloatArray = axes[-1].reshape(3, 3)
    # Eight unknowns up to scale: the eighth singular value vanishes if more than one map fits.
    if singular[7] < _MIN_SINGULAR_RATIO * singular[0] or np.linalg.cond(matrix) > _MAX_CONDITION:
        expected = "point pairs that fix one map: four of them, no three on a line"
        raise GisError(f"camera: expected {expected}, got pairs that leave it open")
    return matrix


def _refine(fitted: FloatArray, from_ground: FloatArray, ground_m: FloatArray, pixels_px: FloatArray) -> FloatArray:
    from scipy.optimize import least_squares

    white_ground = transform(from_ground, ground_m)
    start = fitted @ np.linalg.inv(from_ground)

    def errors_px(entries: FloatArray) -> FloatArray:
        return (transform(entries.reshape(3, 3), white_ground) - pixels_px).ravel()

    if len(ground_m) == 4 or not np.isfinite(errors_px(start.ravel())).all():
        return fitted
    start = start / np.linalg.norm(start)
    # Nine entries for eight unknowns: the solver's trust region holds the free scale in place.
    solution = least_squares(errors_px, start.ravel(), x_scale=np.maximum(np.abs(start.ravel()), 1e-9))
    return np.asarray(solution.x.reshape(3, 3) @ from_ground, dtype=np.float64)


def transform(matrix: FloatArray, points: FloatArray) -> FloatArray:
    """Map points, (n, 2), by a homography, (3, 3); what lies on its horizon becomes nan or infinite."""
    mapped = points @ matrix[:, :2].T + matrix[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(mapped[:, :2] / mapped[:, 2:], dtype=np.float64)
