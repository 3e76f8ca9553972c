"""What does a site file say about the place a video was taken: when, which roads, which camera?

A site file is TOML; docs/site_file.md lists its fields. Everything in it is checked here, once, and what comes out can
be trusted. Paths in the file are relative to the file's own folder.
"""

import math
from collections import Counter
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta, Struct

from anchoring.settings import AnchoringSettings
from chronicles.execution.limits import Limits
from gis.cameras.camera import GroundCamera
from gis.cameras.camera_pose import CameraTrack, read_camera_track
from gis.cameras.lens import Lens
from gis.errors import GisError
from gis.frames import LocalFrame
from gis.polyline import FloatArray
from gis.roads.geojson import read_geojson
from gis.roads.lanes import Lane, edge_name
from gis.roads.road_network import RoadNetwork
from gis.roads.sumo_net import read_sumo_net
from qsr.settings import RelationSettings
from service.errors import SiteError
from service.records.times import FIRST_UTC, LAST_UTC
from service.runs.inputs.detectors import USUAL_DETAILS, DetectionDetails
from service.texts.toml_tables import Number, Text, read_toml, told, wrong
from vision.settings import VisionSettings

Point = Annotated[tuple[Number, Number], Meta(description="a point [x, y] of two numbers")]
Line = Annotated[list[tuple[Number, Number]], Meta(min_length=1, description="points [[x, y], [x, y], ...]")]
_Row = tuple[Number, Number, Number]
Matrix = Annotated[tuple[_Row, _Row, _Row], Meta(description="3 rows of 3 numbers")]
Side = Annotated[int, Meta(ge=2)]
Size = Annotated[tuple[Side, Side], Meta(description="width and height of the picture, two whole numbers above 1")]
Metres = Annotated[float, Meta(ge=0, le=1e300, description="metres, not below 0")]
Seconds = Annotated[float, Meta(ge=0, le=1e9, description="seconds, not below 0")]
Rate = Annotated[
    Annotated[float, Meta(ge=0.1, le=1000)] | Literal["full"],
    Meta(description='frames a second from 0.1 to 1000, or "full"'),
]
# Lines drawn in the picture that end so near to its border are led on by so much: lanes must run out of it.
BORDER_PX, RUN_OUT_M = 12.0, 25.0
MOST_LATE_US = 10_000_000  # events of a live source would come later still
START = "a date and time with its zone and no quotes, as 2026-05-01T08:00:00Z"


class LaneTable(Struct, kw_only=True):
    """A lane written out."""

    id: Text
    road: Text | None = None
    direction: Annotated[Literal[1, -1], Meta(description="1 or -1")] = 1
    centre_line_m: Line | None = None
    centre_line_px: Line | None = None
    width_m: Number
    speed_limit_mps: Number


class NetworkTable(Struct):
    """The roads, in one of three forms."""

    sumo: Path | None = None
    geojson: Path | None = None
    lane: list[LaneTable] | None = None


class FrameTable(Struct):
    """Where on Earth the local frame lies."""

    origin_lat_deg: Number
    origin_lon_deg: Number


class PointTable(Struct):
    """A mark whose place is known in the picture and on the ground."""

    pixel: Point
    ground_m: Point


class ThermalTable(Struct):
    """A thermal video of the same ground."""

    video: Path
    homography: Matrix


class CameraTable(Struct):
    """How pixels and ground belong together."""

    homography: Matrix | None = None
    point: list[PointTable] | None = None
    size_px: Size | None = None
    radial: Number | None = None
    road_mask: Path | None = None
    moving: Annotated[bool | Literal["auto"], Meta(description='true, false or "auto"')] = "auto"
    rate_hz: Rate | None = None
    poses: Path | None = None
    reach_m: Metres | None = None
    measured_at_s: Seconds = 0.0
    thermal: ThermalTable | None = None


