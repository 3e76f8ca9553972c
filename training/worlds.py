"""What are the networks shown? Pictures of synthetic worlds, and a box for each vehicle in them.

The worlds are those of `data_gen`, its traffic included. So that what is learnt holds elsewhere, cars stand in rows and
columns off the road too, in any direction, and the ground is recoloured and littered (`training.clutter`).
"""

import math
import multiprocessing
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np

from data_gen.drawing.cameras import CameraPath, camera_path
from data_gen.drawing.overlay import hidden_shares
from data_gen.drawing.render import GroundPicture, World
from data_gen.drawing.traffic.shown import ShownCounter
from data_gen.drawing.traffic.solid_painter import Meshes, SolidPainter
from data_gen.drawing.traffic.sprites import SpritePainter, looks_of, rows_near_image
from data_gen.drawing.traffic.vehicle_models import vehicle_parts
from data_gen.drawing.view import CameraView, at_height, views_of
from data_gen.outputs.scene import plan_world
from data_gen.scenario import VehicleClass, View
from data_gen.scenarios.catalogue import SCENARIOS, scenario_named
from data_gen.simulation.simulate import simulate
from data_gen.simulation.states import ByteArray, FloatArray, VehicleStates
from gis.cameras.camera_pose import CameraPose, CameraTrack
from gis.roads.road_network import RoadNetwork
from gis.roads.sumo_net import read_sumo_net
from training.clutter import littered, raise_poles

Generator = np.random.Generator
CLASSES: tuple[VehicleClass, ...] = ("car", "van", "truck", "bus", "motorcycle")
SIZE_PX = (1280, 720)
COLUMNS = 7
"""Of a box: x, y, length, width, angle of its axis, class, visible share; pixels and radians, y down."""

_OFF_ROAD_M = (
    (3.3, 5.3, 1.6, 2.05),
    (4.9, 7.0, 1.9, 2.2),
    (6.5, 16.5, 2.3, 2.6),
    (9.0, 13.0, 2.5, 2.6),
    (1.9, 2.4, 0.7, 0.9),
)
"""Shortest and longest, narrowest and widest of each class."""
_OFF_ROAD_SHARES = (0.55, 0.13, 0.13, 0.06, 0.13)
"""More of the rare classes than in traffic, which shows hardly a motorcycle in ten pictures."""
_FOCAL_WIDTHS = 1.2
PER_WORLD = 6
_STEP_US = 100_000
_BUSY = ("junction", "queue_passing", "urban_grid")
_LOW_SCENARIOS = [*("motorway",) * 4, *_BUSY * 2, "roundabout", "rural_overtaking"]
_CROWDED = ("motorway", "junction", "urban_grid", "roundabout")
_STEEP_SHARE = 0.3
"""Of the low cameras, that stand at a junction rather than on a mast along a road."""
_FARTHEST_M = 180.0
"""Vehicles off the road stand no farther from a low camera."""


def render(kind: str, seed: int, count: int, *, is_plain: bool = False) -> Iterator[tuple[ByteArray, FloatArray]]:
    """Render one world as cameras see it that look 40 to 90 degrees down ("above"), or 5 to 45 ("low").

    Parameters
    ----------
    kind : of camera.
    seed : fixes everything.
    count : of pictures; each has its own moment, clutter and ground colours.
    is_plain : without vehicles off the road, clutter and other colours: to score on.

    Yields
    ------
    A picture (h, w, 3), blue first, and its boxes (n, `COLUMNS`).
    """
    rng = np.random.default_rng(seed)
    name = str(rng.choice(sorted(SCENARIOS) if kind == "above" else _LOW_SCENARIOS))
    plan = scenario_named(name, {"demand": "high"} if name in _CROWDED and rng.random() < 0.7 else {})
    states = simulate(plan, seed=seed, rng=rng, duration_us=20_000_000, step_us=_STEP_US)
    network = read_sumo_net(plan.network_file)
    is_low = kind == "low"
    path = (_path_low if is_low else _path_above)(plan.view, network, states[0], rng)
    weather = str(rng.choice(["sunny", "sunny", "clouds", "overcast"]))
    hung = ("trees", "bridge", "gantry") if kind == "above" and rng.random() < 0.25 else ()
    world = plan_world(plan, network, path, rng, weather=weather, occluders=hung)
    world = replace(world, sun=replace(world.sun, shadow_slope=float(rng.uniform(0.15, 1.8))))
    seen = path.views[0]
    ground = GroundPicture(world, path, rng).seen(seen)
    for _ in range(count):
        moment = states[rng.integers(len(states))]
        moment = moment if is_plain else with_off_road(moment, seen, rng, count=int(rng.integers(4, 40)))
        yield (
            _picture(ground if is_plain else littered(ground, rng), world, moment, path, rng, is_low=is_low),
            (boxes_low if is_low else boxes_above)(moment, path, world),
        )


