from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from tests.cases import seeds
from tests.vision.support import make_boxes, top_view
from vision.detection.detector import Detections, Expected
from vision.detection.parting.lanes import LaneStrip
from vision.networks.box_detector import CLASS_NAMES, GroundBoxes, ImageBoxes, Shifts
from vision.networks.detection_ground import farther, ground_detections, image_detections
from vision.networks.vehicle_fit import Ends
from vision.road.boxes import Boxes
from vision.road.view import GroundView
from vision.settings import VisionSettings

FloatArray = NDArray[np.float64]

SIZE_PX = (640, 360)
SETTINGS = VisionSettings()
FALSES = np.zeros(0, np.bool_)
NOTHING = Expected(Boxes.none(), Boxes.none, FALSES, Boxes.none(), FALSES, np.zeros(0))


def slanted(height_m: float = 40.0, pitch_rad: float = 0.6, focal_px: float = 700.0) -> FloatArray:
    """3 x 4 projection of a camera above (0, 0) that looks north and down."""
    sin, cos = np.sin(pitch_rad), np.cos(pitch_rad)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, -sin, -cos], [0.0, cos, -sin]])
    lens = np.array([[focal_px, 0, SIZE_PX[0] / 2], [0, focal_px, SIZE_PX[1] / 2], [0, 0, 1.0]])
    return lens @ np.column_stack([turn, -turn @ [0.0, 0.0, height_m]])


def projection_of(ground: FloatArray) -> FloatArray:
    """3 x 4 projection that sees height as no displacement: a camera straight above, far up."""
    return np.column_stack([ground[:, :2], np.zeros(3), ground[:, 2]])


def projected(projection: FloatArray, vehicles: Boxes, height_m: float) -> FloatArray:
    """The eight corners of each vehicle in the picture, (n, 8, 2)."""
    corners = vehicles.corners()
    solid = np.concatenate([np.dstack([corners, np.full((len(vehicles), 4, 1), up)]) for up in (0.0, height_m)], axis=1)
    homogeneous = np.concatenate([solid, np.ones((len(vehicles), 8, 1))], axis=2) @ projection.T
    return np.asarray(homogeneous[..., :2] / homogeneous[..., 2:])


def drawn(projection: FloatArray, vehicles: Boxes, *, height_m: float = 1.5, name: str = "car") -> ImageBoxes:
    """Upright boxes around vehicles, as an annotator draws them."""
    points = projected(projection, vehicles, height_m)
    low, high = points.min(axis=1), points.max(axis=1)
    count = len(vehicles)
    number = np.full(count, CLASS_NAMES.index(name))
    return ImageBoxes(
        (low + high) / 2, high - low, np.zeros(count), np.zeros(count, np.bool_), np.full(count, 0.9), number
    )


def view_of(projection: FloatArray) -> GroundView:
    return GroundView(projection[:, [0, 1, 3]], SIZE_PX, VisionSettings())


def detect(
    projection: FloatArray, boxes: ImageBoxes, expected: Expected = NOTHING, lanes: Sequence[LaneStrip] = ()
) -> Detections:
    view = view_of(projection)
    return image_detections(boxes, view, expected, image_size_px=SIZE_PX, settings=SETTINGS, lanes=lanes)


def known(vehicles: Boxes) -> Expected:
    is_driving = np.zeros(len(vehicles), np.bool_)
    return Expected(vehicles, lambda: vehicles, ~is_driving, Boxes.none(), is_driving, np.zeros(0))


@pytest.mark.parametrize("heading_rad", [0.0, np.pi / 2])
def test_upright_box_from_above_is_the_car(heading_rad: float) -> None:
    car = make_boxes([(60.0, 40.0, heading_rad, 4.6, 1.9)])
    found = detect(projection_of(top_view(SIZE_PX, 0.2)), drawn(projection_of(top_view(SIZE_PX, 0.2)), car))
    assert found.boxes.centre_m == pytest.approx(car.centre_m, abs=0.05)
    assert abs(np.cos(found.boxes.heading_rad[0] - heading_rad)) == pytest.approx(1.0)
    assert (found.boxes.length_m[0], found.boxes.width_m[0]) == pytest.approx((4.6, 1.9), abs=0.15)
    assert found.elongation[0] > 1.8
    assert not found.directed[0]