class SiteFile(Struct, kw_only=True):
    """The whole file."""

    name: Text
    start_utc: Annotated[datetime, Meta(tz=True, description=START)] | None = None
    network: NetworkTable | None = None
    frame: FrameTable | None = None
    camera: CameraTable | None = None
    detector: DetectionDetails = USUAL_DETAILS
    anchoring: AnchoringSettings = AnchoringSettings()
    relations: RelationSettings = RelationSettings()
    vision: VisionSettings = VisionSettings()
    chronicles: Limits = Limits()


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """How a camera moves, as far as the site file knows.

    Attributes
    ----------
    poses : where it was at which time; None if that must be found from the pictures.
    reach_m : how far beyond its first view it may come to look; None if the file does not say.
    """

    poses: CameraTrack | None
    reach_m: float | None


@dataclass(frozen=True, slots=True, eq=False)
class Thermal:
    """A thermal video of the same ground, taken at the same times.

    Attributes
    ----------
    video : the file; it exists when the site is loaded.
    camera : of the video; of its first frame where the camera moves.
    """

    video: Path
    camera: GroundCamera


@dataclass(frozen=True, slots=True, eq=False)
class Site:
    """A place, as its site file describes it; `NO_SITE` where there is none.

    Attributes
    ----------
    name : for people.
    start_utc : when the source's time line starts, in UTC; None if the file does not say.
    network : None if the file has no [network].
    camera : None if the file has no [camera], or gives a moving one by its poses alone.
    road_mask : an image of the frame's size that is bright where road is; exists when the file is loaded.
    path : the site file.
    files : the site file and every file it names: all that the site depends on; none without one.
    motion : None if the camera is said to stand, or nothing is said.
    may_move : whether nothing is said.
    thermal : a second picture of the same ground; None if the file has no [camera.thermal].
    detector : which detector is to look, and what it needs besides.
    anchoring, relations, vision : the numbers of these engines, with what the tables of these names change in them.
    size_px : of the picture that the camera was measured in; None if the file does not say.
    rate_hz : frames of a video to look at in a second, infinite for all; None if the file does not say.
    limits : what each chronicle may cost.
    frame : where on Earth it lies; None if the file does not say.
    points : (n, 4) pixel and ground of the marks that the camera was fitted to; None if it was not.
    measured_at_us : media time of the picture that `camera` is of, which matters where the camera moves.
    """

    name: str = ""
    start_utc: datetime | None = None
    network: RoadNetwork | None = None
    camera: GroundCamera | None = None
    road_mask: Path | None = None
    path: Path = Path()
    files: tuple[Path, ...] = ()
    motion: Motion | None = None
    may_move: bool = True
    thermal: Thermal | None = None
    detector: DetectionDetails = USUAL_DETAILS
    anchoring: AnchoringSettings = field(default_factory=AnchoringSettings)
    relations: RelationSettings = field(default_factory=RelationSettings)
    vision: VisionSettings = field(default_factory=VisionSettings)
    size_px: tuple[int, int] | None = None
    rate_hz: float | None = None
    limits: Limits = field(default_factory=Limits)
    frame: LocalFrame | None = None
    points: FloatArray | None = None
    measured_at_us: int = 0


NO_SITE = Site()