def _path_above(view: View, network: RoadNetwork, states: VehicleStates, rng: Generator) -> CameraPath:
    """Look down on a vehicle, and one time in three from straight above."""
    centre_m = states.centre_m[rng.integers(len(states.ids))] if states.ids else np.array(view.centre_m)
    width_m = float(np.exp(rng.uniform(math.log(110), math.log(320))))
    view = replace(view, centre_m=(float(centre_m[0]), float(centre_m[1])), width_m=width_m)
    straight = camera_path("vertical", view, SIZE_PX, t_us=np.zeros(1, np.int64), rng=rng)
    return straight if rng.random() < 0.3 else _leaning(straight, centre_m, width_m, rng, down_deg=(42.0, 89.9))


def _path_low(view: View, network: RoadNetwork, states: VehicleStates, rng: Generator) -> CameraPath:
    """Look along the road from a mast or a bridge, nearer or farther than the scenario has it.

    Now and then from beside it, and steeper, as cameras at junctions do.
    """
    is_steep = rng.random() < _STEEP_SHARE
    width_m = float(np.exp(rng.uniform(math.log(18), math.log(80))) if is_steep else rng.uniform(60, 250))
    is_aimed = len(states.ids) > 0 and (is_steep or rng.random() < 0.5)
    centre_m = states.centre_m[rng.integers(len(states.ids))] if is_aimed else np.array(view.centre_m)
    view = replace(view, centre_m=(float(centre_m[0]), float(centre_m[1])), width_m=width_m)
    if is_steep:
        straight = camera_path("vertical", view, SIZE_PX, t_us=np.zeros(1, np.int64), rng=rng)
        return _leaning(straight, centre_m, width_m, rng, down_deg=(15.0, 45.0))
    return camera_path("mast", view, SIZE_PX, t_us=np.zeros(1, np.int64), rng=rng, network=network)


def _leaning(
    straight: CameraPath, centre_m: FloatArray, width_m: float, rng: Generator, *, down_deg: tuple[float, float]
) -> CameraPath:
    """Look at the same place from anywhere around, so steeply down."""
    pitch_rad, yaw_rad = -math.radians(rng.uniform(*down_deg)), float(rng.uniform(-math.pi, math.pi))
    sight_m = width_m * _FOCAL_WIDTHS
    level_m = sight_m * math.cos(pitch_rad)
    foot_m = centre_m - level_m * np.array([math.cos(yaw_rad), math.sin(yaw_rad)])
    focal_px = SIZE_PX[0] * _FOCAL_WIDTHS
    pose = CameraPose(*foot_m.tolist(), -sight_m * math.sin(pitch_rad), yaw_rad, pitch_rad, 0.0, focal_px)
    [seen] = views_of([pose], SIZE_PX)
    outline_m = seen.camera.view_outline(*SIZE_PX)
    reach_m = (*outline_m.min(axis=0).tolist(), *outline_m.max(axis=0).tolist())
    track = CameraTrack(np.zeros(1, np.int64), (pose,))
    return replace(straight, kind="oblique", views=(seen,), track=track, reach_m=reach_m)


