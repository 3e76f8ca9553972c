"""What if there is a video? It is seen by a camera that stands or moves, known from the site file or guessed."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

from gis.cameras.camera import GroundCamera
from gis.roads.road_network import RoadNetwork
from service.errors import InputError
from service.records.runs import InputKind
from service.runs.graph.pipeline import VIDEO, Feed
from service.runs.inputs.detectors import (
    AutoChoice,
    FileChoice,
    MotionChoice,
    OnnxChoice,
    check_against,
    describe,
)
from service.runs.inputs.input_kind import Asked, Input, camera_record
from service.runs.inputs.sensors.first_look import FirstLook, first_look
from service.runs.inputs.sensors.moving_camera import camera_at_start, first_camera, watched_area
from service.runs.inputs.sensors.video_sensor import USUAL_RATE_HZ, ThermalVideo, VideoSensor
from service.runs.inputs.sensors.vision_apart import VisionApart
from service.runs.inputs.sites.site import Motion, Site, check_picture
from service.runs.inputs.sites.site_review import review
from service.runs.inputs.trajectories import is_trajectories
from service.texts.toml_tables import told
from vision.camera import FixedView
from vision.networks.onnx.detector import OnnxDetector
from vision.networks.stored_detections import StoredDetections
from vision.registration.watch import noticed_px
from vision.road.scale import estimate_scale, image_plane
from vision.settings import VisionSettings
from vision.video.frames import VideoSource, open_video
from vision.video.pace import Pace

# No vehicle is faster than this many times the highest limit around: drivers speed, and clocks run fast.
MOST_SPEEDING = 2.0
# Whether a camera moves is looked at for as long as a start-up is held, and a little longer; what it does later is
# noticed by vision. A scale wants more traffic than that.
NOTICED_US = 6_000_000
SCALE_SPAN_US = 10_000_000
CAMERA_AND_ROADS = "with the camera and roads of its site"


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoInput(Input):
    """Read a video, and what is known of its camera and ground."""

    kind: ClassVar[InputKind] = "video"
    sensor: VideoSensor
    detector: str = "motion"

    @classmethod
    def fits(cls, asked: Asked) -> bool:
        """Take whatever is nothing else."""
        return True

    @classmethod
    def open(cls, asked: Asked) -> "VideoInput":
        """Open the video and load the detector."""
        path, choice = asked.path, asked.choice
        if asked.columns and not isinstance(choice, FileChoice):
            came = path.suffix or "no suffix"
            raise InputError(f"{path}: expected a .csv or .jsonl file to go with a column map, got {came!r}")
        if is_trajectories(path):
            raise InputError(f"{path}: expected a video for the detector {asked.detector!r}, got trajectories")
        if isinstance(choice, MotionChoice):
            return _at_rate(_with_channels(path, asked.site, choice), asked)
        source = _at_rate(_open_video(path, asked.site), asked)
        if isinstance(choice, AutoChoice):
            with told(InputError, path, CAMERA_AND_ROADS):
                is_low = source.sensor.is_low()
            return _with_detector(source, choice.low) if is_low else source
        return _with_detector(source, choice)

    def feed(self, *, apart: bool = False) -> Feed:
        """Give the frames, and the vision of this camera to look at them."""
        with told(InputError, self.path, CAMERA_AND_ROADS):
            vision = self.sensor.vision()  # made here in any case: what is wrong is told before anything is written
        if not apart:
            return Feed(VIDEO, self.sensor.frames(vision), vision, vision.notes)
        there = VisionApart(self.sensor, vision.settings)
        return Feed(VIDEO, there.frames(), there, there.notes)


def _with_channels(path: Path, site: Site, choice: MotionChoice) -> VideoInput:
    """Open what the built-in detector is to look at: the video, the thermal one beside it, or both."""
    if choice.channels == "colour":
        return replace(_open_video(path, site), detector=describe(choice))
    thermal = site.thermal
    if thermal is None:
        raise InputError(f"{path}: expected a [camera.thermal] in the site file for {describe(choice)}, got none")
    if choice.channels == "thermal":
        # Poses and masks are those of the colour camera.
        motion = None if site.motion is None else Motion(None, site.motion.reach_m)
        alone = replace(site, camera=thermal.camera, size_px=None, motion=motion, road_mask=None)
        source = _open_video(thermal.video, alone)
        return replace(source, sensor=replace(source.sensor, is_thermal=True), detector=describe(choice))
    source = _open_video(path, site)
    if source.sensor.motion is not None:
        warning = f"{path.name}: the camera moves, so the thermal video beside it is not looked at"
        return replace(source, detector=describe(MotionChoice()), warnings=(*source.warnings, warning))
    video = open_video(thermal.video)
    view = FixedView(thermal.camera.pixel_from_ground, (video.width_px, video.height_px), thermal.camera.lens)
    both = replace(source.sensor, thermal=ThermalVideo(video, view))
    return replace(source, sensor=both, detector=describe(choice))


def _open_video(path: Path, site: Site) -> VideoInput:
    network, settings = site.network, site.vision
    video = open_video(path)
    if network is not None:
        limits_mps = [MOST_SPEEDING * lane.speed_limit_mps for lane in network.lanes]
        fastest_mps = max([settings.tracking.max_speed_mps, *limits_mps])
        settings = replace(settings, tracking=replace(settings.tracking, max_speed_mps=fastest_mps))
    if site.camera is None and site.motion is None:
        return _without_camera(path, video, network, settings)
    size_px, motion, warnings = (video.width_px, video.height_px), site.motion, tuple[str, ...]()
    check_picture(site, path, size_px)
    with told(InputError, site.path, f"for {path.name}"):
        camera = first_camera(site.camera, motion, size_px)
        # Neither a mask nor a lens goes along with a camera that moves.
        is_bound = site.road_mask is not None or camera.lens is not None
        if motion is None and site.may_move:
            least_px = noticed_px(camera.pixel_from_ground, size_px, settings)
            look = first_look(open_video(path), settings, span_us=NOTICED_US, least_px=least_px)
            motion, warnings = _noticed_motion(path, look, measured_at_us=site.measured_at_us, is_bound=is_bound)
        if motion is not None and motion.poses is None and site.measured_at_us > 0:
            frames = open_video(path).frames()
            camera = camera_at_start(camera, frames, site.measured_at_us, size_px, settings.registration)
        area_m = watched_area(camera, network, site.road_mask, size_px, motion)
        # A camera of points is somebody's own; that of a homography comes from who knew it better.
        if site.points is not None and motion is None:
            doubts = review(site, camera, size_px).warnings()
            warnings = (*warnings, *(f"{site.path.name}: {one}" for one in doubts))
    may_move = site.may_move and not is_bound
    sensor = VideoSensor(video, camera, network, area_m, motion, may_move=may_move, settings=settings)
    return _video_input(path, sensor, *warnings)


def _at_rate(source: VideoInput, asked: Asked) -> VideoInput:
    """Look at as many frames as were asked for; say so where the video has fewer."""
    said_hz = asked.site.rate_hz if asked.rate_hz is None else asked.rate_hz
    rate_hz, video = said_hz or USUAL_RATE_HZ, source.sensor.video
    warnings = source.warnings
    if said_hz is not None and math.isfinite(said_hz) and said_hz > Pace.LENIENT * video.rate_hz > 0:
        few = f"{asked.path.name}: {said_hz:g} frames a second were asked for, and the video has {video.rate_hz:g}"
        warnings = (*warnings, f"{few}: all are looked at")
    count, every = video.frame_count, Pace(rate_hz, video.rate_hz).every
    return replace(
        source,
        sensor=replace(source.sensor, rate_hz=rate_hz),
        frame_count=None if count is None else math.ceil(count / every),
        warnings=warnings,
    )


def _noticed_motion(
    path: Path, look: FirstLook, *, measured_at_us: int, is_bound: bool
) -> tuple[Motion | None, tuple[str, ...]]:
    """Follow a camera that was seen to move, if it is not bound to stand; with what the user is told."""
    if look.moves_from_us is None:
        return None, ()
    seen = f"{path.name}: the camera moves, seen at {look.moves_from_us / 1e6:.2f} s"
    if is_bound:
        return None, (f"{seen}, but road masks and bent lenses are for one that stands: places will be wrong",)
    how = "it is followed by its pictures, as with moving = true in the site file"
    return Motion(None, None), (f"{seen}; {how}, whose camera is taken for that at {measured_at_us / 1e6:g} s",)


def _video_input(path: Path, sensor: VideoSensor, *warnings: str) -> VideoInput:
    return VideoInput(
        path=path,
        network=sensor.network,
        sensor=sensor,
        warnings=warnings,
        video=sensor.video,
        frame_count=sensor.video.frame_count,
        camera=camera_record(sensor.ground_camera, sensor.size_px),
    )


def _with_detector(source: VideoInput, choice: OnnxChoice | FileChoice) -> VideoInput:
    """Load the detector, so that nothing is written before it is known to work."""
    opened: OnnxDetector | StoredDetections
    if isinstance(choice, OnnxChoice):
        part_px = source.sensor.road_part_px()
        opened = choice.open(source.sensor.size_px, part_px, source.sensor.road_part_px)
        sensor, warnings = replace(source.sensor, knows=opened), opened.warnings
    else:
        opened = choice.open(source.sensor.settings)
        sensor = replace(source.sensor, boxes=opened)
        warnings = check_against(opened, choice.path, source.sensor.video.frame_count)
    return replace(
        source,
        sensor=sensor,
        detector=describe(choice, opened),
        detector_files=choice.files,
        warnings=(*source.warnings, *warnings),
    )


def _without_camera(
    path: Path, video: VideoSource, network: RoadNetwork | None, settings: VisionSettings
) -> VideoInput:
    """Lay the ground into the image plane, with a scale from what moves in the first seconds."""
    if network is not None:
        raise InputError(f"{path}: expected a [camera] beside the [network] of the site file, got a network alone")
    look = first_look(open_video(path), settings, span_us=SCALE_SPAN_US, least_px=settings.registration.moved_px)
    with told(InputError, path, "no camera is known"):
        scale = estimate_scale(look.pictures, settings)
    motion = None if look.moves_from_us is None else Motion(None, None)
    camera = GroundCamera.from_homography(image_plane(scale, width_px=video.width_px, height_px=video.height_px))
    warning = (
        f"{path.name}: no camera is known, so the image plane is taken for the ground, at {scale:.3f} m a pixel from "
        "the typical length of what moves; distances and speeds are rough"
    )
    if look.moves_from_us is not None:
        warning += f"; the camera moves, seen at {look.moves_from_us / 1e6:.2f} s, and is followed by its pictures"
    area_m = watched_area(camera, None, None, (video.width_px, video.height_px), motion)
    guessed_m2 = scale**2 * video.width_px * video.height_px
    sensor = VideoSensor(video, camera, None, area_m, motion, may_move=True, guessed_m2=guessed_m2, settings=settings)
    return _video_input(path, sensor, warning)