@pytest.mark.parametrize("along_m", [40.0, 55.0, 70.0])
@pytest.mark.parametrize("camera", [projection_of(top_view(SIZE_PX, 0.1)), slanted(), slanted(8.0, 0.2, 1000.0)])
def test_box_without_a_class_may_be_a_motorcycle(camera: FloatArray, along_m: float) -> None:
    at_m = view_of(camera).to_ground(np.array([[320.0, 180.0]]))[0][0] if camera[2, 2] == 0 else (1.0, along_m)
    motorcycle, car = (make_boxes([(*at_m, np.pi / 2, *size_m)]) for size_m in ((2.2, 0.8), (3.6, 1.6)))
    found = detect(camera, drawn(camera, motorcycle, height_m=1.4, name="unknown")).boxes
    named = detect(camera, drawn(camera, motorcycle, height_m=1.4, name="motorcycle")).boxes
    assert found.corners() == pytest.approx(named.corners())
    assert abs(np.sin(found.heading_rad[0])) > 0.98
    assert detect(camera, drawn(camera, car, name="unknown")).boxes.length_m[0] > 3.0


@pytest.mark.parametrize("heading_rad", [0.3, 0.8, 2.0, -2.6])
def test_track_lends_its_heading_to_the_box_it_lies_in(heading_rad: float) -> None:
    camera = projection_of(top_view(SIZE_PX, 0.2))
    car = make_boxes([(60.0, 40.0, heading_rad, 4.9, 1.9)])
    found = detect(camera, drawn(camera, car), known(car))
    assert found.boxes.heading_rad == pytest.approx([heading_rad])
    assert found.directed.all()
    assert found.boxes.centre_m == pytest.approx(car.centre_m, abs=0.05)
    assert found.boxes.length_m[0] == pytest.approx(4.9, abs=0.35)  # what is usual is 4.5


def lane_through(at_m: tuple[float, float], heading_rad: float) -> LaneStrip:
    reach_m = 30.0 * np.array([np.cos(heading_rad), np.sin(heading_rad)])
    return LaneStrip(np.array([at_m - reach_m, at_m + reach_m]), 3.5)


@pytest.mark.parametrize("heading_rad", [0.6, 1.0, -2.2, 2.4])
def test_vehicle_without_a_track_lies_along_its_lane(heading_rad: float) -> None:
    camera, at_m = slanted(8.0, 0.2, 1000.0), (2.0, 45.0)
    box = drawn(camera, make_boxes([(*at_m, heading_rad, 4.5, 1.8)]))
    alone, found = detect(camera, box), detect(camera, box, lanes=[lane_through(at_m, heading_rad)])
    assert found.boxes.heading_rad == pytest.approx([heading_rad])
    assert found.elongation[0] > 2.0
    assert not found.directed[0]  # which end is the front is a guess
    assert found.boxes.centre_m == pytest.approx(np.array([at_m]), abs=0.1)
    assert np.hypot(*(alone.boxes.centre_m[0] - at_m)) > np.hypot(*(found.boxes.centre_m[0] - at_m))


def test_lanes_tell_nothing_where_they_cross_nor_beside_them_nor_of_what_a_track_lends() -> None:
    camera, at_m = slanted(8.0, 0.2, 1000.0), (2.0, 45.0)
    car = make_boxes([(*at_m, 1.0, 4.5, 1.8)])
    box = drawn(camera, car)
    alone = detect(camera, box).boxes.heading_rad
    crossing = [lane_through(at_m, 1.0), lane_through(at_m, -0.4)]
    assert detect(camera, box, lanes=crossing).boxes.heading_rad == pytest.approx(alone)
    assert detect(camera, box, lanes=[lane_through((2.0, 55.0), 0.0)]).boxes.heading_rad == pytest.approx(alone)
    assert detect(camera, box, known(car), [lane_through(at_m, 0.7)]).boxes.heading_rad == pytest.approx([1.0])


def test_lane_tells_nothing_of_a_box_that_no_vehicle_along_it_explains() -> None:
    camera, at_m, heading_rad = slanted(8.0, 0.2, 1000.0), (2.0, 45.0), 1.0
    whole = drawn(camera, make_boxes([(*at_m, heading_rad, 4.5, 1.8)]))
    half = replace(whole, centre_px=whole.centre_px - whole.size_px * (0.25, 0), size_px=whole.size_px * (0.5, 1.0))
    alone = detect(camera, half)
    found = detect(camera, half, lanes=[lane_through(at_m, heading_rad)])
    assert found.boxes.corners() == pytest.approx(alone.boxes.corners())


def test_diagonal_box_without_a_track_has_no_clear_direction() -> None:
    camera = projection_of(top_view(SIZE_PX, 0.2))
    found = detect(camera, drawn(camera, make_boxes([(60.0, 40.0, np.pi / 4, 4.6, 1.9)])))
    assert found.elongation.tolist() == [1.0]
    assert found.boxes.centre_m == pytest.approx(np.array([[60.0, 40.0]]), abs=0.05)


