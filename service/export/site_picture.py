"""How does a site's camera look in its picture? A metre grid, lanes, marks with their errors, horizon and reach."""

from dataclasses import dataclass

import cv2
import numpy as np
import shapely

from gis.cameras.camera import GroundCamera
from service.export.drawing import FAR_PX, FONT, LEAST_WIDTH_PX, WHITE, Colour, in_front, write_text
from service.runs.inputs.sites.site import Site
from service.runs.inputs.sites.site_review import HULL_MARGIN_M, Review, across_m, in_picture
from vision.objects import ByteArray, FloatArray

# Blue, green, red, with the words of the legend.
GRID, LANE, BEYOND = (225, 225, 225), (110, 235, 110), (80, 80, 255)
HULL, MARK, HORIZON, REACH = (255, 190, 70), (0, 235, 255), (255, 120, 230), (0, 150, 255)

DIMMED, GRID_WEIGHT = 0.75, 0.55
ERROR_SCALE = 10  # errors are drawn so many times as long
GRID_STEPS_M = (10, 1, 2, 5, 20, 50, 100, 200, 500)  # the first that gives a few lines and not too many
LABEL_PX, LINE_PX = 34, 24
FIELD_STEP_PX = 2


@dataclass(frozen=True, slots=True)
class _Canvas:
    """A picture to draw on in the site's pixels or metres, `factor` times as large as the camera's."""

    image: ByteArray
    camera: GroundCamera
    size_px: tuple[int, int]
    factor: int

    def line(self, points_m: FloatArray, colour: Colour, width: int = 1) -> None:
        """Draw a line on the ground."""
        along_m = shapely.get_coordinates(shapely.segmentize(shapely.LineString(points_m), 1.0))
        self.line_px(self.camera.to_pixels(along_m), colour, width)

    def line_px(self, points_px: FloatArray, colour: Colour, width: int = 1) -> None:
        """Draw a line of pixels; it is broken where they are nan."""
        near = np.asarray((np.abs(points_px) < FAR_PX / self.factor).all(axis=1))
        for piece in in_front(np.where(near[:, None], self.place(points_px), np.nan)):
            cv2.polylines(self.image, [piece], isClosed=False, color=colour, thickness=width, lineType=cv2.LINE_AA)

    def place(self, points_px: FloatArray) -> FloatArray:
        """Map pixels of the camera to those of the canvas."""
        return (points_px + 0.5) * self.factor - 0.5

    def write(self, text: str, at_px: FloatArray, colour: Colour, size: float = 0.45) -> None:
        """Write with a dark edge."""
        x_px, y_px = np.round(at_px).astype(int).tolist()
        write_text(self.image, text, (x_px, y_px), colour, size)


