"""What does a site file say about the place a video was taken: when, which roads, which camera?

A site file is TOML; docs/site_file.md lists its fields. Everything in it is checked here, once, and what comes out can
be trusted. Paths in the file are relative to the file's own folder.
"""

from __future__ import annotations

import difflib
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeGuard

import numpy as np

from gis.camera import GroundCamera
from gis.camera_pose import CameraTrack, read_camera_track
from gis.errors import GisError
from gis.frames import LocalFrame
from gis.geojson import read_geojson
from gis.lanes import Lane, edge_name
from gis.road_network import RoadNetwork
from gis.sumo_net import read_sumo_net
from service.errors import SiteError
from service.runs.inputs.detectors import DetectionDetails
from service.times import FIRST_UTC, LAST_UTC
from vision.errors import VisionError
from vision.networks.onnx_settings import class_words

# Which fields each table may have; the key "" is the file itself.
FIELDS: Mapping[str, tuple[str, ...]] = {
    "": ("name", "start_utc", "network", "frame", "camera", "detector"),
    "network": ("sumo", "geojson", "lane"),
    "network.lane": ("id", "road", "direction", "centre_line_m", "width_m", "speed_limit_mps"),
    "frame": ("origin_lat_deg", "origin_lon_deg"),
    "camera": ("homography", "point", "road_mask", "moving", "poses", "reach_m", "thermal"),
    "camera.point": ("pixel", "ground_m"),
    "camera.thermal": ("video", "homography"),
    "detector": ("use", "classes", "score_threshold", "rate_hz", "size_px"),
}

Point = tuple[float, float]


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
    """A place, as its site file describes it.

    Attributes
    ----------
    name : for people.
    start_utc : when the source's time line starts, in UTC; None if the file does not say.
    network : None if the file has no [network].
    camera : None if the file has no [camera], or gives a moving one by its poses alone.
    frame : where on Earth the local frame lies; None if the file has no [frame].
    road_mask : an image of the frame's size that is bright where road is; exists when the file is loaded.
    path : the site file.
    files : the site file and every file it names: all that the site depends on.
    motion : None if the camera stands still; `camera` is that of the first frame where it moves.
    thermal : a second picture of the same ground; None if the file has no [camera.thermal].
    detector : which detector is to look, and what it needs besides; None if the file has no [detector].
    """

    name: str
    start_utc: datetime | None
    network: RoadNetwork | None
    camera: GroundCamera | None
    frame: LocalFrame | None
    road_mask: Path | None
    path: Path
    files: tuple[Path, ...]
    motion: Motion | None = None
    thermal: Thermal | None = None
    detector: DetectionDetails | None = None


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
    site = _Table(_parse(path), path, "", "")
    name, start_utc = site.text("name"), site.time("start_utc") if site.has("start_utc") else None
    frame_table, network_table, camera_table = (site.table(part) for part in ("frame", "network", "camera"))
    frame = _read_frame(frame_table) if frame_table else None
    network = _read_network(network_table, frame) if network_table else None
    motion = _read_motion(camera_table) if camera_table else None
    camera = _read_camera(camera_table, motion) if camera_table else None
    road_mask = _read_road_mask(camera_table, motion) if camera_table else None
    thermal_table = camera_table.table("thermal") if camera_table else None
    thermal = _read_thermal(thermal_table) if thermal_table else None
    named = [network_table.file(form) for form in ("sumo", "geojson") if network_table and network_table.has(form)]
    named += [road_mask] if road_mask else []
    named += [camera_table.file("poses")] if camera_table and motion and motion.poses else []
    named += [thermal.video] if thermal else []
    detector_table = site.table("detector")
    detector = _read_detector(detector_table) if detector_table else None
    return Site(name, start_utc, network, camera, frame, road_mask, path, (path, *named), motion, thermal, detector)


def _parse(path: Path) -> Mapping[str, object]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise SiteError(f"{path}: expected a readable site file, got {error.strerror or error!s}") from error
    except ValueError as error:
        raise SiteError(f"{path}: expected TOML in UTF-8, got {error!s}") from error
    except RecursionError as error:
        raise SiteError(f"{path}: expected TOML with a few levels of nesting, got too many to read") from error


def _read_frame(table: _Table) -> LocalFrame:
    try:
        return LocalFrame(table.number("origin_lat_deg"), table.number("origin_lon_deg"))
    except GisError as error:
        raise table.wrong("", error) from error


def _read_network(table: _Table, frame: LocalFrame | None) -> RoadNetwork:
    form = table.only_one_of("sumo", "geojson", "lane")
    try:
        if form == "lane":
            return RoadNetwork(_read_lanes(table))
        if form == "sumo":
            return read_sumo_net(table.file("sumo"))
        if frame is None:
            raise table.wrong("geojson", "expected a [frame] table beside it, which places its degrees; got none")
        return read_geojson(table.file("geojson"), frame)
    except GisError as error:
        raise table.wrong(form, error) from error
    except RecursionError as error:
        raise table.wrong(form, "expected a file with a few levels of nesting, got too many to read") from error