@pytest.mark.parametrize("heading_rad", [0.0, 0.5, np.pi / 2, 2.4])
def test_slanted_view_finds_the_footprint_under_the_height(heading_rad: float) -> None:
    """The middle of the box lies metres behind the middle of the footprint."""
    camera = slanted()
    cars = make_boxes([(x, y, heading_rad, 4.5, 1.8) for x, y in ((-10.0, 50.0), (0.0, 60.0), (15.0, 75.0))])
    boxes = drawn(camera, cars)
    view = GroundView(camera[:, [0, 1, 3]], SIZE_PX, VisionSettings())
    naive_m = view.to_ground(boxes.centre_px)[0]
    found = detect(camera, boxes, known(cars))
    error_m = np.hypot(*(found.boxes.centre_m - cars.centre_m).T)
    assert error_m.max() < 0.35
    assert error_m.max() < 0.3 * np.hypot(*(naive_m - cars.centre_m).T).min()


@pytest.mark.parametrize("heading_rad", [np.pi / 2, 1.3, 0.0])
@pytest.mark.parametrize("distance_m", [30.0, 60.0, 120.0])
@pytest.mark.parametrize(
    ("name", "size_m"), [("car", (4.5, 1.8, 1.5)), ("truck", (10.0, 2.5, 3.3)), ("unknown", (10.0, 2.5, 3.3))]
)
def test_a_low_camera_sees_tall_vehicles_where_they_stand(
    name: str, size_m: tuple[float, float, float], distance_m: float, heading_rad: float
) -> None:
    """A roof may be seen half as high as the camera hangs, where height counts for much more than its part."""
    camera = slanted(height_m=6.0, pitch_rad=0.13, focal_px=1400.0)
    vehicle = make_boxes([(2.0, distance_m, heading_rad, *size_m[:2])])
    found = detect(camera, drawn(camera, vehicle, height_m=size_m[2], name=name), known(vehicle))
    assert found.directed.all()
    assert found.boxes.centre_m == pytest.approx(vehicle.centre_m, abs=0.02 * distance_m)


def test_noise_is_longer_along_the_line_of_sight() -> None:
    camera = slanted(height_m=15.0, pitch_rad=0.25)
    cars = make_boxes([(0.0, 50.0, 0.0, 4.5, 1.8)])
    found = detect(camera, drawn(camera, cars), known(cars))
    added = found.noise[0] - SETTINGS.detection.position_noise_m**2 * np.eye(2)
    assert added[1, 1] > 4 * added[0, 0]


@pytest.mark.parametrize("heading_rad", np.linspace(-3.0, 3.0, 7).tolist())
def test_oriented_box_gives_direction_and_size_without_a_track(heading_rad: float) -> None:
    metres_per_px = 0.2
    view = GroundView(top_view(SIZE_PX, metres_per_px), SIZE_PX, VisionSettings())
    car = make_boxes([(60.0, 40.0, heading_rad, 4.8, 1.8)])
    one = np.ones(1)
    box = ImageBoxes(
        view.to_pixels(car.centre_m),
        np.array([[4.8, 1.8]]) / metres_per_px,
        np.array([-heading_rad]),  # y is down in the picture
        one > 0,
        one,
        np.zeros(1, np.intp),
    )
    found = detect(projection_of(top_view(SIZE_PX, metres_per_px)), box)
    assert abs(np.cos(found.boxes.heading_rad[0] - heading_rad)) == pytest.approx(1.0)
    assert found.boxes.length_m[0] == pytest.approx(4.8, abs=0.15)
    assert found.elongation[0] > 1.8


def test_box_at_the_edge_says_which_end_is_cut() -> None:
    camera = projection_of(top_view(SIZE_PX, 0.2))
    car = make_boxes([(0.5, 40.0, np.pi, 4.6, 1.9)])  # drives west, out of the view
    boxes = drawn(camera, car)
    low, high = boxes.bounds_px()[:, :2].clip(-0.5), boxes.bounds_px()[:, 2:]
    cut = ImageBoxes((low + high) / 2, high - low, boxes.angle_rad, boxes.is_oriented, boxes.score, boxes.class_number)
    found = detect(camera, cut, known(car))
    assert found.cut.tolist() == [1]
    assert found.boxes.length_m[0] == pytest.approx(4.5, abs=0.2)  # what is usual, for nobody sees the rest
    assert found.boxes.centre_m == pytest.approx(car.centre_m, abs=0.2)