def load_site(path: str | Path) -> Site:
    """Read and check a site file.

    Parameters
    ----------
    path : a TOML file.

    Returns
    -------
    The site, with its network read and its camera fitted.

    Raises
    ------
    SiteError
        If the file is missing or no TOML, a field is missing, wrong or unknown, several forms of network or camera
        are given at once, or a file it names cannot be used. The message names the file and the field.
    """
    path = Path(path)
    said = read_toml(path, SiteFile, what="a readable site file")
    if said.start_utc is not None and not FIRST_UTC <= said.start_utc <= LAST_UTC:
        expected = f"expected a time from {FIRST_UTC:%Y-%m-%d} to {LAST_UTC:%Y-%m-%d}"
        raise wrong(path, "start_utc", f"{expected}, got {said.start_utc.isoformat()!r}")
    if said.relations.backdate_us > MOST_LATE_US:
        late_us = said.relations.backdate_us
        raise wrong(path, "relations.backdate_us", f"expected 0 to {MOST_LATE_US} (us), got {late_us!r}")
    roads, view = said.network or NetworkTable(), said.camera or CameraTable()
    thermal = view.thermal
    with told(SiteError, path, "frame"):
        frame = LocalFrame(said.frame.origin_lat_deg, said.frame.origin_lon_deg) if said.frame else None
    motion = _read_motion(view, path)
    camera = _read_camera(view, path) if said.camera else None
    network = _read_network(roads, frame, path, _PixelGround(camera, view.size_px)) if said.network else None
    files = (path, roads.sumo, roads.geojson, view.road_mask, view.poses, thermal.video if thermal else None)
    return Site(
        name=said.name,
        start_utc=said.start_utc.astimezone(UTC) if said.start_utc else None,
        network=network,
        camera=camera,
        road_mask=view.road_mask,
        path=path,
        files=tuple(file for file in files if file),
        motion=motion,
        may_move=view.moving == "auto",
        thermal=Thermal(thermal.video, _camera_of(thermal.homography, path, "camera.thermal")) if thermal else None,
        detector=said.detector,
        anchoring=said.anchoring,
        relations=said.relations,
        vision=said.vision,
        size_px=view.size_px,
        limits=said.chronicles,
        rate_hz=math.inf if view.rate_hz == "full" else view.rate_hz,
        frame=frame,
        points=np.array([(*one.pixel, *one.ground_m) for one in view.point]) if view.point else None,
        measured_at_us=round(view.measured_at_s * 1_000_000),
    )


def check_picture(site: Site, path: Path, size_px: tuple[int, int]) -> None:
    """Refuse pictures of another size than the site's camera was measured in.

    Raises
    ------
    SiteError
        If the site says its size, and it is another one.
    """
    if site.size_px is None or site.size_px == size_px:
        return
    wide, high = (one / other for one, other in zip(size_px, site.size_px, strict=True))
    fix = f"; all pixels of the site times {wide:.6g} would fit" if abs(wide - high) < 1e-3 else ""
    expected = f"expected {path.name} to be {site.size_px[0]} x {site.size_px[1]} px as the site's picture"
    raise wrong(site.path, "camera.size_px", f"{expected}, got {size_px[0]} x {size_px[1]} px{fix}")


def _only_form(table: Struct, names: tuple[str, ...], path: Path, place: str) -> str:
    """Tell which of several fields is there, of which there must be exactly one."""
    given = [name for name in names if getattr(table, name) is not None]
    if len(given) == 1:
        return given[0]
    came = " and ".join(given) if given else "none of them"
    raise wrong(path, place, f"expected exactly one of {', '.join(names)}; got {came}")


def _read_network(table: NetworkTable, frame: LocalFrame | None, path: Path, picture: "_PixelGround") -> RoadNetwork:
    form = f"network.{_only_form(table, ('sumo', 'geojson', 'lane'), path, 'network')}"
    try:
        with told(SiteError, path, form):
            if table.lane is not None:
                return RoadNetwork(_read_lanes(table.lane, path, picture))
            if table.sumo is not None:
                return read_sumo_net(table.sumo)
            if frame is None:
                raise wrong(path, form, "expected a [frame] table beside it, which places its degrees; got none")
            assert table.geojson is not None
            return read_geojson(table.geojson, frame)
    except RecursionError as error:
        raise wrong(path, form, "expected a file with a few levels of nesting, got too many to read") from error