def _read_lanes(table: _Table) -> Sequence[Lane]:
    lanes: list[Lane] = []
    lanes_of_edge: Counter[str] = Counter()
    for entry in table.tables("lane"):
        lane_id = entry.text("id")
        road = entry.text("road") if entry.has("road") else lane_id
        direction = entry.direction("direction") if entry.has("direction") else 1
        edge = edge_name(road, direction)
        line_m = np.array(entry.points("centre_line_m"))
        width_m, speed_mps = entry.number("width_m"), entry.number("speed_limit_mps")
        try:
            lanes.append(Lane(lane_id, edge, lanes_of_edge[edge], road, direction, line_m, width_m, speed_mps))
        except GisError as error:
            raise entry.wrong("", error) from error
        lanes_of_edge[edge] += 1
    return lanes


def _read_motion(table: _Table) -> Motion | None:
    if not table.has("moving") or not table.flag("moving"):
        for name in ("poses", "reach_m"):
            if table.has(name):
                raise table.wrong(name, f"expected moving = true beside {name}, got a camera that stands still")
        return None
    reach_m = table.number("reach_m") if table.has("reach_m") else None
    if reach_m is not None and reach_m < 0:
        raise table.wrong("reach_m", f"expected metres, not below 0, got {reach_m!r}")
    try:
        poses = read_camera_track(table.file("poses")) if table.has("poses") else None
    except GisError as error:
        raise table.wrong("poses", error) from error
    return Motion(poses, reach_m)


def _read_road_mask(table: _Table, motion: Motion | None) -> Path | None:
    if not table.has("road_mask"):
        return None
    if motion is not None:
        raise table.wrong("road_mask", "expected a camera that stands still beside it, got moving = true")
    return table.file("road_mask")


def _read_thermal(table: _Table) -> Thermal:
    try:
        return Thermal(table.file("video"), GroundCamera.from_homography(table.rows("homography")))
    except GisError as error:
        raise table.wrong("homography", error) from error


def _read_detector(table: _Table) -> DetectionDetails:
    rate_hz = table.number("rate_hz") if table.has("rate_hz") else None
    if rate_hz is not None and not 0.1 <= rate_hz <= 1000:
        raise table.wrong("rate_hz", f"expected frames a second from 0.1 to 1000, got {rate_hz!r}")
    size = table.point("size_px") if table.has("size_px") else None
    if size is not None and not all(side in range(2, 100_000) for side in size):
        raise table.wrong("size_px", f"expected width and height in whole pixels, at least 2, got {size!r}")
    score_threshold = table.number("score_threshold") if table.has("score_threshold") else 0.25
    return DetectionDetails(
        use=table.text("use") if table.has("use") else "",
        classes=table.classes("classes") if table.has("classes") else {},
        score_threshold=score_threshold,
        rate_hz=rate_hz,
        size_px=None if size is None else (int(size[0]), int(size[1])),
    )


def _read_camera(table: _Table, motion: Motion | None) -> GroundCamera | None:
    if motion is not None and motion.poses is not None and not (table.has("homography") or table.has("point")):
        return None
    if motion is not None and not (table.has("homography") or table.has("point")):
        raise table.wrong("", "expected homography, point or poses beside moving = true; got none of them")
    form = table.only_one_of("homography", "point")
    try:
        if form == "homography":
            return GroundCamera.from_homography(table.rows("homography"))
        points = table.tables("point")
        return GroundCamera.from_point_pairs(
            [entry.point("pixel") for entry in points], [entry.point("ground_m") for entry in points]
        )
    except GisError as error:
        raise table.wrong(form, error) from error


