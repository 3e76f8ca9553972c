"""What looks at a video? The vision that goes with its camera, its ground and its detector."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gis.camera import GroundCamera
from gis.road_network import RoadNetwork
from service.runs.inputs.moving_camera import StoredPoses, moving_vision
from service.runs.inputs.site import Motion
from vision.adapter import Vision
from vision.detection.lanes import LaneStrip
from vision.detection_camera import DetectionVision, Standing
from vision.fixed_camera import FixedCameraVision, VisionSettings
from vision.fused_camera import FixedView, FusedCameraVision, thermal_settings
from vision.networks.box_detector import BoxDetector
from vision.registration.registration import Registration
from vision.video.frames import Frame, VideoSource

FloatArray = NDArray[np.float64]


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
    boxes : finds vehicles without knowing the road; None for the built-in detector.
    thermal : a second video for the built-in detector to look at; None if there is none.
    is_thermal : whether the video itself is thermal, and therefore coarse.
    """

    video: VideoSource
    ground_camera: GroundCamera
    network: RoadNetwork | None
    area_m: tuple[FloatArray, ...]
    motion: Motion | None = None
    boxes: BoxDetector[Frame] | None = None
    thermal: ThermalVideo | None = None
    is_thermal: bool = False

    @property
    def size_px(self) -> tuple[int, int]:
        """Return width and height of the frames."""
        return self.video.width_px, self.video.height_px

    def vision(self) -> Vision[Frame]:
        """Make the vision of the camera.

        Raises
        ------
        VisionError, GisError
            If the roads, the view or the poses are unusable.
        """
        if self.boxes is not None:
            return self._vision_of_boxes(self.boxes)
        lanes = [LaneStrip(one.centre_line_m, one.width_m) for one in self.network.lanes] if self.network else []
        matrix = self.ground_camera.pixel_from_ground
        if self.thermal is not None:
            colour = FixedView(matrix, self.size_px)
            return FusedCameraVision(colour, self.thermal.view, self.thermal.video, self.area_m, lanes=lanes)
        if self.motion is None:
            settings = thermal_settings(VisionSettings()) if self.is_thermal else None
            return FixedCameraVision(matrix, self.area_m, self.size_px, settings, lanes=lanes)
        has_roads = self.network is not None
        return moving_vision(self.ground_camera, self.motion, self.area_m, self.size_px, has_roads=has_roads)

    def _vision_of_boxes(self, boxes: BoxDetector[Frame]) -> DetectionVision[Frame]:
        matrix = self.ground_camera.pixel_from_ground
        if self.motion is None:
            return DetectionVision(boxes, Standing(matrix), self.area_m, self.size_px)
        poses = self.motion.poses
        follow = Registration(matrix, self.size_px) if poses is None else StoredPoses(poses, self.size_px)
        return DetectionVision(boxes, follow, self.area_m, self.size_px, is_moving=True)

    def frames(self, vision: Vision[Frame]) -> Iterator[Frame]:
        """Read the frames, as this vision likes them best.

        Raises
        ------
        VideoBroken
            Where the video cannot be read on.
        """
        return self.video.frames(vision.prepare if isinstance(vision, FixedCameraVision) else None)
