"""What if all there is are detections? A file of them with a site, and the tracking of its boxes."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from gis.cameras.camera import GroundCamera
from gis.roads.road_network import plain_rings
from service.errors import InputError
from service.records.runs import InputKind
from service.runs.graph.pipeline import VIDEO, Feed
from service.runs.inputs.detectors import FileChoice, describe
from service.runs.inputs.input_kind import Asked, Input, camera_record
from service.runs.inputs.sensors.moving_camera import StoredPoses, first_camera, watched_area
from service.runs.inputs.sites.site import Site, check_picture
from service.texts.toml_tables import told
from vision.camera import Camera, box_camera
from vision.networks.box_detector import Instant
from vision.networks.stored_detections import StoredDetections, StoredInstant
from vision.objects import FloatArray

NO_PICTURE = (0, 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionInput(Input):
    """Read a file of detections that stands alone.

    Attributes
    ----------
    instants : the moments of the file.
    vision : the tracking that looks at them.
    """

    kind: ClassVar[InputKind] = "detections"
    instants: Iterator[StoredInstant]
    vision: Camera[Instant]

    @classmethod
    def fits(cls, asked: Asked) -> bool:
        """Take a file of detections where nothing else is given."""
        return isinstance(asked.choice, FileChoice) and asked.choice.path == asked.path

    @classmethod
    def open(cls, asked: Asked) -> "DetectionInput":
        """Read the file; the site must say where its boxes are.

        That is a camera and the picture's size for boxes in pixels, roads or a camera for those in metres.
        """
        path, site, choice = asked.path, asked.site, asked.choice
        assert isinstance(choice, FileChoice), "it fits"
        stored = choice.open(site.vision)
        if len(stored) == 0:
            raise InputError(f"{path}: expected at least one detection above the score threshold, got none")
        camera, size_px = _camera(path, stored, site)
        if stored.is_by_frame and site.detector.file_rate_hz is None:
            raise InputError(
                f"{path}: expected file_rate_hz in [detector] for detections by frame without a video, got none"
            )
        area_m = _area(path, camera, site, size_px)
        poses = site.motion.poses if site.motion and camera is not None else None
        with told(InputError, path, "with the camera and roads of its site"):
            vision = box_camera(
                stored,
                area_m,
                size_px,
                pixel_from_ground=None if camera is None else camera.pixel_from_ground,
                lens=None if camera is None else camera.lens,
                motion=None if poses is None else StoredPoses(poses, size_px),
                settings=site.vision,
            )
        return cls(
            path=path,
            instants=stored.instants(site.detector.file_rate_hz),
            vision=vision,
            network=asked.site.network,
            detector=describe(choice),
            frame_count=stored.last_key + 1 if stored.is_by_frame else None,
            camera=None if camera is None else camera_record(camera, size_px),
        )

    def feed(self, *, apart: bool = False) -> Feed:
        """Give the moments of the file, and the tracking to look at them."""
        return Feed(VIDEO, self.instants, self.vision, self.vision.notes)


def _camera(path: Path, stored: StoredDetections, site: Site) -> tuple[GroundCamera | None, tuple[int, int]]:
    """Find the camera of the first moment; detections in metres do without one."""
    size_px = site.detector.size_px
    is_known = site.camera is not None or site.motion is not None
    if stored.is_on_ground and (not is_known or size_px is None):
        return None, NO_PICTURE
    if not is_known:
        raise InputError(f"{path}: expected a [camera] in the site file for boxes in pixels, got none")
    if size_px is None:
        raise InputError(f"{path}: expected size_px in [detector] for boxes in pixels without a video, got none")
    if site.motion is not None and site.motion.poses is None:
        raise InputError(f"{path}: expected poses of the moving camera for detections without a video, got none")
    check_picture(site, path, size_px)
    with told(InputError, site.path, f"for {path.name}"):
        return first_camera(site.camera, site.motion, size_px), size_px


def _area(path: Path, camera: GroundCamera | None, site: Site, size_px: tuple[int, int]) -> tuple[FloatArray, ...]:
    """Outline the ground on which detections are believed."""
    if camera is None:
        if site.network is None:
            raise InputError(f"{path}: expected a site file with a [network] or a [camera], got none")
        return plain_rings(site.network.surface())
    with told(InputError, site.path, f"for {path.name}"):
        return watched_area(camera, site.network, site.road_mask, size_px, site.motion)
