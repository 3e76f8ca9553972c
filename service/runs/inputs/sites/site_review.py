"""What should be known of a site's camera before its metres are believed? Residuals, reach, and lanes without support.

A fit holds where its points are: beyond their hull it is extrapolated. Vision wants lanes that run out of the picture,
and sees only as far as vehicles are some pixels wide.
"""

from dataclasses import dataclass

import numpy as np
import shapely

from gis.cameras.camera import GroundCamera
from gis.polyline import FloatArray
from service.runs.inputs.sites.site import BORDER_PX, Site
from vision.detection.eye import is_slanting
from vision.objects import BoolArray
from vision.road.view import GroundView

# A lane is warned of where a tenth of it that is in view, and so many metres, lie beyond the hull of the points, grown
# by a lane's width: marks lie on the lines beside a lane, not around it.
BEYOND_SHARE, BEYOND_M, HULL_MARGIN_M = 0.1, 10.0, 4.0
STEP_M = 1.0


@dataclass(frozen=True, slots=True)
class Review:
    """What is known of a site's camera.

    Attributes
    ----------
    hull_m : around the marks, on the ground; None without marks.
    beyond : lanes with the metres of them in view that lie beyond the hull.
    ends : (lane, pixel) of ends of lanes inside the picture.
    apart_scale_m : metres a pixel, across the line of sight, up to which vision looks at vehicles.
    out_of_reach : lanes with the metres of them in view that are seen more coarsely than that.
    errors_px, errors_m : (n,) how far beside its mark the camera puts each, in the picture and on the ground; empty
        without marks.
    scales_m : metres a pixel where the lanes in view, or the marks, are seen most finely and most coarsely.
    lens : in words.
    """

    hull_m: shapely.Geometry | None
    beyond: tuple[tuple[str, float], ...]
    ends: tuple[tuple[str, tuple[float, float]], ...]
    apart_scale_m: float
    out_of_reach: tuple[tuple[str, float], ...]
    errors_px: FloatArray
    errors_m: FloatArray
    scales_m: tuple[float, float]
    lens: str

    def facts(self) -> list[str]:
        """Say how good the camera is, a line each."""
        told = [
            f"lens {self.lens}; a pixel shows {self.scales_m[0]:.3g} m at the nearest, {self.scales_m[1]:.3g} m far"
        ]
        if len(self.errors_px) > 0:
            rms_px, rms_m = (float(np.sqrt((one**2).mean())) for one in (self.errors_px, self.errors_m))
            worst = int(np.argmax(self.errors_px))
            most = f"most {self.errors_px[worst]:.1f} px (point {worst + 1}) and {100 * self.errors_m.max():.0f} cm"
            told.append(f"{len(self.errors_px)} points, error {rms_px:.1f} px or {100 * rms_m:.0f} cm rms; {most}")
        far = ", ".join(f"{lane} {metres:.0f} m" for lane, metres in self.out_of_reach)
        limit = f"vehicles are looked at up to {self.apart_scale_m:.2g} m a pixel, and not told apart farther away"
        told.append(f"{limit}: {far or 'no lane in view goes so far'}")
        return told

    def warnings(self) -> list[str]:
        """Say what somebody should mend, a line each."""
        told = []
        if self.beyond:
            said = ", ".join(f"{lane} {beyond_m:.0f} m" for lane, beyond_m in self.beyond)
            told.append(f"lanes lie beyond the camera's points, where distances are only extrapolated: {said}")
        if self.ends:
            said = ", ".join(f"{lane} at ({x_px:.0f}, {y_px:.0f})" for lane, (x_px, y_px) in self.ends)
            told.append(f"lanes end inside the picture, where vehicles are cut off as they come: {said}")
        return told


