"""What can be processed? A video seen by a fixed or moving camera, or the trajectories of somebody else's tracker."""

import hashlib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chronicles.chronicle_set import ChronicleSet
from dyknow.streams.sample import Sample
from gis.camera import GroundCamera
from gis.errors import GisError
from gis.road_network import RoadNetwork
from service.errors import InputError
from service.monitoring.monitor_files import NO_MONITORS, LoadedMonitors
from service.records import CameraRecord, InputKind
from service.runs.inputs.detection_input import DetectionInput, open_detections
from service.runs.inputs.detectors import (
    FileChoice,
    MotionChoice,
    OnnxChoice,
    check_against,
    choose_detector,
    describe,
)
from service.runs.inputs.moving_camera import first_camera, moving_area
from service.runs.inputs.site import Motion, Site
from service.runs.inputs.trajectories import DIGEST_BYTES, STANDARD_INPUT, Trajectories, is_read_once, load_trajectories
from service.runs.inputs.video_sensor import ThermalVideo, VideoSensor
from service.runs.inputs.watched_area import watched_area
from service.runs.pipeline import Feed, KplText, trajectory_pipeline, video_pipeline
from service.runs.seen_frames import see
from vision.errors import VisionError
from vision.fused_camera import FixedView
from vision.networks.onnx_detector import OnnxDetector
from vision.networks.stored_detections import StoredDetections
from vision.road.scale import estimate_scale, image_plane
from vision.video.frames import VideoSource, open_video

FloatArray = NDArray[np.float64]

TRAJECTORY_SUFFIXES = (".csv",)
_ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:/")
HASHED_BLOCK_BYTES = 1 << 20
SCALE_SPAN_US = 10_000_000
SCALE_STEP_US = 500_000


@dataclass(frozen=True, slots=True)
class VideoInput:
    """Read a video seen by a camera with a known map to the ground.

    Attributes
    ----------
    warnings : what the user should know about how the input is read.
    detector, detector_files : what looks at the frames, in words, and the files that it depends on.
    """

    path: Path
    sensor: VideoSensor
    warnings: tuple[str, ...] = ()
    detector: str = "motion"
    detector_files: tuple[Path, ...] = ()
    kind: InputKind = "video"

    @property
    def network(self) -> RoadNetwork | None:
        """Return the roads in view."""
        return self.sensor.network

    @property
    def frame_count(self) -> int | None:
        """Return the number of frames by the container."""
        return self.sensor.video.frame_count

    @property
    def camera(self) -> CameraRecord:
        """Return how the ground maps to the image, for the log."""
        numbers = tuple(self.sensor.ground_camera.pixel_from_ground.ravel().tolist())
        return CameraRecord(numbers, *self.sensor.size_px)

    def feed(
        self,
        chronicle_set: ChronicleSet,
        monitors: LoadedMonitors = NO_MONITORS,
        *,
        kpl: KplText | None = None,
        clock: Callable[[], int],
    ) -> Feed:
        """Run vision for this camera in front of the reasoning."""
        try:
            vision = self.sensor.vision()
        except (VisionError, GisError) as error:
            raise InputError(f"{self.path}: with the camera and roads of its site: {error}") from error
        frames = self.sensor.frames(vision)
        if kpl is None:
            pipeline = video_pipeline(None, self.network, chronicle_set, monitors, clock=clock)
            return Feed(pipeline, see(frames, vision, clock))
        # A text of the user's may leave out frames before vision.
        samples = (Sample(frame.t_us, frame.t_us, frame) for frame in frames)
        return Feed(video_pipeline(vision, self.network, chronicle_set, monitors, kpl=kpl, clock=clock), samples)


