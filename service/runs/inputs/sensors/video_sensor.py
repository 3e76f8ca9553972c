"""What looks at a video? The vision that goes with its camera, its ground and its detector."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from gis.cameras.camera import GroundCamera
from gis.roads.road_network import RoadNetwork
from service.runs.inputs.sensors.guessed_ground import DoubtedVision
from service.runs.inputs.sensors.moving_camera import camera_motion, reach_m
from service.runs.inputs.sites.site import Motion
from vision.camera import Camera, FixedView, box_camera, fixed_camera, fused_camera, moving_camera, thermal_settings
from vision.detection.eye import is_slanting
from vision.detection.parting.lanes import LaneStrip
from vision.detection.surfaces.image_surface import road_part
from vision.networks.box_detector import BoxDetector
from vision.networks.onnx.detector import OnnxDetector
from vision.objects import FloatArray
from vision.road.view import GroundView
from vision.settings import VisionSettings
from vision.video.frames import Frame, VideoSource

USUAL_RATE_HZ = 12.5
"""Frames looked at in a second: twice as many cost nearly twice as much and see no more (docs/evaluation.md)."""


@dataclass(frozen=True, slots=True)
class ThermalVideo:
    """A thermal video, and where its camera looks."""

    video: VideoSource
    view: FixedView


@dataclass(frozen=True, slots=True)
class VideoSensor:
    """Hold a video, and what is known of its camera and of the ground that it sees.

    Attributes
    ----------
    ground_camera : of all frames; of the first one where the camera moves.
    area_m : rings (k, 2) of ground that vision looks at.
    motion : how the camera moves; None if it stands still.
    boxes : finds vehicles at every frame, without knowing the road; None for the built-in detector.
    knows : a network that tells the built-in detector what a vehicle is; None if there is none.
    thermal : a second video for the built-in detector to look at; None if there is none.
    may_move : whether it may move though `motion` is None; the built-in detector then notices.
    guessed_m2 : how much ground is in view, if that was only guessed; what cannot be vehicles then ends the run.
    is_thermal : whether the video itself is thermal, and therefore coarse.
    rate_hz : of the frames that are looked at; infinite for all.
    settings : of vision.
    """

    video: VideoSource
    ground_camera: GroundCamera
    network: RoadNetwork | None
    area_m: tuple[FloatArray, ...]
    motion: Motion | None = None
    boxes: BoxDetector[Frame] | None = None
    knows: OnnxDetector | None = None
    thermal: ThermalVideo | None = None
    may_move: bool = False
    guessed_m2: float | None = None
    is_thermal: bool = False
    rate_hz: float = USUAL_RATE_HZ
    settings: VisionSettings = field(default_factory=VisionSettings)

    @property
    def size_px(self) -> tuple[int, int]:
        """Return width and height of the frames."""
        return self.video.width_px, self.video.height_px

    def is_low(self) -> bool:
        """Tell whether the camera is known to look from low above the road.

        Raises
        ------
        VisionError
            If the view is unusable.
        """
        return self.guessed_m2 is None and is_slanting(self._view(), self.area_m, self.settings)

    def _view(self) -> GroundView:
        return GroundView(self.ground_camera.pixel_from_ground, self.size_px, self.settings, self.ground_camera.lens)

    def road_part_px(self, narrower_px: float = math.inf) -> tuple[int, int, int, int] | None:
        """Bound the part of the picture that shows the road, or that where cars are narrower than so many pixels.

        Returns
        -------
        Left, top, width, height; None for a camera that moves, and where there is no such part.

        Raises
        ------
        VisionError
            If the view is unusable.
        """
        if self.motion is not None:
            return None
        return road_part(self._view(), self.area_m, self.size_px, self.settings, narrower_px=narrower_px)

    def vision(self) -> Camera[Frame] | DoubtedVision:
        """Make the vision of the camera.

        Raises
        ------
        VisionError, GisError
            If the roads, the view or the poses are unusable.
        """
        camera = self._camera()
        if self.guessed_m2 is None or self.boxes is not None:
            return camera
        return DoubtedVision(camera, self.guessed_m2, Path(self.video.path).name)

    def _camera(self) -> Camera[Frame]:
        lens = self.ground_camera.lens
        matrix, motion, settings = self.ground_camera.pixel_from_ground, self.motion, self.settings
        follow = None
        if motion is not None:
            follow = camera_motion(self.ground_camera, motion, self.size_px, settings.registration)
        lanes = [LaneStrip(one.centre_line_m, one.width_m) for one in self.network.lanes] if self.network else []
        if self.boxes is not None:
            return box_camera(
                self.boxes,
                self.area_m,
                self.size_px,
                pixel_from_ground=matrix,
                motion=follow,
                settings=settings,
                lens=lens,
                lanes=lanes,
            )
        if self.thermal is not None:
            colour = FixedView(matrix, self.size_px, lens)
            return fused_camera(colour, self.thermal.view, self.thermal.video, self.area_m, settings, lanes=lanes)
        if motion is None or follow is None:
            settings = thermal_settings(settings) if self.is_thermal else settings
            around_m = self._reach_m(Motion(None, None)) if self.may_move else None
            return fixed_camera(
                matrix,
                self.area_m,
                self.size_px,
                settings,
                lanes=lanes,
                lens=lens,
                reach_m=around_m,
                knows=self.knows,
                knows_moving=self.knows.on_whole_picture() if self.knows is not None and self.may_move else None,
            )
        around_m = self._reach_m(motion)
        return moving_camera(
            matrix, self.area_m, self.size_px, follow, reach_m=around_m, settings=settings, knows=self.knows
        )

    def _reach_m(self, motion: Motion) -> float:
        return reach_m(self.ground_camera, motion, self.size_px, has_roads=self.network is not None)

    def frames(self, vision: Camera[Frame] | DoubtedVision) -> Iterator[Frame]:
        """Read the frames, prepared for this vision.

        Raises
        ------
        VideoBroken
            Where the video cannot be read on.
        """
        return self.video.frames(vision.prepare, rate_hz=self.rate_hz)