def _read_lanes(tables: list[LaneTable], path: Path, picture: "_PixelGround") -> list[Lane]:
    lanes: list[Lane] = []
    lanes_of_edge: Counter[str] = Counter()
    for number, one in enumerate(tables, start=1):
        road = one.road if one.road is not None else one.id
        edge = edge_name(road, one.direction)
        form = _only_form(one, ("centre_line_m", "centre_line_px"), path, f"network.lane[{number}]")
        index = lanes_of_edge[edge]
        with told(SiteError, path, f"network.lane[{number}].{form}"):
            line_m = np.array(one.centre_line_m) if one.centre_line_px is None else picture.line_m(one.centre_line_px)
        with told(SiteError, path, f"network.lane[{number}]"):
            lanes.append(Lane(one.id, edge, index, road, one.direction, line_m, one.width_m, one.speed_limit_mps))
        lanes_of_edge[edge] += 1
    return lanes


@dataclass(frozen=True, slots=True)
class _PixelGround:
    """Where lines drawn in the picture lie on the ground."""

    camera: GroundCamera | None
    size_px: tuple[int, int] | None

    def line_m(self, line_px: list[tuple[float, float]]) -> FloatArray:
        """Put a line on the ground, with ends at the picture's border led out of it."""
        if self.camera is None or self.size_px is None:
            raise GisError("expected a [camera] that stands, with size_px, beside lines in pixels; got none")
        points_px = np.array(line_px)
        line_m = self.camera.to_ground(points_px)
        if not (has_ground := np.isfinite(line_m).all(axis=1)).all():
            raise GisError(f"expected pixels below the horizon, got {points_px[~has_ground][0].tolist()!r} above it")
        margin_px = np.minimum(points_px + 0.5, np.array(self.size_px) - 0.5 - points_px).min(axis=1)
        for end, inner in ((0, 1), (-1, -2)):
            if len(line_m) > 1 and margin_px[end] <= BORDER_PX:
                way_m = line_m[end] - line_m[inner]
                # A new point, not a longer piece: the line must stay what was drawn.
                beyond_m = line_m[end] + way_m * RUN_OUT_M / max(float(np.hypot(*way_m)), 1e-9)
                line_m = np.insert(line_m, 0 if end == 0 else len(line_m), beyond_m, axis=0)
        return line_m


def _read_motion(table: CameraTable, path: Path) -> Motion | None:
    if table.moving is not True:
        for name in ("poses", "reach_m"):
            if getattr(table, name) is not None:
                expected = f"expected moving = true beside {name}, got {table.moving!r}"
                raise wrong(path, f"camera.{name}", expected)
        return None
    if table.road_mask is not None:
        raise wrong(path, "camera.road_mask", "expected a camera that stands still beside it, got moving = true")
    with told(SiteError, path, "camera.poses"):
        return Motion(None if table.poses is None else read_camera_track(table.poses), table.reach_m)


def _read_camera(table: CameraTable, path: Path) -> GroundCamera | None:
    if table.radial is not None and (table.size_px is None or table.moving is True):
        came = "a camera that moves" if table.moving is True else "none"
        raise wrong(path, "camera.radial", f"expected size_px of a camera that stands beside it, got {came}")
    if table.moving is True and table.homography is None and table.point is None:
        if table.poses is not None:
            return None
        raise wrong(path, "camera", "expected homography, point or poses beside moving = true; got none of them")
    _only_form(table, ("homography", "point"), path, "camera")
    if table.homography is not None:
        return _camera_of(table.homography, path, "camera", table.size_px, table.radial)
    points = table.point or []
    with told(SiteError, path, "camera.point"):
        return GroundCamera.from_point_pairs(
            [one.pixel for one in points],
            [one.ground_m for one in points],
            size_px=table.size_px,
            radial=0.0 if table.moving is True else table.radial,
        )


def _camera_of(
    homography: Matrix, path: Path, place: str, size_px: tuple[int, int] | None = None, radial: float | None = None
) -> GroundCamera:
    with told(SiteError, path, f"{place}.radial"):
        lens = Lens(size_px, radial) if size_px and radial else None
    with told(SiteError, path, f"{place}.homography"):
        return GroundCamera.from_homography(homography, lens)
