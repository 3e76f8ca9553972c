"""How does a site file begin? With marks of a picture whose places are known, and lanes drawn in the picture.

Both are CSV files with a header; docs/calibration.md shows them. What is written is pixels as they were given, so that
loading the site fits the camera once more, the same way.
"""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gis.errors import GisError
from gis.frames import LocalFrame
from gis.polyline import FloatArray
from service.errors import SiteError
from service.texts.chronicle_files import read_text
from service.texts.csv_table import read_table

PIXELS = ("u_px", "v_px")
PLACES: Mapping[str, tuple[str, ...]] = {
    "metres": ("x_m", "y_m"),
    "grid": ("east_m", "north_m", "epsg"),
    "WGS84": ("lat", "lon"),
}
RANGES = {"lat": (-89.0, 89.0), "lon": (-180.0, 180.0)}
LANE_NUMBERS = {"width_m": 3.5, "speed_limit_mps": 13.9}  # of a town street, where nobody says more

_Row = tuple[str, dict[str, str]]  # its place, and what it says by column


@dataclass(frozen=True, slots=True)
class Marks:
    """Marks whose places are known in the picture and on the ground.

    Attributes
    ----------
    names : for people; their numbers where the file has no names.
    points : (n, 4) pixel x and y, local east and north metres.
    frame : where on Earth the local frame lies; None if the file does not say.
    """

    names: tuple[str, ...]
    points: FloatArray
    frame: LocalFrame | None


def read_marks(path: Path, size_px: tuple[int, int]) -> Marks:
    """Read a file of points.

    Parameters
    ----------
    path : CSV with `u_px,v_px`, one of `x_m,y_m`, `east_m,north_m,epsg` and `lat,lon`, and perhaps `name`.
    size_px : width and height of the picture.

    Raises
    ------
    SiteError
        If it cannot be read, its columns leave open what they mean, or a point is out of the picture or off the Earth.
    """
    header, rows = _read(path, "points")
    kinds = [kind for kind, names in PLACES.items() if set(names) & set(header)]
    forms = " or ".join(",".join((*PIXELS, *names)) for names in PLACES.values())
    if len(kinds) != 1 or not {*PIXELS, *PLACES[kinds[0]]} <= set(header):
        raise SiteError(f"{path}:1: expected the columns {forms}, and name if you like; got {','.join(header)!r}")
    (kind,) = kinds
    values = np.array([[_number(where, row, name) for name in (*PIXELS, *PLACES[kind])] for where, row in rows])
    if len(values) < 4:
        raise SiteError(f"{path}: expected at least 4 points, better 8, spread over the road; got {len(values)}")
    outside = ((values[:, :2] < -0.5) | (values[:, :2] > np.array(size_px) - 0.5)).any(axis=1)
    if outside.any():
        place = int(np.argmax(outside))
        expected = f"u_px and v_px inside the picture of {size_px[0]} x {size_px[1]} px"
        raise SiteError(f"{rows[place][0]}: expected {expected}, got {values[place, :2].tolist()!r}")
    ground_m, frame = _local(path, kind, values[:, 2:])
    names = tuple(row.get("name") or str(number) for number, (_, row) in enumerate(rows, start=1))
    return Marks(names, np.column_stack((values[:, :2], ground_m)), frame)


def site_text(name: str, marks: Marks, size_px: tuple[int, int], at_us: int = 0, lanes: Path | None = None) -> str:
    """Write a site file: its frame, its camera by the marks, and the lanes of a file of lines in pixels.

    Parameters
    ----------
    at_us : media time of the picture that the marks are of.
    lanes : CSV with `lane,u_px,v_px`, a row for each point in driving direction, and perhaps `road`, `direction`,
        `width_m` and `speed_limit_mps`, which the first row of a lane tells for all.

    Raises
    ------
    SiteError
        If the file of lanes cannot be read.
    """
    parts = [f"name = {json.dumps(name)}\n"]
    if marks.frame is not None:
        lat_deg, lon_deg = marks.frame.origin_lat_deg, marks.frame.origin_lon_deg
        parts.append(f"[frame]\norigin_lat_deg = {lat_deg!r}\norigin_lon_deg = {lon_deg!r}\n")
    measured = f"measured_at_s = {at_us / 1e6!r}\n" if at_us else ""
    parts.append(f"[camera]\nsize_px = {list(size_px)}\n{measured}")
    for mark, (u_px, v_px, x_m, y_m) in zip(marks.names, marks.points.tolist(), strict=True):
        told = f"# {json.dumps(mark)}\n[[camera.point]]\n"
        parts.append(f"{told}pixel = [{u_px:.12g}, {v_px:.12g}]\nground_m = [{x_m:.4f}, {y_m:.4f}]\n")
    return "\n".join([*parts, *(_lane_tables(lanes) if lanes else ())])