class _Table:
    """One table of a site file, with the words to say where an error is.

    `kind` is its place in FIELDS, `place` its place in the file: entry 2 of `camera.point` is `camera.point[2]`.
    """

    def __init__(self, values: Mapping[str, object], path: Path, kind: str, place: str) -> None:
        self._values, self._path, self._kind, self._place = values, path, kind, place
        for name in values:
            if name not in FIELDS[kind]:
                expected = ", ".join(FIELDS[kind])
                raise self.wrong(name, f"expected one of {expected}; got an unknown field{_hint(name, kind)}")

    def wrong(self, name: str, problem: object) -> SiteError:
        """Word the error in a field; the name "" means the table itself."""
        field = ".".join(part for part in (self._place, name) if part)
        return SiteError(f"{self._path}: {field}: {problem}")

    def has(self, name: str) -> bool:
        return name in self._values

    def only_one_of(self, *names: str) -> str:
        """Tell which of several fields is there, of which there must be exactly one."""
        given = [name for name in names if name in self._values]
        if len(given) == 1:
            return given[0]
        came = " and ".join(given) if given else "none of them"
        raise self.wrong("", f"expected exactly one of {', '.join(names)}; got {came}")

    def text(self, name: str) -> str:
        """Read a text that is not empty."""
        value = self._values.get(name)
        if isinstance(value, str) and value:
            return value
        raise self._unexpected(name, "a text that is not empty")

    def number(self, name: str) -> float:
        """Read a finite number."""
        value = self._values.get(name)
        if _is_number(value):
            return float(value)
        raise self._unexpected(name, "a number")

    def flag(self, name: str) -> bool:
        """Read true or false."""
        value = self._values.get(name)
        if isinstance(value, bool):
            return value
        raise self._unexpected(name, "true or false")

    def direction(self, name: str) -> int:
        """Read a direction of travel, 1 or -1."""
        value = self._values.get(name)
        if _is_number(value) and value in (1, -1):
            return int(value)
        raise self._unexpected(name, "1 or -1")

    def time(self, name: str) -> datetime:
        """Read a time with its zone, and turn it into UTC."""
        value = self._values.get(name)
        if isinstance(value, datetime) and value.tzinfo is not None:
            if not FIRST_UTC <= value <= LAST_UTC:
                expected = f"expected a time from {FIRST_UTC:%Y-%m-%d} to {LAST_UTC:%Y-%m-%d}"
                raise self.wrong(name, f"{expected}, got {value.isoformat()!r}")
            return value.astimezone(UTC)
        raise self._unexpected(name, "a date and time with its zone and no quotes, as 2026-05-01T08:00:00Z")

    def file(self, name: str) -> Path:
        """Read the path of a file that exists, relative to the site file's folder."""
        path = self._path.parent / self.text(name)
        if path.is_file():
            return path
        raise self.wrong(name, f"expected the path of a file, got {self._values[name]!r}, and there is no {path}")

    def classes(self, name: str) -> dict[int, str]:
        """Read a table of somebody's classes, number to our word."""
        try:
            return class_words(self._values.get(name))
        except VisionError as error:
            raise self.wrong("", error) from error

    def point(self, name: str) -> Point:
        """Read a point [x, y]."""
        value = self._values.get(name)
        if isinstance(value, list) and len(value) == 2 and all(map(_is_number, value)):
            return float(value[0]), float(value[1])
        raise self._unexpected(name, "a point [x, y] of two numbers")

    def points(self, name: str) -> list[list[float]]:
        return self._number_rows(name, 2, "points [[x, y], [x, y], ...]")

    def rows(self, name: str) -> list[list[float]]:
        """Read a 3 x 3 matrix by rows."""
        rows = self._number_rows(name, 3, "3 rows of 3 numbers")
        if len(rows) != 3:
            raise self._unexpected(name, "3 rows of 3 numbers")
        return rows

    def table(self, name: str) -> _Table | None:
        """Read a table; None if the file has none of that name."""
        value = self._values.get(name)
        if value is None:
            return None
        if not isinstance(value, dict):
            raise self._unexpected(name, f"a table [{name}]")
        kind = f"{self._kind}.{name}" if self._kind else name
        return _Table(value, self._path, kind, kind)

    def tables(self, name: str) -> list[_Table]:
        """Read a list of tables, `[[name]]` in the file."""
        value, kind = self._values.get(name), f"{self._kind}.{name}"
        if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
            raise self._unexpected(name, f"tables [[{kind}]]")
        return [_Table(entry, self._path, kind, f"{kind}[{place}]") for place, entry in enumerate(value, start=1)]

    def _number_rows(self, name: str, width: int, expected: str) -> list[list[float]]:
        value = self._values.get(name)
        if isinstance(value, list) and all(isinstance(row, list) and len(row) == width for row in value):
            numbers = [number for row in value for number in row if _is_number(number)]
            if value and len(numbers) == width * len(value):
                return [[float(number) for number in row] for row in value]
        raise self._unexpected(name, expected)

    def _unexpected(self, name: str, expected: str) -> SiteError:
        came = repr(self._values[name]) if name in self._values else "no such field"
        return self.wrong(name, f"expected {expected}, got {came}")


def _is_number(value: object) -> TypeGuard[float]:
    # A comparison, so that infinity, nan and integers too large for a float all fail.
    return isinstance(value, int | float) and not isinstance(value, bool) and -1e300 < value < 1e300


def _hint(name: str, kind: str) -> str:
    near = difflib.get_close_matches(name, FIELDS[kind], n=1)
    if near:
        return f"; did you mean {near[0]}?"
    homes = [f"in [{table}]" if table else "at the top of the file" for table in FIELDS if name in FIELDS[table]]
    return f"; {name} belongs {homes[0]}" if homes else ""
