"""How do position and velocity follow from noisy positions? A constant-velocity Kalman filter over many tracks at once.

State per track: x, y, vx, vy. Motion noise is white acceleration, larger along the heading than across it, given
for one second: unlike noise per step, it means the same at every frame rate and across dropped frames.
"""

import numpy as np

from vision.objects import FloatArray

POSITION, VELOCITY = slice(0, 2), slice(2, 4)


def oriented_covariance(heading_rad: FloatArray, along: FloatArray, across: FloatArray) -> FloatArray:
    """Build covariance matrices with given standard deviations along and across directions.

    Parameters
    ----------
    heading_rad, along, across : (n,) each.

    Returns
    -------
    (n, 2, 2).

    Examples
    --------
    >>> north = np.array([np.pi / 2])
    >>> np.round(oriented_covariance(north, np.array([3.0]), np.array([1.0]))[0], 6).tolist()
    [[1.0, 0.0], [0.0, 9.0]]
    """
    cos, sin = np.cos(heading_rad), np.sin(heading_rad)
    a, c = along**2, across**2
    result = np.empty((len(cos), 2, 2))
    result[:, 0, 0] = a * cos**2 + c * sin**2
    result[:, 0, 1] = result[:, 1, 0] = (a - c) * cos * sin
    result[:, 1, 1] = a * sin**2 + c * cos**2
    return result


def predict(state: FloatArray, covariance: FloatArray, noise: FloatArray, dt_s: float) -> tuple[FloatArray, FloatArray]:
    """Move tracks on by a time step.

    Parameters
    ----------
    state : (n, 4).
    covariance : (n, 4, 4).
    noise : (n, 2, 2) acceleration noise, m2/s3: the variance of the velocity gained in one second.
    dt_s : seconds.

    Returns
    -------
    State and covariance after `dt_s`.
    """
    moved = state.copy()
    moved[:, :2] += state[:, 2:] * dt_s
    position, cross, velocity = covariance[:, :2, :2], covariance[:, :2, 2:], covariance[:, 2:, 2:]
    grown = np.empty_like(covariance)
    grown[:, :2, :2] = position + dt_s * (cross + cross.transpose(0, 2, 1)) + dt_s**2 * velocity + dt_s**3 / 3 * noise
    grown[:, :2, 2:] = cross + dt_s * velocity + dt_s**2 / 2 * noise
    grown[:, 2:, :2] = grown[:, :2, 2:].transpose(0, 2, 1)
    grown[:, 2:, 2:] = velocity + dt_s * noise
    return moved, grown


def update(
    state: FloatArray, covariance: FloatArray, measured: FloatArray, noise: FloatArray, part: slice = POSITION
) -> tuple[FloatArray, FloatArray]:
    """Correct tracks by measured positions, or velocities.

    Parameters
    ----------
    state : (n, 4).
    covariance : (n, 4, 4).
    measured : (n, 2).
    noise : (n, 2, 2) covariance of the measurement.
    part : of the state that was measured.

    Returns
    -------
    State and covariance given the measurements.
    """
    gain = covariance[:, :, part] @ inverse(covariance[:, part, part] + noise)
    corrected = state + (gain @ (measured - state[:, part])[..., None])[..., 0]
    shrunk = covariance - gain @ covariance[:, part, :]
    return corrected, (shrunk + shrunk.transpose(0, 2, 1)) / 2


def inverse(matrices: FloatArray) -> FloatArray:
    """Invert many small symmetric matrices by the closed form.

    Parameters
    ----------
    matrices : (..., 2, 2), positive definite.

    Returns
    -------
    (..., 2, 2).
    """
    a, b, d = matrices[..., 0, 0], matrices[..., 0, 1], matrices[..., 1, 1]
    result = np.empty_like(matrices)
    result[..., 0, 0], result[..., 1, 1] = d, a
    result[..., 0, 1] = result[..., 1, 0] = -b
    result /= (a * d - b * b)[..., None, None]
    return result


def squared_distance(
    state: FloatArray, covariance: FloatArray, measured_m: FloatArray, noise: FloatArray
) -> FloatArray:
    """Measure squared Mahalanobis distances of tracks to measurements; leading axes broadcast.

    Parameters
    ----------
    state : (..., 4).
    covariance : (..., 4, 4).
    measured_m : (..., 2).
    noise : (..., 2, 2).

    Returns
    -------
    (...,).

    Examples
    --------
    >>> squared_distance(np.zeros((1, 4)), np.eye(4)[None], np.array([[0.0, 2.0]]), np.eye(2)[None]).tolist()
    [2.0]
    """
    difference = measured_m - state[..., :2]
    spread = covariance[..., :2, :2] + noise
    x, y = difference[..., 0], difference[..., 1]
    a, b, d = spread[..., 0, 0], spread[..., 0, 1], spread[..., 1, 1]
    return np.asarray((d * x * x - 2 * b * x * y + a * y * y) / (a * d - b * b))
