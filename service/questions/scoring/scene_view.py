"""Which vehicles of a scene can be seen? Those that its picture shows, frame by frame, and that are on its roads."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from gis.cameras.camera import GroundCamera
from gis.cameras.camera_pose import CameraTrack, read_camera_track
from service.errors import TruthError
from service.questions.scoring.object_rows import ObjectRows
from service.questions.scoring.pairs import FloatArray, IntArray, groups_of
from service.records.runs import CameraRecord
from service.runs.inputs.sites.site import load_site
from service.texts.toml_tables import told

if TYPE_CHECKING:
    from vision.video.frames import VideoSource


@dataclass(frozen=True, slots=True, eq=False)
class SceneView:
    """A camera with its picture.

    Attributes
    ----------
    size_px : width and height of the picture.
    camera : one that stands, or the poses of one that moves.
    """

    size_px: tuple[int, int]
    camera: GroundCamera | CameraTrack

    def look_at(self, rows: ObjectRows, t_us: IntArray, *, edge_m: float) -> ObjectRows:
        """Find the image boxes of footprints, and add to the border what is not wholly in the picture.

        Parameters
        ----------
        rows : true rows. t_us : (n,) their times.
        edge_m : how much the footprint is grown all round before it must be in the picture.
        """
        left, top, width, height = self._boxes(t_us, _corners(rows, edge_m)).T
        # Written so that nan, from a corner behind the camera, is outside; pixel centres are whole numbers.
        inside = (left >= -0.5) & (top >= -0.5)
        inside &= (left + width <= self.size_px[0] - 0.5) & (top + height <= self.size_px[1] - 0.5)
        box_px = np.nan_to_num(self._boxes(t_us, _corners(rows, 0.0)))
        return replace(rows, is_border=rows.is_border | ~inside, box_px=box_px)

    def to_ground(self, t_us: IntArray, points_px: FloatArray) -> FloatArray:
        """Map pixels to the ground: (n, 2) at n times; nan above the horizon."""
        return self._mapped(GroundCamera.to_ground, t_us, points_px[:, None])[:, 0]

    def _boxes(self, t_us: IntArray, corners_m: FloatArray) -> FloatArray:
        """Box corners in the picture: (n, 4) left, top, width, height; nan where one is behind the camera."""
        points_px = self._mapped(GroundCamera.to_pixels, t_us, corners_m)
        low, high = points_px.min(axis=1), points_px.max(axis=1)
        return np.concatenate((low, high - low), axis=1)

    def _mapped(
        self, mapping: Callable[[GroundCamera, FloatArray], FloatArray], t_us: IntArray, points: FloatArray
    ) -> FloatArray:
        """Map points, (n, k, 2), by the camera of each of n times.

        Raises
        ------
        TruthError
            If the camera's poses do not reach so far.
        """
        if isinstance(self.camera, GroundCamera):
            return mapping(self.camera, points.reshape(-1, 2)).reshape(points.shape)
        mapped = np.empty_like(points)
        for rows in groups_of(t_us):
            with told(TruthError, "camera.csv"):
                camera = self.camera.at(int(t_us[rows[0]])).camera(*self.size_px)
            mapped[rows] = mapping(camera, points[rows].reshape(-1, 2)).reshape(-1, *points.shape[1:])
        return mapped


def load_scene_view(folder: Path, camera: CameraRecord | None = None) -> SceneView | None:
    """Find out what the picture of a scene shows.

    Parameters
    ----------
    folder : of the scene; `camera.csv` (a moving camera) or `site.toml`, with the size of `video.mp4`.
    camera : the camera of a run, if it stands still; for a folder that knows none.

    Returns
    -------
    The view; None if neither knows one.

    Raises
    ------
    ServiceError, VisionError
        If a file that is there cannot be read.
    """
    video = scene_video(folder)
    size_px = None if video is None else (video.width_px, video.height_px)
    if size_px is not None and (folder / "camera.csv").is_file():
        with told(TruthError):
            return SceneView(size_px, read_camera_track(folder / "camera.csv"))
    site_path = folder / "site.toml"
    if size_px is not None and site_path.is_file():
        site = load_site(site_path)
        if site.motion is not None and site.motion.poses is not None:
            return SceneView(size_px, site.motion.poses)
        if site.camera is not None and site.motion is None:
            return SceneView(size_px, site.camera)
    if camera is None:
        return None
    ground_from_pixel = np.linalg.inv(np.array(camera.pixel_from_ground).reshape(3, 3))
    return SceneView((camera.width_px, camera.height_px), GroundCamera.from_homography(ground_from_pixel, camera.lens))


def load_scene_roads(folder: Path) -> shapely.Geometry | None:
    """Find the roads of a scene.

    Parameters
    ----------
    folder : of the scene, with `site.toml`.

    Returns
    -------
    Their surface in metres, prepared; None where no site file tells of roads.

    Raises
    ------
    ServiceError
        If the site file cannot be read.
    """
    path = folder / "site.toml"
    network = load_site(path).network if path.is_file() else None
    if network is None:
        return None
    surface = network.surface()
    shapely.prepare(surface)
    return surface


def keep_to_roads(rows: ObjectRows, roads: shapely.Geometry | None) -> ObjectRows:
    """Add to the border what has its centre beside the roads; nothing if no roads are known.

    Examples
    --------
    >>> import numpy as np
    >>> nothing, false = np.zeros(2), np.zeros(2, bool)
    >>> names = np.array(["driving", "parked"])
    >>> centre_m = np.array([[5.0, 1.0], [5.0, 6.0]])
    >>> rows = ObjectRows(np.zeros(2, int), names, centre_m, nothing, nothing, nothing, false, false, names)
    >>> keep_to_roads(rows, shapely.box(0, 0, 100, 4)).is_border.tolist()
    [False, True]
    """
    if roads is None:
        return rows
    x_m, y_m = rows.centre_m.T
    return replace(rows, is_border=rows.is_border | ~shapely.intersects_xy(roads, x_m, y_m))


def scene_video(folder: Path) -> "VideoSource | None":
    """Open the video of a scene; None if it has none."""
    from vision.video.frames import open_video

    path = folder / "video.mp4"
    return open_video(path) if path.is_file() else None


def _corners(rows: ObjectRows, margin_m: float) -> FloatArray:
    """Compute the corners of grown footprints: (n, 4, 2)."""
    ahead = np.stack((np.cos(rows.heading_rad), np.sin(rows.heading_rad)), axis=-1)
    left = np.stack((-ahead[:, 1], ahead[:, 0]), axis=-1)
    ahead = ahead * (rows.length_m / 2 + margin_m)[:, None]
    left = left * (rows.width_m / 2 + margin_m)[:, None]
    offsets_m = np.stack((ahead + left, left - ahead, -ahead - left, ahead - left), axis=1)
    return np.asarray(rows.centre_m[:, None] + offsets_m)
