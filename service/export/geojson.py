"""Where on Earth were roads, cars and events? GeoJSON (RFC 7946): longitude and latitude on WGS84.

That needs the origin of the run's local frame, which the log keeps where the site file says it. A map in metres that
looks like GeoJSON would be drawn in the Gulf of Guinea, so there is none; single events without a place on Earth are
told with a null geometry, as the standard has it.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any  # JSON

import msgspec
from msgspec.structs import asdict

from gis.frames import LocalFrame
from service.errors import ExportError
from service.export.json_items import Json, as_json, json_items
from service.questions.events.queries import decode_events
from service.questions.observations.car_tracks import CarColumns
from service.records.events import EventRecord
from service.records.runs import RunRecord, RunSite

_DECIMALS = 8  # a millimetre


def frame_of(run: RunRecord) -> LocalFrame | None:
    """Place the local frame of a run on Earth; None where nobody said where it is."""
    origin = run.site_file and run.site_file.origin_deg
    return LocalFrame(*origin) if origin else None


def known_frame_of(run: RunRecord) -> LocalFrame:
    """Place the local frame of a run on Earth.

    Raises
    ------
    ExportError
        If nobody said where it is.
    """
    frame = frame_of(run)
    if frame is None:
        expected = "expected a run whose site file said with [frame] where on Earth it is, for GeoJSON"
        raise ExportError(f"run {run.id!r}: {expected}, got one in local metres alone")
    return frame


def site_features(site: RunSite, frame: LocalFrame) -> bytes:
    """Write the lanes of a site as lines and its junctions as areas, as `gis.roads.geojson.read_geojson` reads them."""
    lanes, junctions = ([asdict(one) for one in part] for part in (site.lanes, site.junctions))
    lines = [_feature(frame, "LineString", one.pop("centre_line_m"), one) for one in lanes]
    areas = [_feature(frame, "Polygon", one.pop("outline_m"), one) for one in junctions]
    return msgspec.json.encode({"type": "FeatureCollection", "features": lines + areas})


def car_features(columns: CarColumns, frame: LocalFrame) -> bytes:
    """Write a line for each car, with the time of each of its points; a car that was seen once is a point."""
    rows: dict[str, list[int]] = {}
    for row, car in enumerate(columns.car):
        rows.setdefault(car, []).append(row)
    features = []
    for car, own in rows.items():
        points_m = [(columns.x_m[row], columns.y_m[row]) for row in own]
        told = {name: [getattr(columns, name)[row] for row in own] for name in ("t_us", "speed_mps", "linked")}
        properties = {"id": car, "car_class": columns.car_class[own[-1]], **told}
        features.append(_feature(frame, "LineString" if len(own) > 1 else "Point", points_m, properties))
    return msgspec.json.encode({"type": "FeatureCollection", "features": features})


def event_features(pages: Iterable[str], frames: Mapping[str, LocalFrame | None]) -> Iterator[str]:
    """Write each event, given as lines of JSON, as a point where it began; without a place on Earth it has no geometry.

    Parameters
    ----------
    frames : by run.
    """

    def feature(event: EventRecord) -> Json:
        points_m = [(event.place.x_m, event.place.y_m)] if event.place else []
        return _feature(frames.get(event.run), "Point", points_m, msgspec.to_builtins(event))

    yield '{"type":"FeatureCollection","features":['
    yield from json_items(as_json(feature(event)) for lines in pages for event in decode_events(lines))
    yield "\n]}\n"


def _feature(frame: LocalFrame | None, kind: str, points_m: Sequence[tuple[float, float]], properties: Json) -> Json:
    geometry = None
    if frame is not None and points_m:
        points: Any = frame.to_wgs84(points_m).round(_DECIMALS).tolist()  # Any: nested as the kind has it
        coordinates = {"Point": points[0], "LineString": points, "Polygon": [[*points, points[0]]]}[kind]
        geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "id": properties["id"], "geometry": geometry, "properties": properties}