def _picture(
    ground: ByteArray, world: World, states: VehicleStates, path: CameraPath, rng: Generator, *, is_low: bool
) -> ByteArray:
    view = path.views[0]
    canvas = ground.copy()
    if path.track is None:
        SpritePainter(SIZE_PX, world.sun).draw(canvas, states, view)
    else:
        haze = world.haze if path.is_low else None
        SolidPainter(SIZE_PX, world.sun, detailed=True, haze=haze).draw(canvas, states, view)
    world.overlay.apply(canvas, view)
    if is_low:
        raise_poles(canvas, rng, count=int(rng.integers(0, 7)))
    return canvas


def boxes_above(states: VehicleStates, path: CameraPath, world: World) -> FloatArray:
    """Box the projections of vehicles along their own axes, height included.

    Parameters
    ----------
    states : n vehicles.
    path : of the camera, which stands still.
    world : with what may hide them.

    Returns
    -------
    (k, `COLUMNS`) of those whose centre is in the picture. From so steep none hides another one.
    """
    view = path.views[0]
    if view.pose is None:
        shapes_px = {row: _outline_px(states, row, view) for row in rows_near_image(states, view)}
    else:
        solids = Meshes(detailed=True).placed(states, view)
        shapes_px = {solid.row: solid.corners_px for solid in solids if solid.is_ahead}
    rows = [row for row in shapes_px if view.contains(states.centre_m[[row]])[0]]
    shares = np.ones(len(rows))
    if not world.overlay.is_empty:
        shares -= hidden_shares(states, np.array(rows, np.intp), view, world.overlay)
    boxes = np.zeros((len(rows), COLUMNS))
    for box, row, share in zip(boxes, rows, shares, strict=True):
        ahead = np.array([math.cos(states.heading_rad[row]), math.sin(states.heading_rad[row])])
        tail_px, nose_px = at_height(states.centre_m[row] + np.array([[-0.5], [0.5]]) * ahead, 0.0, view)
        angle_rad = math.atan2(*(nose_px - tail_px)[::-1])
        axes = np.array([[math.cos(angle_rad), math.sin(angle_rad)], [-math.sin(angle_rad), math.cos(angle_rad)]])
        along = shapes_px[row] @ axes.T
        low, high = along.min(axis=0), along.max(axis=0)
        box[:] = *((low + high) / 2 @ axes), *(high - low), angle_rad, CLASSES.index(states.classes[row]), share
    return boxes


def _outline_px(states: VehicleStates, row: int, view: CameraView) -> FloatArray:
    """Project the feet and tops of a vehicle seen from straight above, (n, 2)."""
    ahead = np.array([math.cos(states.heading_rad[row]), math.sin(states.heading_rad[row])])
    turn = np.array([ahead, (-ahead[1], ahead[0])])
    outlines_m = [outline_m for part in vehicle_parts(looks_of(states, row)) for outline_m in (part.base_m, part.top_m)]
    return at_height(np.vstack(outlines_m) @ turn + states.centre_m[row], 0.0, view)


def boxes_low(states: VehicleStates, path: CameraPath, world: World) -> FloatArray:
    """Box vehicles upright, whole as far as the picture reaches: as `boxes_above` has it."""
    shown = ShownCounter(path, world.overlay).look(states, path.views[0])
    low, high = shown.box_px[:, :2], shown.box_px[:, 2:]
    kinds = [CLASSES.index(states.classes[row]) for row in shown.rows]
    return np.column_stack([(low + high) / 2, high - low, np.zeros(len(kinds)), kinds, shown.share])