@pytest.mark.parametrize(
    ("x_m", "y_m"), [(-5.2, 20.0), (5.2, 20.0), (0.0, 9.5), (0.0, 72.0)], ids=["left", "right", "bottom", "top"]
)
def test_of_what_the_edge_cuts_the_end_that_is_seen_tells_the_place(x_m: float, y_m: float) -> None:
    camera = slanted(6.0, 0.226, 1200.0)
    car = make_boxes([(x_m, y_m, np.pi / 2, 4.5, 1.8)])
    whole = drawn(camera, car).bounds_px()
    bounds = np.clip(whole, -0.5, np.tile(SIZE_PX, 2) - 0.5)
    assert (bounds != whole).any()
    low, high = bounds[:, :2], bounds[:, 2:]
    box = ImageBoxes((low + high) / 2, high - low, np.zeros(1), np.zeros(1) > 0, np.ones(1), np.zeros(1, np.intp))
    found = detect(camera, box, known(car))
    assert found.cut[0] != 0
    off_m = found.boxes.centre_m[0] - car.centre_m[0]
    spread_m = np.sqrt(np.linalg.eigvalsh(found.noise[0])[1])
    assert np.hypot(*off_m) < 2 * spread_m
    assert spread_m < 1.5


@pytest.mark.parametrize("seed", range(20))
def test_seen_ends_are_those_of_the_body_cut_at_its_hidden_ends(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners_px, limits = rng.uniform(0, 100, (1, 8, 2)), np.sort(rng.uniform(20, 80, (1, 2, 2)))
    is_hidden = np.array([[rng.permutation([True, False]), [False, False]]])
    ends = Ends(np.eye(2)[None], limits, np.ones((1, 2)), is_hidden)
    low, high = np.where(is_hidden[0, 0], limits[0, 0], [-1e3, 1e3])
    body = shapely.convex_hull(shapely.MultiPoint(corners_px[0]))
    _, bottom, _, top = shapely.intersection(body, shapely.box(low, -1e3, high, 1e3)).bounds
    assert ends.seen_of(corners_px)[0, 1] == pytest.approx((bottom, top))
    assert ends.seen_of(corners_px)[0, 0] == pytest.approx((corners_px[..., 0].min(), corners_px[..., 0].max()))


def test_box_above_the_horizon_is_no_vehicle() -> None:
    camera = slanted(height_m=6.0, pitch_rad=0.05)
    sky = ImageBoxes(
        np.array([[320.0, 20.0]]), np.array([[20.0, 10.0]]), np.zeros(1), np.zeros(1) > 0, np.ones(1), np.zeros(1, int)
    )
    assert len(detect(camera, sky)) == 0


def test_weight_is_the_score() -> None:
    camera = projection_of(top_view(SIZE_PX, 0.2))
    assert detect(camera, drawn(camera, make_boxes([(60.0, 40.0, 0.0, 4.6, 1.9)]))).weights().tolist() == [0.9]


@pytest.mark.parametrize("ahead_m", [12.0, 16.0, 24.0])
@pytest.mark.parametrize("length_m", [8.0, 12.0, 14.0])
def test_a_long_vehicle_near_a_low_camera_is_found_where_it_stands(ahead_m: float, length_m: float) -> None:
    camera = slanted(height_m=4.5, pitch_rad=0.1, focal_px=610.0)
    truck = make_boxes([(-6.0, ahead_m + length_m / 2, np.pi / 2, length_m, 2.5)])
    found = detect(camera, drawn(camera, truck, height_m=3.3, name="truck"), known(truck))
    assert found.boxes.centre_m == pytest.approx(truck.centre_m, abs=1.5)


@pytest.mark.long
def test_boxes_that_no_vehicle_explains_do_not_end_a_run() -> None:
    camera, rng, count = slanted(height_m=4.4, pitch_rad=0.09, focal_px=610.0), np.random.default_rng(0), 400
    foot_px, size_px = rng.uniform((0, 200), (640, 359), (count, 2)), np.exp(rng.uniform(1, 6, (count, 2)))
    number, flat = rng.integers(0, len(CLASS_NAMES), count), np.zeros(count)
    boxes = ImageBoxes(foot_px - size_px * (0, 0.5), size_px, flat, flat > 0, np.ones(count), number)
    found = detect(camera, boxes)
    assert np.isfinite(found.boxes.centre_m).all()
    assert np.isfinite(found.noise).all()


@pytest.mark.long
@seeds(range(4), kept=1)
def test_wild_boxes_give_finite_rows(seeds: range) -> None:
    for seed in seeds:
        check_wild_boxes(np.random.default_rng(seed), count=150)


def check_wild_boxes(rng: np.random.Generator, *, count: int) -> None:
    wild = ImageBoxes(
        rng.uniform(-50, 700, (count, 2)),
        np.exp(rng.uniform(-4, 8, (count, 2))),
        rng.uniform(-4, 4, count),
        rng.random(count) < 0.5,
        rng.random(count),
        rng.integers(0, len(CLASS_NAMES), count),
    )
    found = detect(slanted(pitch_rad=rng.uniform(0.1, 1.5)), wild)
    numbers = np.column_stack(
        [found.boxes.centre_m, found.boxes.length_m, found.boxes.width_m, found.boxes.heading_rad]
    )
    assert np.isfinite(numbers).all()
    assert np.isfinite(found.noise).all()
    assert (np.linalg.eigvalsh(found.noise) > 0).all()


def test_boxes_in_metres_are_filled_in() -> None:
    nan = np.nan
    boxes = GroundBoxes(
        np.array([[10.0, 5.0], [50.0, 5.0], [90.0, 5.0]]),
        np.array([nan, 0.1, nan]),
        np.array([nan, 6.0, nan]),
        np.array([nan, 2.2, nan]),
        np.array([0.5, 1.0, 1.0]),
        np.array([CLASS_NAMES.index("bus")] * 3),
    )
    tracks = make_boxes([(10.5, 5.0, 2.0, 12.0, 2.5), (50.0, 5.0, 3.1, 6.0, 2.2)])
    found = ground_detections(boxes, known(tracks), SETTINGS)
    assert found.boxes.heading_rad == pytest.approx([2.0, 0.1 + np.pi, 0.0])  # lent; turned round; unknown
    assert found.boxes.length_m.tolist() == [12.0, 6.0, 12.0]
    assert found.directed.tolist() == [True, True, False]
    assert found.elongation[2] == 1.0


def test_shift_of_the_foot_is_the_velocity_on_the_ground() -> None:
    camera = slanted(8.0, 0.15, 1000.0)
    before, now = (drawn(camera, make_boxes([(2.0, y_m, np.pi / 2, 4.5, 1.8)])) for y_m in (40.0, 42.0))
    feet_px = [one.centre_px + [0.0, 0.5] * one.size_px for one in (before, now)]
    shifts = Shifts(feet_px[1] - feet_px[0], np.array([0.1]), np.array([0.08]))
    velocities = detect(camera, replace(now, shifts=shifts)).velocities
    assert velocities is not None
    assert velocities.mean_mps[0] == pytest.approx([0.0, 25.0], abs=0.5)
    sight, least_mps = view_of(camera).sight(np.array([[2.0, 39.75]])), SETTINGS.detection.position_noise_m
    across_mps, along_mps = (metres[0] * 0.1 / 0.08 for metres in (sight.across_m, sight.along_m))
    along_mps = np.hypot(along_mps, SETTINGS.networks.flow_share * 25.0)
    expected_mps = np.hypot([across_mps, along_mps], least_mps)
    assert np.sqrt(np.diag(velocities.noise[0])) == pytest.approx(expected_mps, rel=0.05)


def test_shift_of_a_vehicle_that_goes_on_below_the_picture_tells_nothing() -> None:
    camera = slanted(8.0, 0.15, 1000.0)
    vehicle = drawn(camera, make_boxes([(0.0, 26.0, np.pi / 2, 4.5, 1.8)]))
    cut = replace(vehicle, size_px=2 * (SIZE_PX[1] - vehicle.centre_px[:, 1:]) * [[0.5, 1.0]])
    shifts = Shifts(np.array([[1.0, 2.0]]), np.array([0.1]), np.array([0.08]))
    velocities = detect(camera, replace(cut, shifts=shifts)).velocities
    assert velocities is not None
    assert np.isnan(velocities.mean_mps).all()


def test_lorries_are_told_from_the_road_farther_away_than_cars() -> None:
    camera = slanted(8.0, 0.08, 1200.0)
    view = view_of(camera)
    ahead_m = np.arange(50.0, 400.0)
    scale_m = view.metres_per_pixel(np.column_stack([np.zeros(len(ahead_m)), ahead_m]))
    far_m = ahead_m[np.searchsorted(scale_m, 1.1 * SETTINGS.max_metres_per_pixel)]
    car, lorry = (make_boxes([(0.0, far_m, np.pi / 2, *size_m)]) for size_m in ((4.5, 1.8), (10.0, 2.5)))
    assert len(detect(camera, drawn(camera, car))) == 0
    assert len(detect(camera, drawn(camera, lorry, height_m=3.3, name="truck"))) == 1
    assert not view.sees(lorry.centre_m)[0]
    assert GroundView(camera[:, [0, 1, 3]], SIZE_PX, farther(SETTINGS)).sees(lorry.centre_m)[0]