def draw_site(picture: ByteArray, site: Site, camera: GroundCamera, found: Review) -> ByteArray:
    """Draw what is known of a site's camera on a picture of it.

    Parameters
    ----------
    picture : (h, w, 3) blue, green, red.
    camera : of the site; of its first frame where it moves.
    found : what `review` says of it.

    Returns
    -------
    A picture of its own, enlarged by a whole number where it is small, with a legend below.
    """
    size_px = (picture.shape[1], picture.shape[0])
    factor = -(-LEAST_WIDTH_PX // size_px[0])
    large = cv2.resize(picture, (size_px[0] * factor, size_px[1] * factor), interpolation=cv2.INTER_CUBIC)
    canvas = _Canvas(np.asarray(large * DIMMED, np.uint8), camera, size_px, factor)
    step_m = _draw_grid(canvas, site)
    cv2.addWeighted(large, (1 - GRID_WEIGHT) * DIMMED, canvas.image, GRID_WEIGHT, 0, dst=canvas.image)
    _draw_lanes(canvas, site, found)
    if isinstance(found.hull_m, shapely.Polygon):
        canvas.line(shapely.get_coordinates(found.hull_m), HULL, 2)
    _draw_limits(canvas, site, found)
    if site.points is not None:
        _draw_marks(canvas, site.points)
    return _with_legend(canvas.image, site, found, step_m)


def _draw_grid(canvas: _Canvas, site: Site) -> int:
    """Draw lines of equal x and y over the lanes, the marks, or all that is in view; return their distance."""
    parts = [lane.centre_line_m for lane in site.network.lanes] if site.network else []
    parts += [] if site.points is None else [site.points[:, 2:]]
    area_m = np.concatenate(parts or [canvas.camera.view_outline(*canvas.size_px)])
    low_m, high_m = area_m.min(axis=0), area_m.max(axis=0)
    long_m = float((high_m - low_m).max())
    step_m = next((step for step in GRID_STEPS_M if 4 <= long_m / step <= 45), GRID_STEPS_M[-1])
    first, last = np.floor(low_m / step_m).astype(int) - 1, np.ceil(high_m / step_m).astype(int) + 1
    for axis, name in ((0, "x"), (1, "y")):
        label_px = np.full(2, np.inf)
        for number in range(first[axis], last[axis] + 1):
            line_m = np.full((400, 2), float(number * step_m))
            line_m[:, 1 - axis] = np.linspace(first[1 - axis] * step_m, last[1 - axis] * step_m, 400)
            points_px = canvas.camera.to_pixels(line_m)
            canvas.line_px(points_px, GRID)
            seen_px = points_px[in_picture(points_px, canvas.size_px)]
            if len(seen_px) == 0:
                continue
            # Lines of x are labelled at their lowest place in the picture, those of y at their leftmost.
            at_px = canvas.place(seen_px[np.argmax(seen_px[:, 1]) if axis == 0 else np.argmin(seen_px[:, 0])])
            if np.hypot(*(at_px - label_px)) >= LABEL_PX:
                height_px, width_px = canvas.image.shape[:2]
                inside_px = np.clip(at_px + np.array([4, -4]), (4, 16), (width_px - 60, height_px - 6))
                canvas.write(f"{name} {number * step_m}", inside_px, GRID)
                label_px = at_px
    return step_m


def _draw_lanes(canvas: _Canvas, site: Site, found: Review) -> None:
    near_m = shapely.buffer(found.hull_m, HULL_MARGIN_M) if found.hull_m and found.beyond else None
    for lane in site.network.lanes if site.network else ():
        line_m = shapely.LineString(lane.centre_line_m)
        border_m = shapely.boundary(shapely.buffer(line_m, lane.width_m / 2, cap_style="flat"))
        parts: list[tuple[shapely.Geometry, Colour]] = [(border_m, LANE)]
        if near_m is not None:
            parts = [(border_m.intersection(near_m), LANE), (border_m.difference(near_m), BEYOND)]
        for lines_m, colour in parts:
            for part_m in shapely.get_parts(lines_m):
                if isinstance(part_m, shapely.LineString) and not part_m.is_empty:
                    canvas.line(shapely.get_coordinates(part_m), colour, 2)
        seen_px = canvas.camera.to_pixels(shapely.get_coordinates(shapely.segmentize(line_m, 1.0)))
        seen_px = seen_px[in_picture(seen_px, canvas.size_px)]
        if len(seen_px) > 0:
            # At a third of the way from the nearest end: lanes of one road are then named side by side.
            nearest_first = seen_px if seen_px[0, 1] > seen_px[-1, 1] else seen_px[::-1]
            half_px = cv2.getTextSize(lane.id, FONT, 0.5, 1)[0][0] / 2
            canvas.write(lane.id, canvas.place(nearest_first[len(seen_px) // 3]) - (half_px, 0), LANE, 0.5)
    for _, end_px in found.ends:
        x_px, y_px = np.round(canvas.place(np.array(end_px))).astype(int).tolist()
        cv2.drawMarker(canvas.image, (x_px, y_px), BEYOND, cv2.MARKER_TILTED_CROSS, 22, 3, cv2.LINE_AA)


def _draw_limits(canvas: _Canvas, site: Site, found: Review) -> None:
    """Draw the horizon, and the line beyond which vision does not look."""
    columns, rows = (np.arange(0, side, FIELD_STEP_PX) for side in canvas.size_px)
    pixels = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2).astype(np.float64)
    ground_m = canvas.camera.to_ground(pixels)
    is_ground = np.isfinite(ground_m[:, 0])
    straight_px = pixels if canvas.camera.lens is None else canvas.camera.lens.straighten(pixels)
    nearness = np.column_stack((straight_px, np.ones(len(pixels)))) @ canvas.camera.ground_from_pixel[2]
    fineness = np.full(len(pixels), -1.0)
    scale_m = across_m(site, canvas.camera, canvas.size_px, ground_m[is_ground])
    fineness[is_ground] = np.clip(np.log(found.apart_scale_m / scale_m), -1, 1)
    for field, colour, name in (
        (nearness / np.abs(nearness).max(), HORIZON, "horizon"),
        (fineness, REACH, f"{found.apart_scale_m:.2g} m/px"),
    ):
        height_px, width_px = canvas.image.shape[:2]
        smooth = cv2.resize(field.reshape(len(rows), len(columns)), (width_px, height_px))
        contours, _ = cv2.findContours((smooth > 0).astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        for contour in contours:
            points_px = contour.reshape(-1, 2).astype(np.float64)
            inner = np.asarray(((points_px > 2) & (points_px < np.array([width_px, height_px]) - 3)).all(axis=1))
            for piece in in_front(np.where(inner[:, None], points_px, np.nan)):
                cv2.polylines(canvas.image, [piece], isClosed=False, color=colour, thickness=2, lineType=cv2.LINE_AA)
                if len(piece) > 100:
                    canvas.write(name, piece[len(piece) // 2] + np.array([6, -6]), colour)


def _draw_marks(canvas: _Canvas, points: FloatArray) -> None:
    errors_px = canvas.camera.to_pixels(points[:, 2:]) - points[:, :2]
    for number, (mark_px, error_px) in enumerate(zip(points[:, :2], errors_px, strict=True), start=1):
        canvas.line_px(np.array([mark_px, mark_px + ERROR_SCALE * error_px]), BEYOND, 2)
        centre = np.round(canvas.place(mark_px)).astype(int).tolist()
        cv2.circle(canvas.image, (centre[0], centre[1]), 4, MARK, 2, cv2.LINE_AA)
        canvas.write(str(number), canvas.place(mark_px) + np.array([6, 14]), MARK, 0.4)


def _with_legend(image: ByteArray, site: Site, found: Review, step_m: int) -> ByteArray:
    keys = [
        (GRID, f"grid {step_m} m"),
        (LANE, "lane"),
        (BEYOND, f"error x {ERROR_SCALE}, lane beyond the points, lane end"),
        (MARK, "point"),
        (HULL, "hull of the points"),
        (HORIZON, "horizon"),
        (REACH, "vehicles told apart up to here"),
    ]
    lines = [(WHITE, f"{site.name}: {text}" if not number else text) for number, text in enumerate(found.facts())]
    lines += [(BEYOND, f"warning: {text}") for text in found.warnings()]
    size = 0.45
    wrapped = [(colour, part) for colour, text in lines for part in _wrapped(text, image.shape[1] - 24, size)]
    band = np.full((LINE_PX * (len(wrapped) + 1) + 14, image.shape[1], 3), 28, np.uint8)
    at = 12
    for colour, word in keys:
        cv2.line(band, (at, 18), (at + 22, 18), colour, 3, cv2.LINE_AA)
        cv2.putText(band, word, (at + 28, 22), FONT, size, WHITE, 1, cv2.LINE_AA)
        at += 46 + cv2.getTextSize(word, FONT, size, 1)[0][0]
    for row, (colour, text) in enumerate(wrapped, start=1):
        cv2.putText(band, text, (12, 22 + LINE_PX * row), FONT, size, colour, 1, cv2.LINE_AA)
    return np.vstack((image, band))


def _wrapped(text: str, width_px: int, size: float) -> list[str]:
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and cv2.getTextSize(longer, FONT, size, 1)[0][0] > width_px:
            lines.append(f"    {word}")
        else:
            lines[-1] = longer if lines[-1] else word
    return lines
