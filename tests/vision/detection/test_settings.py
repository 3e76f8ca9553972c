"""Every tuned number of detection matters: scenes made for it come out otherwise when it is halved or doubled."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from itertools import chain, zip_longest
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.turned import unnoticed, without_scene
from tests.vision.detection.test_split import SIDE, fill
from tests.vision.road.test_view import SIZE as LOW_SIZE
from tests.vision.road.test_view import bridge_view
from tests.vision.support import ROAD_LEVEL, draw_boxes, make_boxes, make_frame, top_view, whole_view
from vision.camera import FixedView, fixed_camera, fused_camera
from vision.detection.blobs import Cells, find_blobs, measure
from vision.detection.detector import Detections, Expected
from vision.detection.eye import FixedEye
from vision.detection.fusion import Channel, DetectionRate, fuse
from vision.detection.parting.lanes import LaneField, LaneStrip, borders_of
from vision.detection.parting.solids import cut_rows
from vision.detection.settings import DetectionSettings
from vision.detection.shadow import Sun, measure_shadows, without_shadow
from vision.detection.split import assign_cells
from vision.detection.surfaces.image_surface import ImageSurface
from vision.detection.surfaces.surface import Appearances
from vision.road.boxes import Boxes, distance_to_boxes
from vision.road.grid import Grid
from vision.road.rectify import RoadCells
from vision.road.view import GroundView
from vision.settings import VisionSettings
from vision.video.frame import Frame

SIZE = (200, 40)
FloatArray = NDArray[np.float64]
Outcome = Iterator[FloatArray]
FALSES = np.zeros(0, np.bool_)
NOTHING = Expected(Boxes.none(), Boxes.none, FALSES, Boxes.none(), FALSES, np.zeros(0))


def everywhere(points_m: FloatArray) -> NDArray[np.bool_]:
    """Tell that all is in view."""
    return np.ones(len(points_m), np.bool_)


def differs(once: list[FloatArray], again: Outcome) -> bool:
    """Compare outcomes to 1e-9, no farther than needed."""
    for one, other in zip_longest(once, again):
        if one is None or other is None or one.shape != other.shape:
            return True
        if not np.allclose(one.astype(np.float64), other, rtol=0.0, atol=1e-9, equal_nan=True):
            return True
    return False


def in_room(
    room: str, scenes: Mapping[Callable[[VisionSettings], Outcome], str]
) -> dict[Callable[[Any], Outcome], list[str]]:  # Any: the settings of any room
    """Let scenes of the whole of vision take the settings of one room; names come in a text."""

    def seen_by(scene: Callable[[VisionSettings], Outcome]) -> Callable[[Any], Outcome]:
        return lambda settings: scene(replace(VisionSettings(), **{room: settings}))

    return {seen_by(scene): names.split() for scene, names in scenes.items()}


def boxes_of(found: Detections) -> FloatArray:
    """All numbers of detections."""
    parts = [found.boxes.centre_m, found.boxes.heading_rad, found.boxes.length_m, found.boxes.width_m, found.noise]
    parts += [found.elongation, found.owner, found.divided, found.directed, found.cut, found.borders_m, found.weights()]
    return np.concatenate([np.asarray(part, np.float64).ravel() for part in parts])


def quick(settings: VisionSettings) -> VisionSettings:
    """Start within five frames, and look for shadows in every one."""
    return replace(settings, background=replace(settings.background, startup_us=160_000, period_us=0))


def random_boxes(rng: np.random.Generator, count: int, low: tuple[float, ...], high: tuple[float, ...]) -> Boxes:
    """Boxes anywhere between two rows of east, north, heading, length, width."""
    return make_boxes([tuple(row) for row in rng.uniform(low, high, (count, 5)).tolist()])


def expected(known: Boxes, rng: np.random.Generator, tentative: Boxes | None = None) -> Expected:
    """What a tracker would say."""
    thin = Boxes(known.centre_m, known.heading_rad, known.length_m - 0.4, known.width_m - 0.6)
    count = len(known)
    others = Boxes.none() if tentative is None else tentative
    return Expected(
        known, lambda: thin, rng.random(count) < 0.7, others, rng.random(count) < 0.5, np.zeros(len(others))
    )


def seen_from_above(settings: VisionSettings) -> Outcome:
    """Blobs of all sizes and contrasts, some known: what is noise, halo, a gap, one vehicle or two."""
    rng = np.random.default_rng(1)
    lane = [LaneStrip(np.array([[0.0, y], [90.0, y]]), 3.3) for y in (4.0, 7.3)]
    eye = FixedEye(top_view(SIZE), [whole_view(SIZE)], SIZE, quick(settings), lane)
    texture = ROAD_LEVEL + rng.normal(0, 3, SIZE[::-1])
    for k in range(14):
        low, high = (0.0, 2.0, -0.2, 0.7, 0.7), (94.0, 17.0, 0.2, 6.0, 2.4)
        boxes = random_boxes(rng, 12 if k > 5 else 0, low, high)
        luma = draw_boxes(SIZE, boxes, rng.uniform(50, 160, len(boxes)).tolist(), ground=texture)
        frame = make_frame(np.clip(luma + rng.normal(0, 1.2, luma.shape), 0, 255), index=k, t_us=40_000 * k)
        picture = eye.take(frame, None)
        if not eye.is_ready:
            eye.hold(picture)
            continue
        some = np.flatnonzero(rng.random(len(boxes)) < 0.6)
        near = boxes.select(some[::2]), boxes.select(some[1::2])
        yield boxes_of(eye.look(picture, expected(near[0], rng, near[1])).detections)


def divided(settings: VisionSettings) -> Outcome:
    """Blobs of several boxes, of which some are known."""
    rng = np.random.default_rng(2)
    for _ in range(30):
        cars = random_boxes(rng, 4, (-5.0, -3.0, -0.1, 2.0, 1.5), (5.0, 3.0, 0.1, 7.0, 3.0))
        blobs = [cars.select(np.array(rows)) for rows in ([0, 1], [2], [3])]
        known = cars.select(np.array([0, 2]))
        known = Boxes(known.centre_m + rng.normal(0, 0.4, (2, 2)), known.heading_rad, known.length_m, known.width_m)
        seen = Appearances(known, np.ones(2))
        bodies = partial(replace, known, width_m=known.width_m - 0.5)
        found = assign_cells(fill(*blobs), seen, bodies, rng.random(2) < 0.5, side=SIDE, settings=settings.detection)
        yield np.concatenate([found.owner, found.is_rest, found.is_divided]).astype(np.float64)


GRID = Grid.between(np.array([0.0, 0.0]), np.array([60.0, 12.0]), side=0.3, is_north_up=True)
ABOVE = [LaneStrip(np.array([[0.0, y], [60.0, y]]), 3.3) for y in (4.0, 7.3)]


def side_by_side(settings: VisionSettings) -> Outcome:
    """Blobs over two lanes, with parts of them in shadow."""
    rng = np.random.default_rng(3)
    field = LaneField(GRID, ABOVE, settings.detection)
    yield borders_of(ABOVE, GRID, settings.detection).astype(np.float64).ravel()
    for k in range(60):
        nowhere = np.zeros(GRID.shape, np.bool_)
        raster = RoadCells(GRID, road=~nowhere, view_edge=nowhere)
        most = 14.0 if k % 2 else 6.0
        boxes = random_boxes(rng, 4, (20.0, 2.5, -0.1, 1.5, 0.8), (26.0, 9.0, 0.1, most, 3.0))
        mask = GRID.paint(boxes.corners())
        cells = find_blobs(raster, mask, 100 * mask)
        how = rng.uniform((3, 30, 0), (8, 60, 12))

        def light(points: FloatArray, how: FloatArray = how) -> NDArray[np.uint8]:
            ripple = how[1] + how[2] * np.sin(9 * points[:, 0] + 5 * points[:, 1])
            return np.where(points[:, 1] > how[0], ripple, 0).astype(np.uint8)

        yield field.parts(cells, light).astype(np.float64)
        yield np.concatenate(field.headings(cells)).astype(np.float64)


def in_the_sun(settings: VisionSettings) -> Outcome:
    """Cars and trucks with shadows: measured, learned, taken off."""
    rng, limits = np.random.default_rng(4), settings.detection
    sun = Sun(limits)
    for k in range(700):
        heading_rad, is_long = rng.uniform(-3, 3, 1), k > 200 and k % 3 == 0
        borders_m = rng.normal([[0.7, 0.1, 1.2, 0.2]], 0.2 + 0.001 * k)
        length_m = rng.uniform(8, 14, 1) if is_long else rng.uniform(3, 9, 1)
        if k < 40 or k > 210:
            sun.learn(borders_m, heading_rad, length_m)
        if k % 5 == 0 or k < 30:
            seen_us = np.array([40_000 * (k % 11)])
            reach_m = sun.shadows(heading_rad, length_m, 2 * rng.random((1, 4)), seen_us)
            yield reach_m
            box = Boxes(np.zeros((1, 2)), heading_rad, length_m, rng.uniform(1.5, 3.5, 1))
            body = without_shadow(box, 3 * reach_m, limits)
            yield np.concatenate([body.length_m, body.width_m])
    for _ in range(40):
        east, north, length_m, width_m = rng.uniform((0.0, 0.0, 1.5, 0.8), (2.0, 2.0, 6.0, 2.5))
        cells = fill(make_boxes([(0, 0, 0.3, length_m, width_m), (east, north, 0.3, length_m, width_m)]))
        is_shadow = distance_to_boxes(cells.points, make_boxes([(0, 0, 0.3, length_m, width_m)]))[:, 0] > 0
        boxes = measure(cells, np.array([0.3]), SIDE, limits)[0]
        yield measure_shadows(cells, is_shadow, boxes, SIDE, limits)


LOW_VIEW = GroundView(bridge_view(), LOW_SIZE, VisionSettings())
LOW_ROAD = np.array([[-6.0, 5.0], [6, 5], [6, 400], [-6, 400]])
LOW_LANES = [LaneStrip(np.array([[x, 20.0], [x, 200.0]]), 3.6) for x in (-1.8, 1.8)]
ACROSS = [LaneStrip(np.array([[-20.0, y], [20.0, y]]), 7.0) for y in (48.0, 57.0)]


def seen_from_a_bridge(settings: VisionSettings) -> Outcome:
    """Blobs of several upright things: feet hidden and seen, steps, gaps, walkers."""
    rng = np.random.default_rng(6)
    surface = low_surface(settings)
    raster = surface.raster
    yield np.array([raster.grid.side, raster.road.sum(), raster.view_edge.sum()], np.float64)
    fields_ = [surface.lane_field(lanes) for lanes in (LOW_LANES, ACROSS, [])]
    for k in range(45):
        count = int(rng.integers(1, 4))
        boxes = random_boxes(rng, count, (-3.5, 18.0, 1.57, 1.0, 0.5), (3.5, 70.0, 1.57, 6.0, 2.4))
        masks = [raster.grid.paint([one]) for one in surface.appearances(boxes).boxes.corners()]
        mask = np.maximum.reduce(masks) & raster.road.view(np.uint8)
        cells = find_blobs(raster, mask, 99 * mask)
        if cells.count == 0:
            continue
        if k % 3 == 0:
            rows = cells.points[:, 1]
            cells = cells.regroup(2 * cells.group + (rows > np.quantile(rows, 0.6)))
        prints = surface.footprints(cells, np.full(cells.count, 1.57), None)
        yield np.concatenate([prints.boxes.centre_m.ravel(), prints.noise.ravel(), prints.cut])
        for field in fields_:
            part = field.parts(cells, lambda points: np.zeros(len(points), np.uint8), rng.random(cells.count) < 0.3)
            yield part.astype(np.float64)
            course = rng.uniform(0, 3.1, cells.count)
            yield field.walkers(cells, course, np.ones(cells.count, np.bool_)).astype(np.float64)
            yield field.headings(cells)[1].astype(np.float64)


def low_surface(settings: VisionSettings) -> ImageSurface:
    """The plane of the camera on the bridge."""
    return ImageSurface(LOW_VIEW, [LOW_ROAD], image_size_px=LOW_SIZE, settings=settings)


def shapes(surface: ImageSurface, rows: list[tuple[float, float, float, float]]) -> Cells:
    """Upright things at (east, north), so wide and high."""
    mask = np.zeros(surface.raster.grid.shape, np.uint8)
    for east, north, width_m, height_m in rows:
        (x, y), px = LOW_VIEW.to_pixels(np.array([[east, north]]))[0], 800 / north
        corners = np.array([[-width_m / 2, 0], [width_m / 2, 0], [width_m / 2, -height_m], [-width_m / 2, -height_m]])
        mask |= surface.raster.grid.paint([corners * px + np.array([x, y])])
    mask &= surface.raster.road.view(np.uint8)
    return find_blobs(surface.raster, mask, 99 * mask)


def lit(points: FloatArray) -> NDArray[np.uint8]:
    """No shadow anywhere."""
    return np.zeros(len(points), np.uint8)


def feet(settings: VisionSettings) -> Outcome:
    """Specks below cars, flat shadows beside them, vehicles that hide the feet of others, far ones in one lane."""
    surface = low_surface(settings)
    field = surface.lane_field(LOW_LANES)
    for width_m in (0.07, 0.11, 0.16, 0.22, 0.3, 0.4):
        cells = shapes(surface, [(1.8, 50.0, 1.8, 1.5), (1.8, 49.0, width_m, 0.3)])
        yield surface.footprints(cells, np.full(cells.count, 1.57), None).boxes.centre_m
    for size in (0.8, 0.85, 0.9, 0.95, 1.0):
        cells = shapes(surface, [(1.8, 50.0, size * 2.5, size * 5.5)])
        yield surface.footprints(cells, np.full(cells.count, 1.57), None).boxes.length_m
    for height_m in (0.3, 0.6, 0.8, 1.0, 1.4):
        yield field.parts(shapes(surface, [(1.8, 50.0, 1.8, 1.5), (-0.4, 50.0, 2.6, height_m)]), lit)
    for behind_m in (1.0, 2.0, 3.0, 4.0, 5.0):
        yield field.parts(shapes(surface, [(0.7, 50.0, 1.4, 1.5), (-0.7, 50.0 + behind_m, 1.4, 1.5)]), lit)
    for behind_m in (5.0, 8.0, 11.0, 14.0, 17.0, 22.0):
        yield field.parts(shapes(surface, [(0.9, 95.0, 1.8, 1.5), (2.5, 95.0 + behind_m, 1.8, 1.5)]), lit)
    for gap in range(1, 8):
        cells = shapes(surface, [(1.8, 50.0, 1.8, 1.5)])
        row = np.rint(surface.raster.grid.to_cells(cells.points)[:, 1]).astype(int)
        middle = int(np.median(row))
        cells = cells.regroup(np.where(row < middle, 0, np.where(row < middle + gap, -1, 1)))
        yield surface.footprints(cells, np.full(cells.count, 1.57), None).noise


def half_hidden(settings: VisionSettings) -> Outcome:
    """A known motorcycle, less and less of it in sight."""
    eye = FixedEye(bridge_view(), [LOW_ROAD], LOW_SIZE, quick(settings), [])
    known = expected(make_boxes([(2.0, 30.0, 1.57, 2.2, 0.8)]), np.random.default_rng(0))
    foot = LOW_VIEW.to_pixels(np.array([[2.0, 29.0]]))[0]
    for k in range(12):
        luma = np.full(LOW_SIZE[::-1], 100.0)
        if k > 5:
            x, y = np.rint(foot).astype(int)
            luma[y - 8 * (12 - k) : y, x - 13 : x + 13] = 180.0
        picture = eye.take(make_frame(luma, index=k, t_us=40_000 * k), None)
        if eye.is_ready:
            yield boxes_of(eye.look(picture, known).detections)
        else:
            eye.hold(picture)


def in_its_shadow(settings: VisionSettings) -> Outcome:
    """A van, and beside it what is more or less evenly dark."""
    field, nowhere = LaneField(GRID, ABOVE, settings.detection), np.zeros(GRID.shape, np.bool_)
    mask = GRID.paint(make_boxes([(20, 4, 0, 6, 2.0), (20, 6.5, 0, 6, 3.4)]).corners())
    van = find_blobs(RoadCells(GRID, road=~nowhere, view_edge=nowhere), mask, 100 * mask)
    for spread in (4, 7, 14, 18, 25):

        def light(points: FloatArray, spread: int = spread) -> NDArray[np.uint8]:
            ripple = 45 + spread * np.sign(np.sin(9 * points[:, 0]))
            return np.where(points[:, 1] > 5.0, ripple, 0).astype(np.uint8)

        yield field.parts(van, light)


def leaning(settings: VisionSettings) -> Outcome:
    """Rows of a lane seen slantwise: queues and trucks of all lengths, with seams, shadows and round corners."""
    rng = np.random.default_rng(3)
    for _ in range(60):
        seen_m = np.concatenate(
            [
                np.full(int(rows), wide_m)
                for rows, wide_m in zip(rng.integers(1, 30, 7), rng.choice([0.0, 0.9, 1.5, 2.1, 2.7], 7), strict=True)
            ]
        )
        width_m = np.where(rng.random(len(seen_m)) < 0.2, 0.3, seen_m)
        lean = float(rng.uniform(0.2, 1.5)), float(rng.uniform(0.0, 1.2))
        found = cut_rows(width_m, seen_m, lean, side=SIDE, settings=settings.detection)
        yield np.array([(start, end, kind.height_m) for start, end, kind in found])


def standing_from_the_start(settings: VisionSettings) -> Outcome:
    """What stands in the first frame and may be a pair."""
    for width_m in (4.0, 7.0):
        camera = fixed_camera(top_view(SIZE), [whole_view(SIZE)], SIZE, quick(settings))
        luma = draw_boxes(SIZE, make_boxes([(40.0, 9.0, 0.0, 6.0, width_m)]), [60.0])
        frames = [make_frame(luma, index=k, t_us=40_000 * k) for k in range(15)]
        for objects in chain(*map(camera.observe, frames), camera.finish()):
            yield objects.centre_m


def seen_twice(settings: VisionSettings) -> Outcome:
    """A car in colour and, a little beside, in warmth."""
    coarse = (100, 20)

    def video(size_px: tuple[int, int], scale_m: float, beside_m: float) -> list[Frame]:
        frames = []
        for k in range(16):
            boxes = make_boxes([(12.0 * (k / 25 - 0.2), 7.5 + beside_m, 0.0, 4.5, 1.8)])
            luma = draw_boxes(size_px, boxes, [180.0], top_view(size_px, scale_m))
            frames.append(make_frame(luma, index=k, t_us=40_000 * k))
        return frames

    camera = fused_camera(
        FixedView(top_view(SIZE), SIZE),
        FixedView(top_view(coarse, 0.94), coarse),
        video(coarse, 0.94, 0.6),
        [whole_view(SIZE)],
        quick(settings),
    )
    for frame in video(SIZE, 0.47, 0.0):
        for objects in camera.observe(frame):
            yield objects.centre_m


def fused(settings: VisionSettings) -> Outcome:
    """Two cameras over some vehicles."""
    rng, limits = np.random.default_rng(6), settings.detection
    rates = DetectionRate(limits), DetectionRate(limits)
    for k in range(60):
        sides = []
        for _ in range(2):
            boxes = random_boxes(rng, 3, (0.0, 0.0, -0.2, 1.0, 1.0), (9.0, 6.0, 0.2, 5.0, 2.0))
            sides.append(
                Detections(
                    boxes=boxes,
                    noise=np.broadcast_to(rng.uniform(0.1, 0.5) ** 2 * np.eye(2), (3, 2, 2)),
                    elongation=rng.uniform(1, 3, 3),
                    owner=np.full(3, -1),
                    divided=np.zeros(3, np.bool_),
                    directed=np.zeros(3, np.bool_),
                    cut=np.zeros(3, np.int8),
                    borders_m=np.full((3, 4), np.nan),
                )
            )
        for rate, share in zip(rates, (1.0, 0.4), strict=True):
            is_hit = (np.arange(40) < 3) & (rng.random() <= share)
            rate.learn(is_hit, np.arange(40) < (3 if k < 30 else 40))
            yield np.array([rate.value])
        one, other = (Channel(side, everywhere, rate.value) for side, rate in zip(sides, rates, strict=True))
        yield boxes_of(fuse(one, other, limits))


SCENES: dict[Callable[[VisionSettings], Outcome], str] = {
    seen_from_above: """
        close_cells strong_ratio min_area_m2 halo_share halo_most blur_cells position_noise_m lend_reach_m
        lane_elongation lane_share""",
    divided: "split_reach_m split_share fill_share join_slack_m rest_reach_m part_area_m2",
    side_by_side: """
        two_vehicles_m part_width_m shadow_share light_percent border_inside_m border_outside_m body_width_m
        solid_length_m window_m long_vehicle_m own_shadow_m own_reach_m""",
    in_its_shadow: "even_percent",
    leaning: """
        width_differs_m waist_cost waist_reach_m shade_cost nobody_cost cut_cost longest_m upright_lean""",
    standing_from_the_start: "pair_width_m",
    in_the_sun: """
        body_share body_length_m long_shadow_factor shadow_memory shadow_measurements own_us own_factor
        own_slack_m short_length_m short_width_m long_length_m long_width_m""",
    seen_from_a_bridge: """
        watched_height_m least_car_px image_car_cells foot_noise_cells hidden_foot_lengths covered_foot_lengths
        feet_width_m apart_width_m lengthwise_cos roof_m step_m step_width_m walker_width_m walker_cos gap_m""",
    feet: "kind_slack foot_width_m below_cells feet_height_m level_m gap_cells",
    half_hidden: "half_hidden_share",
    fused: "fusion_sigmas registration_m lone_trust piece_reach_m rate_memory rate_prior most_rate",
    seen_twice: "colour_bias_m thermal_bias_m",
}


def test_every_setting_has_a_scene() -> None:
    assert without_scene(DetectionSettings(), (names.split() for names in SCENES.values())) == []


@pytest.mark.slow
def test_every_setting_changes_what_is_found() -> None:
    assert unnoticed(DetectionSettings(), in_room("detection", SCENES), small=9, differs=differs) == []