@dataclass(frozen=True, slots=True)
class TrajectoryInput:
    """Read the objects of a trajectory file or pipe; vision is skipped."""

    path: Path
    trajectories: Trajectories
    network: RoadNetwork | None
    warnings: tuple[str, ...] = ()
    detector: str = ""
    detector_files: tuple[Path, ...] = ()
    kind: InputKind = "trajectory"
    camera: CameraRecord | None = None

    @property
    def frame_count(self) -> int | None:
        """Return the number of distinct times."""
        return len(self.trajectories.times_us)

    def feed(
        self,
        chronicle_set: ChronicleSet,
        monitors: LoadedMonitors = NO_MONITORS,
        *,
        kpl: KplText | None = None,
        clock: Callable[[], int],
    ) -> Feed:
        """Run the reasoning alone, on the objects of each time."""
        samples = (Sample(objects.t_us, objects.t_us, objects) for objects in self.trajectories)
        return Feed(trajectory_pipeline(self.network, chronicle_set, monitors, kpl=kpl, clock=clock), samples)


Input = VideoInput | TrajectoryInput | DetectionInput


def open_input(
    path: Path, site: Site | None, columns: Mapping[str, str] | None = None, *, detector: str | None = None
) -> Input:
    """Open a file by its kind: ``.csv`` is trajectories, everything else must be a video.

    Parameters
    ----------
    columns : our column names to those of a CSV file.
    detector : in the words of `service.runs.inputs.detectors`; None for that of the site file. A file of
        detections that is the input itself stands alone.

    Raises
    ------
    InputError
        If the file is missing, does not go with the site, the detector or the column map, or no camera is known and
        too little moves to guess a scale.
    VideoError
        If it is not a video that can be read.
    VisionError
        If the detector cannot be used.
    """
    if any("\udc80" <= letter <= "\udcff" for letter in path.name):  # how Python spells a byte that is no text
        raise InputError(f"input: expected a file name in UTF-8, got {path.name!r}")
    _refuse_live(path)
    is_csv = path.suffix.lower() in TRAJECTORY_SUFFIXES or is_read_once(path)
    if detector is None and is_csv:
        trajectories = load_trajectories(path, columns)
        named = Path("stdin") if path in STANDARD_INPUT else path
        return TrajectoryInput(named, trajectories, site.network if site else None, trajectories.warnings)
    details, folder = (site.detector, site.path.parent) if site else (None, Path())
    choice = choose_detector(detector, details, folder=folder, columns=columns)
    if isinstance(choice, FileChoice) and choice.path == path:
        return open_detections(path, choice, site)
    if columns and not isinstance(choice, FileChoice):
        raise InputError(f"{path}: expected a .csv file to go with a column map, got {path.suffix or 'no suffix'!r}")
    if is_csv:
        raise InputError(f"{path}: expected a video for the detector {detector!r}, got trajectories")
    if isinstance(choice, MotionChoice):
        return _with_channels(path, site, choice)
    return _with_detector(_open_video(path, site), choice)


def _refuse_live(path: Path) -> None:
    """Refuse what is no file: an address, in which a path has lost a slash, a device, or nothing at all."""
    if path in STANDARD_INPUT:
        return
    is_address = not path.exists() and _ADDRESS.match(str(path))
    if is_address or path.is_char_device() or path.is_block_device():
        shown = str(path).replace(":/", "://", 1) if is_address else str(path)
        expected = "expected a file, since live input cannot be read yet (record a clip of it first)"
        raise InputError(f"{shown}: {expected}, got {'an address' if is_address else 'a device'}")
    if not path.exists():
        raise InputError(f"{path}: expected a video or trajectory file, got no such file")


def _with_channels(path: Path, site: Site | None, choice: MotionChoice) -> VideoInput:
    """Open what the built-in detector is to look at: the video, the thermal one beside it, or both."""
    if choice.channels == "colour":
        return replace(_open_video(path, site), detector=describe(choice))
    thermal = site.thermal if site else None
    if site is None or thermal is None:
        raise InputError(f"{path}: expected a [camera.thermal] in the site file for {describe(choice)}, got none")
    if choice.channels == "thermal":
        # Poses and masks are those of the colour camera.
        motion = None if site.motion is None else Motion(None, site.motion.reach_m)
        alone = replace(site, camera=thermal.camera, motion=motion, road_mask=None)
        source = _open_video(thermal.video, alone)
        return replace(source, sensor=replace(source.sensor, is_thermal=True), detector=describe(choice))
    source = _open_video(path, site)
    if source.sensor.motion is not None:
        warning = f"{path.name}: the camera moves, so the thermal video beside it is not looked at"
        return replace(source, detector=describe(MotionChoice()), warnings=(*source.warnings, warning))
    video = open_video(thermal.video)
    view = FixedView(thermal.camera.pixel_from_ground, (video.width_px, video.height_px))
    both = replace(source.sensor, thermal=ThermalVideo(video, view))
    return replace(source, sensor=both, detector=describe(choice))


