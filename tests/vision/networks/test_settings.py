"""Every number that is assumed of boxes matters: scenes come out otherwise when it is halved or doubled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np
import pytest

from tests.turned import unnoticed, without_scene
from tests.vision.detection.test_settings import Outcome, boxes_of, differs, in_room
from tests.vision.networks.test_detection_ground import NOTHING, SIZE_PX, FloatArray, drawn, projection_of, slanted
from tests.vision.networks.test_knowing_eye import driving, watch_traffic, with_stranger
from tests.vision.support import make_boxes, make_frame, top_view
from vision.detection.detector import Detections
from vision.networks.box_detector import CLASS_NAMES, GroundBoxes, ImageBoxes
from vision.networks.detection_ground import image_detections
from vision.networks.optical_flow import BoxFlow
from vision.networks.settings import NetworkSettings, UsualSize
from vision.networks.stored_detections import StoredDetections, StoredInstant
from vision.road.view import GroundView
from vision.settings import VisionSettings

CAMERA, ABOVE = slanted(), projection_of(top_view(SIZE_PX, 0.2))


def detect(boxes: ImageBoxes, settings: VisionSettings, camera: FloatArray = CAMERA) -> Detections:
    """Put boxes of a camera on the ground."""
    view = GroundView(camera[:, [0, 1, 3]], SIZE_PX, settings)
    return image_detections(boxes, view, NOTHING, image_size_px=SIZE_PX, settings=settings)


def drawn_boxes(settings: VisionSettings) -> Outcome:
    """Vehicles of all sizes, as others draw them, along the view, across and between; some leave the picture."""
    rng = np.random.default_rng(1)
    for length_m in (0.2, 1.0, 2.0, 4.0, 6.0, 9.0):
        rows = rng.uniform((-25, 40, 0, length_m, 0.4 * length_m), (25, 90, 3.1, length_m, 0.5 * length_m), (30, 5))
        vehicles = make_boxes([tuple(row) for row in [*rows.tolist(), (0.0, 60.0, 0.0, length_m, 0.4 * length_m)]])
        yield boxes_of(detect(drawn(CAMERA, vehicles, height_m=0.3 * length_m), settings))


def nearly_square(settings: VisionSettings) -> Outcome:
    """Boxes seen from above whose direction is less and less clear."""
    for width_m in (1.8, 2.0, 2.2, 2.4, 2.6):
        vehicle = make_boxes([(60.0, 40.0, 0.0, 2.9, width_m)])
        yield boxes_of(detect(drawn(ABOVE, vehicle, name="unknown"), settings, ABOVE))


def near_the_edge(settings: VisionSettings) -> Outcome:
    """Boxes that end a few pixels before the edge of the picture."""
    for gap_px in range(6):
        size_px = np.array([[24.0, 24.0]])  # its edges are known better than `cut_px`
        centre_px = np.array([[gap_px + 11.5, 200.0]])
        flat = ImageBoxes(centre_px, size_px, np.zeros(1), np.zeros(1, np.bool_), np.ones(1), np.zeros(1, np.intp))
        yield boxes_of(detect(flat, settings))


def gap_in_a_file(settings: VisionSettings) -> Outcome:
    """Moments around a long gap."""
    keys = np.array([0, 40_000, 80_000, 60_000_000])
    nan, ones = np.full(4, np.nan), np.ones(4)
    boxes = GroundBoxes(np.zeros((4, 2)), nan, nan, nan, ones, np.zeros(4, np.intp))
    file = StoredDetections(keys, boxes, is_by_frame=False, settings=settings.networks)
    yield np.array([one.t_us for one in file.instants(None)], np.float64)


def single_moment(settings: VisionSettings) -> Outcome:
    """A file of one moment beside a video that begins a little later."""
    nan, one = np.full(1, np.nan), np.ones(1)
    for late_us in (15_000, 30_000):
        boxes = GroundBoxes(np.zeros((1, 2)), nan, nan, nan, one, np.zeros(1, np.intp))
        file = StoredDetections(np.array([0]), boxes, is_by_frame=False, settings=settings.networks)
        yield np.array([len(file.detect(StoredInstant(0, late_us)))])


def doubted_stranger(settings: VisionSettings) -> Outcome:
    """Drive past, with something beside it that the network denies; tell when it looks and what is shown."""
    for denied_from_s in (1.0, 1.5):
        results, lookout = watch_traffic(with_stranger(denied_from_s), driving, seconds=3.0, settings=settings)
        yield np.array(lookout.times_us, np.float64)
        yield np.array([len(one.ids) for one in results], np.float64)


def followed_box(settings: VisionSettings) -> Outcome:
    """Follow a box over frames that come fast, and put its speed on the ground."""
    texture = np.random.default_rng(4).integers(0, 256, SIZE_PX[::-1]).astype(np.float64)
    flow, last_us = BoxFlow(settings.networks), 240_000
    frames = [make_frame(np.roll(texture, k, axis=0), t_us=30_000 * k) for k in range(9)]
    for frame in frames[:-1]:
        flow.keep(frame, last_us)
    box = drawn(CAMERA, make_boxes([(0.0, 60.0, np.pi / 2, 4.5, 1.8)]))
    shifts = flow.shifts(frames[-1], box)
    assert shifts is not None
    yield shifts.over_s
    velocities = detect(replace(box, shifts=shifts), settings).velocities
    assert velocities is not None
    yield velocities.noise.ravel()


SCENES: dict[Callable[[VisionSettings], Outcome], str] = {
    drawn_boxes: "edge_noise_px edge_noise_share smallest_m",
    nearly_square: "explained_sigmas better_sigmas",
    near_the_edge: "cut_px",
    gap_in_a_file: "told_gap_us",
    single_moment: "usual_step_us",
    doubted_stranger: "looks_hz look_evidence",
    followed_box: "flow_us flow_noise_px flow_share",
}


def test_every_setting_has_a_scene() -> None:
    assert without_scene(NetworkSettings(), (names.split() for names in SCENES.values())) == []


@pytest.mark.slow
def test_every_setting_changes_what_is_made_of_boxes() -> None:
    assert unnoticed(NetworkSettings(), in_room("networks", SCENES), small=9, differs=differs) == []


@pytest.mark.long
def test_every_usual_size_changes_what_is_made_of_a_box_of_its_class() -> None:
    usual, vehicle = VisionSettings(), make_boxes([(3.0, 60.0, 0.9, 5.0, 2.0)])
    for word in CLASS_NAMES:
        box = drawn(CAMERA, vehicle, height_m=1.8, name=word)
        once = [boxes_of(detect(box, usual))]
        for field in fields(UsualSize):
            size = getattr(usual.networks.usual_sizes, word)
            size = replace(size, **{field.name: 2 * getattr(size, field.name)})
            sizes = replace(usual.networks.usual_sizes, **{word: size})
            settings = replace(usual, networks=replace(usual.networks, usual_sizes=sizes))
            assert differs(once, iter([boxes_of(detect(box, settings))])), (word, field.name)
