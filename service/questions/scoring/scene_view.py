"""Which vehicles of a scene can be seen? Those that its picture shows, frame by frame, and that are on its roads."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely

from gis.cameras.camera_pose import CameraTrack, read_camera_track
from gis.cameras.lens import Lens
from service.errors import TruthError
from service.questions.scoring.object_rows import ObjectRows
from service.questions.scoring.pairs import FloatArray, IntArray
from service.records.runs import CameraRecord
from service.runs.inputs.sites.site import load_site
from service.texts.toml_tables import told


@dataclass(frozen=True, slots=True, eq=False)
class SceneView:
    """A camera with its picture.

    Attributes
    ----------
    width_px, height_px : size of the picture.
    pixel_from_ground : (3, 3), positive third coordinate in front of the camera; None where the camera moves.
    track : the poses of a camera that moves.
    lens : bends the picture of a camera that stands; None for a straight one.
    """

    width_px: int
    height_px: int
    pixel_from_ground: FloatArray | None
    track: CameraTrack | None = None
    lens: Lens | None = None

    def maps(self, t_us: IntArray) -> FloatArray:
        """Give the map from the ground to the image at some times: (n, 3, 3).

        Raises
        ------
        TruthError
            If the camera's poses do not reach so far.
        """
        if self.track is None:
            assert self.pixel_from_ground is not None
            return np.broadcast_to(self.pixel_from_ground, (len(t_us), 3, 3))
        times_us, place = np.unique(t_us, return_inverse=True)
        with told(TruthError, "camera.csv"):
            poses = [self.track.at(one) for one in times_us.tolist()]
        maps = [pose.camera(self.width_px, self.height_px).pixel_from_ground for pose in poses]
        return np.asarray(np.array(maps).reshape(-1, 3, 3)[place])

    def look_at(self, rows: ObjectRows, t_us: IntArray, *, edge_m: float) -> ObjectRows:
        """Find the image boxes of footprints, and add to the border what is not wholly in the picture.

        Parameters
        ----------
        rows : true rows. t_us : (n,) their times.
        edge_m : how much the footprint is grown all round before it must be in the picture.
        """
        maps = self.maps(t_us)
        box_px = _bounds(maps, _corners(rows, 0.0), self.lens)
        left, top, width, height = _bounds(maps, _corners(rows, edge_m), self.lens).T
        # Written so that nan, from a corner behind the camera, is outside; pixel centres are whole numbers.
        inside = (left >= -0.5) & (top >= -0.5)
        inside &= (left + width <= self.width_px - 0.5) & (top + height <= self.height_px - 0.5)
        return replace(rows, is_border=rows.is_border | ~inside, box_px=np.nan_to_num(box_px))

    def to_ground(self, t_us: IntArray, points_px: FloatArray) -> FloatArray:
        """Map pixels to the ground: (n, 2) at n times; nan above the horizon."""
        points_px = points_px if self.lens is None else self.lens.straighten(points_px)
        scaled = np.einsum(
            "nij,nj->ni", np.linalg.inv(self.maps(t_us)), np.column_stack((points_px, np.ones(len(t_us))))
        )
        depth = np.where(scaled[:, 2:] > 0, scaled[:, 2:], np.nan)
        return np.asarray(scaled[:, :2] / depth)


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
    size_px = _picture_size(folder)
    if size_px is not None and (folder / "camera.csv").is_file():
        with told(TruthError):
            return SceneView(*size_px, None, read_camera_track(folder / "camera.csv"))
    site_path = folder / "site.toml"
    if size_px is not None and site_path.is_file():
        site = load_site(site_path)
        if site.motion is not None and site.motion.poses is not None:
            return SceneView(*size_px, None, site.motion.poses)
        if site.camera is not None and site.motion is None:
            return SceneView(*size_px, site.camera.pixel_from_ground, lens=site.camera.lens)
    if camera is None:
        return None
    matrix = np.array(camera.pixel_from_ground).reshape(3, 3)
    return SceneView(camera.width_px, camera.height_px, matrix, lens=camera.lens)


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


def _picture_size(folder: Path) -> tuple[int, int] | None:
    from vision.video.frames import open_video

    path = folder / "video.mp4"
    if not path.is_file():
        return None
    video = open_video(path)
    return video.width_px, video.height_px


def _corners(rows: ObjectRows, margin_m: float) -> FloatArray:
    """Compute the corners of grown footprints: (n, 4, 2)."""
    ahead = np.stack((np.cos(rows.heading_rad), np.sin(rows.heading_rad)), axis=-1)
    left = np.stack((-ahead[:, 1], ahead[:, 0]), axis=-1)
    ahead = ahead * (rows.length_m / 2 + margin_m)[:, None]
    left = left * (rows.width_m / 2 + margin_m)[:, None]
    offsets_m = np.stack((ahead + left, left - ahead, -ahead - left, ahead - left), axis=1)
    return np.asarray(rows.centre_m[:, None] + offsets_m)


def _bounds(maps: FloatArray, corners_m: FloatArray, lens: Lens | None) -> FloatArray:
    """Box mapped corners: (n, 4) left, top, width, height; nan where a corner is behind the camera."""
    scaled = np.einsum("nij,nkj->nki", maps, np.concatenate((corners_m, np.ones((*corners_m.shape[:2], 1))), axis=2))
    depth = np.where(scaled[..., 2:] > 0, scaled[..., 2:], np.nan)
    points_px = scaled[..., :2] / depth
    points_px = points_px if lens is None else lens.bend(points_px)
    low, high = points_px.min(axis=1), points_px.max(axis=1)
    return np.concatenate((low, high - low), axis=1)
