"""Where does a camera hang and where does it look, at each time? Poses, and the file of poses of a moving camera.

A pinhole camera without distortion whose principal point is the middle of the image. Its line of sight has the
direction `yaw_rad` over the ground and rises by `pitch_rad`; straight down (-pi/2) yaw is the direction of image up.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gis.cameras.camera import GroundCamera
from gis.errors import GisError
from gis.polyline import FloatArray

IntArray = NDArray[np.int64]

TOLERANCE_US = 500_000
"""A pose this far from the nearest sample is still taken for known; flight logs have one to ten samples a second."""


@dataclass(frozen=True, slots=True)
class CameraPose:
    """Place, direction and focal length of a pinhole camera over a flat ground at height 0.

    Attributes
    ----------
    x_m, y_m : foot of the camera, local east/north frame.
    height_m : over the ground, > 0.
    yaw_rad : direction of sight over the ground; of image up where the camera looks straight down.
    pitch_rad : of the line of sight, in [-pi/2, pi/2]; -pi/2 is straight down, 0 is level.
    roll_rad : turn about the line of sight, positive clockwise as the camera itself would see it.
    focal_px : focal length in pixels, > 0.

    Raises
    ------
    GisError
        If a value is not finite or out of range.

    Examples
    --------
    >>> pose = CameraPose(50.0, 20.0, 100.0, math.pi / 2, -math.pi / 2, 0.0, 200.0)
    >>> camera = pose.camera(1280, 720)
    >>> camera.to_ground([[639.5, 359.5], [641.5, 359.5]]).round(9).tolist()    # 0.5 m a pixel, north up
    [[50.0, 20.0], [51.0, 20.0]]
    """

    x_m: float
    y_m: float
    height_m: float
    yaw_rad: float
    pitch_rad: float
    roll_rad: float
    focal_px: float

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not math.isfinite(value):
                raise GisError(f"camera pose: {field.name} must be finite, got {value!r}")
        for name in ("height_m", "focal_px"):
            if getattr(self, name) <= 0:
                raise GisError(f"camera pose: {name} must be > 0, got {getattr(self, name)!r}")
        # Written with a margin, so that -pi/2 survives a text file.
        if abs(self.pitch_rad) > math.pi / 2 + 1e-6:
            raise GisError(f"camera pose: pitch_rad must be in [-pi/2, pi/2], got {self.pitch_rad!r}")

    def projection(self, width_px: int, height_px: int) -> FloatArray:
        """Give the map from points in space to pixels.

        Parameters
        ----------
        width_px, height_px : image size.

        Returns
        -------
        (3, 4), homogeneous pixels from (x_m, y_m, height_m, 1); the third coordinate is the distance in metres along
        the line of sight, positive in front of the camera.
        """
        right, up, forward = self._axes()
        middle_x, middle_y = (width_px - 1) / 2, (height_px - 1) / 2
        turn = np.vstack(
            (self.focal_px * right + middle_x * forward, -self.focal_px * up + middle_y * forward, forward)
        )
        return np.column_stack((turn, -turn @ self.place_m))

    def camera(self, width_px: int, height_px: int) -> GroundCamera:
        """Give the map between pixels and the ground.

        Parameters
        ----------
        width_px, height_px : image size.

        Returns
        -------
        The camera.

        Raises
        ------
        GisError
            If the camera sees no ground map worth the name: no invertible one.
        """
        return GroundCamera.from_homography(np.linalg.inv(self.projection(width_px, height_px)[:, [0, 1, 3]]))

    @property
    def place_m(self) -> FloatArray:
        """The camera's own place, (3,): x, y and height."""
        return np.array([self.x_m, self.y_m, self.height_m])

    def _axes(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Right, up and forward of the camera as unit vectors in space."""
        east, north = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        level, rise = math.cos(self.pitch_rad), math.sin(self.pitch_rad)
        forward = np.array([level * east, level * north, rise])
        up = np.array([-rise * east, -rise * north, level])
        right = np.array([north, -east, 0.0])
        cosine, sine = math.cos(self.roll_rad), math.sin(self.roll_rad)
        return cosine * right - sine * up, sine * right + cosine * up, forward


COLUMNS = ("t_us", *(field.name for field in fields(CameraPose)))


@dataclass(frozen=True, slots=True, eq=False)
class CameraTrack:
    """The poses of a moving camera.

    Attributes
    ----------
    t_us : (n,), rising, at least one, on the clock of the video.
    poses : n of them.

    Raises
    ------
    GisError
        If there is no sample, the lengths differ or the times do not rise.
    """

    t_us: IntArray
    poses: tuple[CameraPose, ...]

    def __post_init__(self) -> None:
        t_us = np.array(self.t_us, dtype=np.int64)
        if t_us.shape != (len(self.poses),) or len(t_us) == 0:
            expected = "as many times as poses, at least one"
            raise GisError(f"camera track: expected {expected}, got {t_us.shape!r} and {len(self.poses)}")
        if not (np.diff(t_us) > 0).all():
            place = int(np.argmax(np.diff(t_us) <= 0))
            raise GisError(f"camera track: times must rise, got {t_us[place]} us before {t_us[place + 1]} us")
        t_us.flags.writeable = False
        object.__setattr__(self, "t_us", t_us)

    def at(self, t_us: int, *, tolerance_us: int = TOLERANCE_US) -> CameraPose:
        """Tell the pose at a time: linear between two samples, the nearest one before the first and after the last.

        Parameters
        ----------
        t_us : on the clock of the video.
        tolerance_us : how far away the nearest sample may be.

        Returns
        -------
        The pose; angles go the shorter way round.

        Raises
        ------
        GisError
            If no sample is near enough.

        Examples
        --------
        >>> west, north = (CameraPose(0.0, 0.0, 90.0, yaw_rad, -1.0, 0.0, 900.0) for yaw_rad in (3.0, 1.0))
        >>> track = CameraTrack(np.array([0, 200_000]), (west, north))
        >>> track.at(50_000).yaw_rad
        2.5
        >>> track.at(900_000)
        Traceback (most recent call last):
        ...
        gis.errors.GisError: camera track: expected a pose within 500000 us of 900000 us, the nearest is at 200000 us
        """
        after = int(np.searchsorted(self.t_us, t_us))
        before = max(after - 1, 0)
        after = min(after, len(self.poses) - 1)
        nearest = min(before, after, key=lambda place: abs(int(self.t_us[place]) - t_us))
        if abs(int(self.t_us[nearest]) - t_us) > tolerance_us:
            expected = f"expected a pose within {tolerance_us} us of {t_us} us"
            raise GisError(f"camera track: {expected}, the nearest is at {self.t_us[nearest]} us")
        if before == after or not self.t_us[before] < t_us < self.t_us[after]:
            return self.poses[nearest]
        share = (t_us - int(self.t_us[before])) / int(self.t_us[after] - self.t_us[before])
        return _between(self.poses[before], self.poses[after], share)


def read_camera_track(path: str | Path) -> CameraTrack:
    """Read a file of camera poses.

    Parameters
    ----------
    path : CSV with the columns of `COLUMNS` in any order; further columns are ignored.

    Returns
    -------
    The track.

    Raises
    ------
    GisError
        If the file is missing, lacks a column, or a row is wrong; the message says file and line.
    """
    path = Path(path)
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:  # spreadsheets write a mark of byte order
            samples = list(_read_rows(csv.DictReader(file), path))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise GisError(f"{path}: expected a readable CSV file of camera poses, got {error!s}") from error
    try:
        return CameraTrack(np.array([t_us for t_us, _ in samples], dtype=np.int64), tuple(pose for _, pose in samples))
    except GisError as error:
        raise GisError(f"{path}: {error}") from error


def write_camera_track(path: str | Path, track: CameraTrack) -> None:
    """Write a file of camera poses, which `read_camera_track` reads back without loss.

    Parameters
    ----------
    path : replaced if it exists.
    track : to write.
    """
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for t_us, pose in zip(track.t_us.tolist(), track.poses, strict=True):
            # repr gives the shortest text that reads back as the same number.
            writer.writerow([t_us, *(repr(float(getattr(pose, name))) for name in COLUMNS[1:])])


def _read_rows(reader: csv.DictReader[str], path: Path) -> Iterator[tuple[int, CameraPose]]:
    missing = [name for name in COLUMNS if name not in (reader.fieldnames or ())]
    if missing:
        raise GisError(f"{path}: expected the columns {', '.join(COLUMNS)}, got no {missing[0]!r}")
    for row in reader:
        where = f"{path}, line {reader.line_num}"
        try:
            t_us = int(row["t_us"])
            np.int64(t_us)
            values = [float(row[name]) for name in COLUMNS[1:]]
        except (TypeError, ValueError, OverflowError) as error:
            raise GisError(f"{where}: expected a whole t_us and seven numbers, got {list(row.values())!r}") from error
        try:
            pose = CameraPose(*values)
        except GisError as error:
            raise GisError(f"{where}: {error}") from error
        yield t_us, pose


def _between(first: CameraPose, second: CameraPose, share: float) -> CameraPose:
    values = []
    for field in fields(CameraPose):
        start, end = getattr(first, field.name), getattr(second, field.name)
        way = math.remainder(end - start, math.tau) if field.name.endswith("_rad") else end - start
        values.append(start + share * way)
    return CameraPose(*values)