def _open_video(path: Path, site: Site | None) -> VideoInput:
    network = site.network if site else None
    video = open_video(path)
    if site is not None and site.motion is not None:
        return _with_moving_camera(path, video, site, site.motion)
    if site is not None and site.camera is not None:
        try:
            area_m = watched_area(site.camera, network, site.road_mask, (video.width_px, video.height_px))
        except GisError as error:
            raise InputError(f"{site.path}: for {path.name}: {error}") from error
        return VideoInput(path, VideoSensor(video, site.camera, network, area_m))
    return _without_camera(path, video, network)


def _with_detector(source: VideoInput, choice: OnnxChoice | FileChoice) -> VideoInput:
    """Load the detector, so that nothing is written before it is known to work."""
    warnings: tuple[str, ...] = ()
    boxes: OnnxDetector | StoredDetections
    if isinstance(choice, OnnxChoice):
        boxes = choice.open(source.sensor.size_px)
    else:
        boxes = choice.open()
        warnings = check_against(boxes, choice.path, source.frame_count)
    return replace(
        source,
        sensor=replace(source.sensor, boxes=boxes),
        detector=describe(choice, boxes),
        detector_files=choice.files,
        warnings=(*source.warnings, *warnings),
    )


def _with_moving_camera(path: Path, video: VideoSource, site: Site, motion: Motion) -> VideoInput:
    size_px = (video.width_px, video.height_px)
    try:
        camera = first_camera(site.camera, motion, size_px)
        area_m = moving_area(camera, motion, site.network, size_px)
    except GisError as error:
        raise InputError(f"{site.path}: for {path.name}: {error}") from error
    return VideoInput(path, VideoSensor(video, camera, site.network, area_m, motion))


def _without_camera(path: Path, video: VideoSource, network: RoadNetwork | None) -> VideoInput:
    """Lay the ground into the image plane, with a scale from what moves in the first seconds."""
    if network is not None:
        raise InputError(f"{path}: expected a [camera] beside the [network] of the site file, got a network alone")
    try:
        scale = estimate_scale(_first_pictures(video))
    except VisionError as error:
        raise InputError(f"{path}: no camera is known: {error}") from error
    camera = GroundCamera.from_homography(image_plane(scale, width_px=video.width_px, height_px=video.height_px))
    warning = (
        f"{path.name}: no camera is known, so the image plane is taken for the ground, at {scale:.3f} m a pixel from "
        "the typical length of what moves; distances and speeds are rough"
    )
    area_m = watched_area(camera, None, None, (video.width_px, video.height_px))
    return VideoInput(path, VideoSensor(video, camera, None, area_m), (warning,))


def _first_pictures(video: VideoSource) -> list[NDArray[np.uint8]]:
    """Return the luma of a picture every half second, for up to ten seconds."""
    pictures: list[NDArray[np.uint8]] = []
    first_us: int | None = None
    due_us = 0
    for frame in video:
        first_us = frame.t_us if first_us is None else first_us
        since_us = frame.t_us - first_us
        if since_us > SCALE_SPAN_US:
            break
        if since_us >= due_us:
            pictures.append(frame.luma.copy())
            due_us = since_us + SCALE_STEP_US
    return pictures


def content_digest(*paths: Path) -> str:
    """Digest the contents of files, 16 hexadecimal digits; the same bytes give the same digest anywhere.

    Raises
    ------
    InputError
        If one is a pipe, which has been read already.
    """
    digest = hashlib.blake2b(digest_size=DIGEST_BYTES)
    for path in paths:
        if is_read_once(path):
            raise InputError(f"{path}: expected a file that can be read twice, got a pipe")
        with path.open("rb") as file:
            while block := file.read(HASHED_BLOCK_BYTES):
                digest.update(block)
    return digest.hexdigest()