def review(site: Site, camera: GroundCamera, size_px: tuple[int, int]) -> Review:
    """Look over a site's camera and lanes.

    Parameters
    ----------
    camera : of the site; of its first frame where it moves.
    size_px : width and height of the picture.
    """
    lanes = site.network.lanes if site.network else ()
    hull_m = None if site.points is None else shapely.MultiPoint(site.points[:, 2:]).convex_hull
    near_m = None if hull_m is None else shapely.buffer(hull_m, HULL_MARGIN_M)
    scale_m, surface = apart_scale_m(site, camera, size_px), site.network.surface() if site.network else None
    marks = np.empty((0, 4)) if site.points is None else site.points
    seen = [marks[:, 2:]]
    beyond, ends, coarse = [], [], []
    for lane in lanes:
        points_m = shapely.get_coordinates(shapely.segmentize(shapely.LineString(lane.centre_line_m), STEP_M))
        points_m = points_m[in_picture(camera.to_pixels(points_m), size_px)]
        if len(points_m) > 0 and near_m is not None:
            beyond_m = STEP_M * float((~shapely.contains_xy(near_m, points_m)).sum())
            if beyond_m >= max(BEYOND_M, BEYOND_SHARE * STEP_M * len(points_m)):
                beyond.append((lane.id, beyond_m))
        if len(points_m) > 0:
            seen.append(points_m)
            coarse_m = STEP_M * float((across_m(site, camera, size_px, points_m) > scale_m).sum())
            coarse += [(lane.id, coarse_m)] if coarse_m > 0 else []
        ends += [(lane.id, end) for end in _dead_ends(lane.centre_line_m, surface, camera, size_px)]
    everywhere_m = np.concatenate(seen) if sum(map(len, seen)) else camera.view_outline(*size_px)
    scales_m = camera.metres_per_pixel(everywhere_m)
    return Review(
        hull_m=hull_m,
        beyond=tuple(beyond),
        ends=tuple(ends),
        apart_scale_m=scale_m,
        out_of_reach=tuple(coarse),
        errors_px=np.hypot(*(camera.to_pixels(marks[:, 2:]) - marks[:, :2]).T),
        errors_m=np.hypot(*(camera.to_ground(marks[:, :2]) - marks[:, 2:]).T),
        scales_m=(float(np.nanmin(scales_m)), float(np.nanmax(scales_m))),
        lens=f"with radial {camera.lens.radial:.3f}" if camera.lens else "straight",
    )


def in_picture(points_px: FloatArray, size_px: tuple[int, int]) -> BoolArray:
    """Tell which pixels (n, 2) are in the picture: (n,) bool."""
    return np.asarray(((points_px >= -0.5) & (points_px <= np.array(size_px) - 0.5)).all(axis=1), np.bool_)


def across_m(site: Site, camera: GroundCamera, size_px: tuple[int, int], points_m: FloatArray) -> FloatArray:
    """Measure metres a pixel across the line of sight, (n,), as vision does."""
    view = GroundView(camera.pixel_from_ground, size_px, site.vision, camera.lens)
    return view.sight(points_m).across_m


def apart_scale_m(site: Site, camera: GroundCamera, size_px: tuple[int, int]) -> float:
    """Say how coarsely, in metres a pixel, vision still looks: in the picture of a slanting camera, or on its map."""
    settings = site.vision
    view = GroundView(camera.pixel_from_ground, size_px, settings, camera.lens)
    polygons_m = [np.asarray(lane.centre_line_m) for lane in site.network.lanes] if site.network else []
    if is_slanting(view, polygons_m, settings):
        return settings.car_width_m / settings.detection.least_car_px
    return settings.max_metres_per_pixel


def _dead_ends(
    line_m: FloatArray, surface: shapely.Geometry | None, camera: GroundCamera, size_px: tuple[int, int]
) -> list[tuple[float, float]]:
    """Find the ends of a lane that are in the picture and where no other lane or junction goes on."""
    ends_px = camera.to_pixels(line_m[[0, -1]])
    found = []
    for end, inner, pixel in zip(line_m[[0, -1]], line_m[[1, -2]], ends_px, strict=True):
        ahead_m = end + (end - inner) / max(float(np.hypot(*(end - inner))), 1e-9)
        margin_px = np.minimum(pixel + 0.5, np.array(size_px) - 0.5 - pixel).min()
        if margin_px > BORDER_PX and not shapely.contains_xy(surface, *ahead_m):
            found.append((float(pixel[0]), float(pixel[1])))
    return found