def with_off_road(states: VehicleStates, view: CameraView, rng: Generator, *, count: int) -> VehicleStates:
    """Add vehicles anywhere in the picture: alone, in a column, or side by side, where nobody is.

    Parameters
    ----------
    states : of the traffic.
    view : the camera.
    rng : source of every choice.
    count : of vehicles to try.

    Returns
    -------
    All of them.
    """
    while count > 0:
        in_row = int(rng.choice([1, 2, 5, 10]))
        count -= in_row
        place_m = view.camera.to_ground(rng.uniform((0, 0), SIZE_PX)[None])[0]
        if view.pose is not None and not _is_ahead(place_m, view.pose):
            continue  # over the horizon, or so far that it is not seen
        heading_rad, is_column = float(rng.uniform(-math.pi, math.pi)), rng.random() < 0.4
        aside_rad = heading_rad if is_column else heading_rad + math.pi / 2
        aside, gap_m = np.array([math.cos(aside_rad), math.sin(aside_rad)]), rng.uniform(0.35, 1.3 + is_column)
        for _ in range(in_row):
            number = int(rng.choice(len(_OFF_ROAD_M), p=_OFF_ROAD_SHARES))
            shortest, longest, narrowest, widest = _OFF_ROAD_M[number]
            length_m, width_m = float(rng.uniform(shortest, longest)), float(rng.uniform(narrowest, widest))
            step_m = ((length_m if is_column else width_m) + gap_m) / 2 * aside
            one = VehicleStates(
                t_us=states.t_us, ids=(f"off{len(states.ids)}",), classes=(CLASSES[number],), lanes=("",),
                centre_m=(place_m + step_m)[None], heading_rad=np.array([heading_rad + math.pi * rng.integers(2)]),
                speed_mps=np.zeros(1), length_m=np.array([length_m]), width_m=np.array([width_m]),
                appearance=rng.integers(2**31, size=1),
            )  # fmt: skip
            if rng.random() < 0.8 and _is_free(one, states):
                states = states.joined(one)
            place_m = place_m + 2 * step_m
    return states


def _is_ahead(place_m: FloatArray, pose: CameraPose) -> bool:
    away_m = place_m - pose.place_m[:2]
    along_m = away_m @ (math.cos(pose.yaw_rad), math.sin(pose.yaw_rad))
    is_level = pose.pitch_rad > -math.radians(30)
    return not is_level or bool(4.0 < along_m < _FARTHEST_M)


def _is_free(one: VehicleStates, others: VehicleStates) -> bool:
    apart_m = np.hypot(*(_discs(one)[:, None] - _discs(others)[None]).transpose(2, 0, 1))
    return bool((apart_m > 2.15).all())


def _discs(states: VehicleStates) -> FloatArray:
    """Give points along the middle lines of bodies, one a metre and a half, (n, 2)."""
    ahead = np.column_stack([np.cos(states.heading_rad), np.sin(states.heading_rad)])
    shares = np.linspace(-0.4, 0.4, 9)[:, None, None]
    return (states.centre_m + shares * states.length_m[:, None] * ahead).reshape(-1, 2)


def write_worlds(folder: Path, kind: str, seeds: range, *, is_plain: bool, workers: int) -> None:
    """Render worlds into a folder.

    Parameters
    ----------
    folder : gets `frames.npy` (n, h, w, 3) and `boxes.npz`, an array for each frame by its number.
    kind, is_plain : see `render`.
    seeds : of the worlds.
    workers : how many processes render; the pictures do not depend on it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    shape = (len(seeds) * PER_WORLD, SIZE_PX[1], SIZE_PX[0], 3)
    frames = np.lib.format.open_memmap(folder / "frames.npy", "w+", np.uint8, shape)
    boxes = {}
    # SUMO has one simulation a process, and a process that was forked from one with threads may hang.
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        worlds = pool.imap(partial(_rendered, kind, is_plain), seeds)
        for nth, (picture, found) in enumerate(chain.from_iterable(worlds)):
            frames[nth], boxes[str(nth)] = picture, found
    np.savez(folder / "boxes.npz", **boxes)  # last: a folder with it is complete


def _rendered(kind: str, is_plain: bool, seed: int) -> list[tuple[ByteArray, FloatArray]]:
    return list(render(kind, seed, PER_WORLD, is_plain=is_plain))
