"""Which vehicles does a camera see, where, and how fast? Eyes and a motion, and one tracker behind them.

A fixed camera has one eye, a fused one two (colour and thermal), a moving one an eye and a motion that knows the map of
every frame; boxes of a network or a file are an eye without a background. All go through one loop: predict, detect,
update, judge, learn. What the tracker knows flows back: its predictions divide merged blobs, its objects keep the
backgrounds from learning them.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from vision.detection.eye import Eye, FixedEye, RoadEye, is_slanting
from vision.detection.fusion import Fusion
from vision.detection.parting.lanes import LaneStrip
from vision.detection.surfaces.surface import checked_polygons
from vision.networks.box_detector import BoxDetector, Instant
from vision.networks.box_eye import BoxEye
from vision.networks.knowing_eye import KnowingEye
from vision.networks.optical_flow import BoxFlow
from vision.objects import BoolArray, FloatArray, IntArray, VisionObjects
from vision.registration.mosaic import MosaicBackground
from vision.registration.moving_raster import MovingEye, MovingGroundSurface
from vision.registration.registration import CameraMotion, Registration
from vision.registration.watch import MovementWatch, noticed_px
from vision.road.boxes import Boxes
from vision.road.view import GroundView, Lens
from vision.settings import VisionSettings
from vision.tracking.tracker import Tracker
from vision.video.frame import Companion, Frame

InstantT = TypeVar("InstantT", bound=Instant)

UNLIKE = "expected the road that is known, got another picture over most of it"


@dataclass(frozen=True, slots=True)
class _Sight:
    """What is there of one instant: the pictures of the eyes, none at all where the view is lost, and its map."""

    t_us: int
    pictures: tuple[Any, ...]  # Any: each goes back to the eye that took it
    pixel_from_ground: FloatArray | None = None
    why_lost: str = ""


@dataclass(frozen=True, slots=True)
class Unannounced(Generic[InstantT]):
    """What is done should a camera move that is said to stand.

    Attributes
    ----------
    watch : notices it.
    follow : gives, for the map of the present picture, the eye and the motion to go on with.
    pixel_from_ground : (3, 3) as it was said.
    """

    watch: MovementWatch
    follow: Callable[[FloatArray], tuple[Eye[InstantT], CameraMotion[InstantT]]]
    pixel_from_ground: FloatArray


class Camera(Generic[InstantT]):
    """Instants in, tracked objects out: one result for each, in order, from nothing that comes later.

    Parameters
    ----------
    eyes : one, or two that are fused; the first one's start-up is the camera's.
    motion : knows the maps of a moving camera; None if it stands, or its boxes are on the ground already.
    settings : constants.
    unannounced : what to do should it move although `motion` is None; None to believe that it stands.

    Attributes
    ----------
    settings : the same.
    """

    def __init__(
        self,
        eyes: Sequence[Eye[InstantT]],
        motion: CameraMotion[InstantT] | None,
        settings: VisionSettings,
        unannounced: Unannounced[InstantT] | None = None,
    ) -> None:
        self._eyes = eyes
        self._motion = motion
        self._unannounced = unannounced
        self._moves_from_us: int | None = None
        self.settings = settings
        self._tracker = Tracker(settings, self._holds)
        self._fusion = Fusion(settings.detection)
        self._held: list[_Sight] = []
        self._judged_us: int | None = None

    def prepare(self, instant: InstantT) -> InstantT:
        """Do the part of `observe` that depends on nothing but the instant; any thread may.

        Parameters
        ----------
        instant : of the source, in whatever order.

        Returns
        -------
        The same for `observe`, with work done.

        Raises
        ------
        VisionError
            If a frame has another size than announced.
        """
        return self._eyes[0].prepare(instant)

    def observe(self, instant: InstantT) -> Iterable[VisionObjects]:
        """Take the next instant.

        Parameters
        ----------
        instant : later than the one before.

        Returns
        -------
        Nothing during start-up, then the objects of all that was held, then those of each instant. Those of what was
        held are found while they are taken: take them all before the next instant.

        Raises
        ------
        VisionError
            If a frame has another size than announced, or a detector fails.
        VideoBroken
            If the video of a second eye breaks.
        """
        sight = self._take(instant)
        if self._eyes[0].is_ready:
            return [self._follow(sight)]
        self._held.append(sight)
        for eye, picture in zip(self._eyes, sight.pictures, strict=True):
            if picture is not None:
                eye.hold(picture)
        return self.finish() if self._eyes[0].is_ready else []

    def finish(self) -> Iterable[VisionObjects]:
        """End the source, or the start-up.

        Returns
        -------
        The objects of what is still held. Without a map from start to end all of it is lost.
        """
        for eye in self._eyes:
            eye.start()
        held, self._held = self._held, []
        return map(self._follow, held)

    def notes(self) -> list[str]:
        """Say what people should know of what was seen so far."""
        notes = []
        if self._moves_from_us is not None:
            since = f"the camera moves, seen from {self._moves_from_us / 1e6:.2f} s on, though it was said to stand"
            notes.append(f"{since}; from there on it is followed by its pictures, as with moving = true")
        if self._tracker.cut_count:
            most = f"{self.settings.tracking.max_speed_mps:.0f} m/s"
            notes.append(
                f"{self._tracker.cut_count} times a track was cut because its vehicle would have been faster than "
                f"{most} (vision.tracking.max_speed_mps); are clock, scale and speed limits right?"
            )
        return notes

    def _go_along(self, moved: Unannounced[InstantT], t_us: int) -> None:
        """Go on as a camera that moves; what is held was seen by an eye that is no longer there."""
        matrix = moved.watch.present_from_first @ moved.pixel_from_ground
        eye, self._motion = moved.follow(matrix)
        self._eyes, self._unannounced, self._moves_from_us = [eye], None, t_us
        # Since it began to move, the edges of the road have been taken for vehicles.
        self._tracker.forget()
        self._held = [_Sight(one.t_us, (None,), why_lost="the camera began to move") for one in self._held]

    def _take(self, instant: InstantT) -> _Sight:
        if self._unannounced is not None and isinstance(instant, Frame) and self._unannounced.watch.look(instant):
            self._go_along(self._unannounced, instant.t_us)
        matrix = None
        if self._motion is not None:
            outlines_m = list(self._tracker.claims()[0].corners(self.settings.outline_margin_m))
            located = self._motion.locate(instant, outlines_m)
            if located is None:
                return _Sight(instant.t_us, (None,) * len(self._eyes), why_lost=self._motion.refusal)
            matrix = facing(located)
        return _Sight(instant.t_us, tuple(eye.take(instant, matrix) for eye in self._eyes), matrix)

    def _follow(self, sight: _Sight) -> VisionObjects:
        """Predict, detect, update, judge, learn."""
        expected = self._tracker.predict(sight.t_us)
        channels = [eye.look(picture, expected) for eye, picture in zip(self._eyes, sight.pictures, strict=True)]
        if all(channel.is_between for channel in channels):
            return self._mapped(self._tracker.between_looks(), sight)
        found = channels[0].detections if len(channels) == 1 else self._fusion.join(*channels, known=expected.known)
        objects = self._tracker.update(found)
        if any(picture is not None for picture in sight.pictures):
            self._judge(sight.t_us)
            claims, is_real = self._tracker.claims()
            for eye in self._eyes:
                eye.learn(claims, is_real)
        if not any(channel.is_open for channel in channels):
            return VisionObjects.lost(sight.t_us, sight.why_lost or UNLIKE)
        return self._mapped(objects, sight)

    def _mapped(self, objects: VisionObjects, sight: _Sight) -> VisionObjects:
        """Tell the map too, where the camera moves."""
        return objects if self._motion is None else replace(objects, pixel_from_ground=sight.pixel_from_ground)

    def _judge(self, t_us: int) -> None:
        """Decide about tracks that stand: what any eye sees is a vehicle; else what is burned in is learned."""
        period_us = 0 if self._eyes[0].is_sure else self.settings.background.period_us
        if self._judged_us is not None and t_us - self._judged_us < period_us:
            return
        rows, boxes = self._suspects()
        self._judged_us = t_us
        if len(rows) == 0:
            return
        verdicts = np.array([self._verdicts(eye, boxes) for eye in self._eyes])
        is_seen = (verdicts > 0).any(axis=0)
        self._tracker.prove(rows[is_seen])
        for eye, verdict in zip(self._eyes, verdicts, strict=True):
            eye.heal(boxes.select(np.flatnonzero(verdict < 0)))
        is_ghost = ~is_seen & (verdicts < 0).any(axis=0)
        if is_ghost.any():
            self._tracker.drop(rows[is_ghost])

    def _suspects(self) -> tuple[IntArray, Boxes]:
        """List the tracks that may be ghosts."""
        if self._judged_us is not None:
            return self._tracker.standing(0 if self._eyes[0].is_sure else self.settings.tracking.standing_us)
        # What is there at the very first need not stand for a while, since a ghost comes only where something drove
        # off; but what may be two vehicles may part yet.
        rows, boxes = self._tracker.standing(0)
        limits = self.settings.detection
        is_one = (boxes.width_m < limits.pair_width_m) | (boxes.length_m > limits.long_vehicle_m)
        return rows[is_one], boxes.select(is_one)

    def _verdicts(self, eye: Eye[InstantT], boxes: Boxes) -> NDArray[np.int8]:
        """Let an eye judge; one of several has no say outside its view."""
        verdicts = eye.judge(boxes)
        return verdicts if len(self._eyes) == 1 else np.where(eye.holds(boxes.centre_m), verdicts, np.int8(0))

    def _holds(self, points_m: FloatArray) -> BoolArray:
        return reduce(np.logical_or, (eye.holds(points_m) for eye in self._eyes))


@dataclass(frozen=True, slots=True)
class FixedView:
    """Where one of two cameras looks.

    Attributes
    ----------
    pixel_from_ground : (3, 3) homography from ground metres (x east, y north) to pixels.
    image_size_px : (width, height) of its frames.
    lens : bends the picture of the homography; None for a straight one.
    """

    pixel_from_ground: FloatArray
    image_size_px: tuple[int, int]
    lens: Lens | None = None


def fixed_camera(
    pixel_from_ground: FloatArray,
    road_polygons_m: Sequence[FloatArray],
    image_size_px: tuple[int, int],
    settings: VisionSettings | None = None,
    *,
    lanes: Sequence[LaneStrip] = (),
    lens: Lens | None = None,
    reach_m: float | None = None,
    knows: BoxDetector[Frame] | None = None,
    knows_moving: BoxDetector[Frame] | None = None,
) -> Camera[Frame]:
    """Make a camera that stands still.

    Parameters
    ----------
    pixel_from_ground : (3, 3) homography from ground metres (x east, y north) to pixels.
    road_polygons_m : outlines of the road, (k, 2) each; what lies outside is not looked at.
    image_size_px : (width, height) of the frames.
    settings : constants; the defaults suit daylight traffic.
    lanes : of the road, if they are known; they help with vehicles that stand.
    lens : bends the picture of the homography; None for a straight one.
    reach_m : as of `moving_camera`, should it move all the same; None to believe that it does not.
    knows : a network that says what is a vehicle; None to believe all that moves.
    knows_moving : the same should the camera move, if `knows` looks at a part of the picture.

    Raises
    ------
    VisionError
        If no road is in view, or the geometry is unusable.
    """
    settings = settings or VisionSettings()
    polygons_m = checked_polygons(road_polygons_m)
    view = GroundView(pixel_from_ground, image_size_px, settings, lens)
    is_low = knows is not None and is_slanting(view, polygons_m, settings)
    looks = None
    if knows is not None:
        hz, flow = settings.networks.looks_hz, BoxFlow(settings.networks) if is_low else None
        looks = BoxEye(
            knows,
            polygons_m,
            image_size_px,
            settings,
            pixel_from_ground,
            lens=lens,
            looks_hz=hz,
            lanes=lanes,
            flow=flow,
        )
    road = partial(FixedEye, pixel_from_ground, polygons_m, image_size_px, settings, lanes, lens=lens)
    eye = _eye(road, looks, settings, is_low=is_low)
    if reach_m is None:
        return Camera([eye], None, settings)

    def follow(matrix: FloatArray) -> tuple[Eye[Frame], Registration]:
        known = knows_moving or knows
        moving = _moving_eye(matrix, polygons_m, image_size_px, reach_m=reach_m, settings=settings, knows=known)
        return moving, Registration(matrix, image_size_px, settings.registration)

    watch = MovementWatch(
        image_size_px, settings.registration, least_px=noticed_px(pixel_from_ground, image_size_px, settings)
    )
    return Camera([eye], None, settings, Unannounced(watch, follow, pixel_from_ground))


def fused_camera(
    colour: FixedView,
    thermal: FixedView,
    thermal_frames: Iterable[Frame],
    road_polygons_m: Sequence[FloatArray],
    settings: VisionSettings | None = None,
    *,
    lanes: Sequence[LaneStrip] = (),
) -> Camera[Frame]:
    """Make a colour and a thermal camera over one ground, which stand still and are looked at as one.

    Parameters
    ----------
    colour, thermal : where they look; frames observed are those of the colour camera.
    thermal_frames : of the thermal camera, on the time line of the colour one; frames may be missing.
    road_polygons_m, settings, lanes : as of `fixed_camera`.

    Raises
    ------
    VisionError
        If no road is in view of either camera, or the geometry is unusable.
    """
    settings = settings or VisionSettings()
    polygons_m = checked_polygons(road_polygons_m)
    bias_m = settings.detection.colour_bias_m
    eyes = [
        FixedEye(
            colour.pixel_from_ground,
            polygons_m,
            colour.image_size_px,
            settings,
            lanes,
            bias_m=bias_m,
            lens=colour.lens,
        ),
        FixedEye(
            thermal.pixel_from_ground,
            polygons_m,
            thermal.image_size_px,
            thermal_settings(settings),
            lanes,
            companion=Companion(thermal_frames),
            bias_m=settings.detection.thermal_bias_m,
            lens=thermal.lens,
        ),
    ]
    return Camera(eyes, None, settings)


def moving_camera(
    pixel_from_ground: FloatArray,
    road_polygons_m: Sequence[FloatArray],
    image_size_px: tuple[int, int],
    motion: CameraMotion[Frame],
    *,
    reach_m: float,
    settings: VisionSettings | None = None,
    knows: BoxDetector[Frame] | None = None,
) -> Camera[Frame]:
    """Make a camera that moves, as on a drone.

    Parameters
    ----------
    pixel_from_ground : (3, 3) homography of the first frame, from ground metres (x east, y north) to pixels.
    road_polygons_m, image_size_px, settings : as of `fixed_camera`.
    motion : knows the maps of all frames.
    reach_m : how far beyond the first view the camera may come to look; road farther away is not watched.
    knows : as of `fixed_camera`.

    Raises
    ------
    VisionError
        If no road is in reach, or the geometry is unusable.
    """
    settings = settings or VisionSettings()
    polygons_m = checked_polygons(road_polygons_m)
    eye = _moving_eye(pixel_from_ground, polygons_m, image_size_px, reach_m=reach_m, settings=settings, knows=knows)
    return Camera([eye], motion, settings)


def _moving_eye(
    pixel_from_ground: FloatArray,
    polygons_m: Sequence[FloatArray],
    image_size_px: tuple[int, int],
    *,
    reach_m: float,
    settings: VisionSettings,
    knows: BoxDetector[Frame] | None,
) -> Eye[Frame]:
    looks = None
    if knows is not None:
        looks = BoxEye(knows, polygons_m, image_size_px, settings, looks_hz=settings.networks.looks_hz)

    def road() -> MovingEye:
        surface = MovingGroundSurface(
            facing(pixel_from_ground), polygons_m, image_size_px=image_size_px, reach_m=reach_m, settings=settings
        )
        return MovingEye(surface, MosaicBackground(surface.raster, settings), settings)

    view = GroundView(pixel_from_ground, image_size_px, settings)
    is_low = knows is not None and is_slanting(view, polygons_m, settings)
    return _eye(road, looks, settings, is_low=is_low)


def _eye(
    road: Callable[[], RoadEye], looks: BoxEye[Frame] | None, settings: VisionSettings, *, is_low: bool
) -> Eye[Frame]:
    """See by motion; with a network by both on a map, and from low above the road by the network alone."""
    if looks is None:
        return road()
    return looks if is_low else KnowingEye(road(), looks, settings)


def box_camera(
    detector: BoxDetector[InstantT],
    road_polygons_m: Sequence[FloatArray],
    image_size_px: tuple[int, int],
    *,
    pixel_from_ground: FloatArray | None = None,
    motion: CameraMotion[InstantT] | None = None,
    settings: VisionSettings | None = None,
    lens: Lens | None = None,
    lanes: Sequence[LaneStrip] = (),
) -> Camera[InstantT]:
    """Make a camera of which boxes are known, by a network or a file.

    Parameters
    ----------
    detector : finds vehicles without knowing the road.
    road_polygons_m, image_size_px, settings : as of `fixed_camera`.
    pixel_from_ground : (3, 3) of a camera that stands.
    motion : knows the maps of one that moves; without either, boxes must be on the ground already.
    lens, lanes : of a camera that stands, as of `fixed_camera`.

    Raises
    ------
    VisionError
        If there is no road, or one is no polygon.
    """
    settings = settings or VisionSettings()
    polygons_m = checked_polygons(road_polygons_m)
    eye = BoxEye(detector, polygons_m, image_size_px, settings, pixel_from_ground, lens=lens, lanes=lanes)
    return Camera([eye], motion, settings)


def thermal_settings(settings: VisionSettings) -> VisionSettings:
    """Let coarser ground count than in colour.

    Examples
    --------
    >>> thermal_settings(VisionSettings()).max_metres_per_pixel
    1.5
    """
    coarse_m = max(settings.max_metres_per_pixel, settings.thermal_metres_per_pixel)
    return replace(settings, max_metres_per_pixel=coarse_m)


def facing(pixel_from_ground: FloatArray) -> FloatArray:
    """Choose the sign of a homography that makes depth positive in front of the camera.

    Parameters
    ----------
    pixel_from_ground : (3, 3), of a right-handed ground (x east, y north) seen from above.

    Returns
    -------
    The same map, with a negative determinant.

    Examples
    --------
    >>> float(facing(-np.diag([2.0, -2.0, 1.0]))[2, 2])
    1.0
    """
    matrix = np.asarray(pixel_from_ground, np.float64)
    return -matrix if np.linalg.det(matrix) > 0 else matrix