def _lane_tables(path: Path) -> Iterator[str]:
    header, rows = _read(path, "lanes")
    if not {"lane", *PIXELS} <= set(header):
        raise SiteError(f"{path}:1: expected the columns lane,{','.join(PIXELS)}, got {','.join(header)!r}")
    lines: dict[str, list[_Row]] = {}
    for one in rows:
        lines.setdefault(one[1]["lane"], []).append(one)
    for lane, points in lines.items():
        where, first = points[0]
        pixels = [[_number(at, row, name) for name in PIXELS] for at, row in points]
        yield f"[[network.lane]]\nid = {json.dumps(lane)}\n" + "".join(
            [
                f"road = {json.dumps(first['road'])}\n" if first.get("road") else "",
                f"direction = {int(_number(where, first, 'direction'))}\n" if first.get("direction") else "",
                f"centre_line_px = {pixels}\n",
                *(
                    f"{name} = {_number(where, first, name) if first.get(name) else usual}\n"
                    for name, usual in LANE_NUMBERS.items()
                ),
            ]
        )


def _read(path: Path, what: str) -> tuple[list[str], list[_Row]]:
    """Read the header of a CSV file, and its rows."""
    text = read_text(path, f"CSV file of {what}", SiteError)
    header, rows = read_table(str(path), text.splitlines())
    return header, [(where, dict(zip(header, fields, strict=True))) for where, fields in rows]


def _number(where: str, row: Mapping[str, str], name: str) -> float:
    low, high = RANGES.get(name, (-1e9, 1e9))
    try:
        value = float(row[name])
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        bounds = f"a number from {low:g} to {high:g}" if name in RANGES else "a number"
        swapped = "; are lat and lon swapped?" if name == "lat" and math.isfinite(value) else ""
        raise SiteError(f"{where}: {name}: expected {bounds}, got {row[name]!r}{swapped}")
    return value


def _local(path: Path, kind: str, places: FloatArray) -> tuple[FloatArray, LocalFrame | None]:
    """Convert places on Earth to metres about their middle."""
    if kind == "metres":
        return places, None
    lonlat_deg = places[:, ::-1] if kind == "WGS84" else _from_grid(path, places)
    origin = lonlat_deg.mean(axis=0).round(6).tolist()
    try:
        frame = LocalFrame(origin[1], origin[0])
        return frame.from_wgs84(lonlat_deg), frame
    except GisError as error:
        raise SiteError(f"{path}: {error}") from error


def _from_grid(path: Path, places: FloatArray) -> FloatArray:
    from pyproj import Transformer
    from pyproj.exceptions import CRSError

    codes = sorted({int(code) for code in places[:, 2]})
    if len(codes) != 1:
        raise SiteError(f"{path}: epsg: expected one code for all points, got {codes!r}")
    try:
        to_wgs84 = Transformer.from_crs(f"EPSG:{codes[0]}", "EPSG:4326", always_xy=True)
    except CRSError as error:
        raise SiteError(f"{path}: epsg: expected a code such as 32633 (UTM zone 33 north), got {codes[0]!r}") from error
    lonlat_deg = np.column_stack(to_wgs84.transform(places[:, 0], places[:, 1]))
    if not np.isfinite(lonlat_deg).all():
        raise SiteError(
            f"{path}: expected east_m and north_m on the grid EPSG:{codes[0]}, got {places[0, :2].tolist()!r}"
        )
    return lonlat_deg
