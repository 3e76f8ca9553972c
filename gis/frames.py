"""Where on Earth is a point of the local east/north frame?

The frame is a transverse Mercator projection about the site's origin: angles are kept, and lengths are right to one
part in a million as far as 9 km from the origin's meridian.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gis.errors import GisError
from gis.polyline import FloatArray

if TYPE_CHECKING:
    from pyproj import Transformer
    from pyproj.enums import TransformDirection


@dataclass(frozen=True, slots=True)
class LocalFrame:
    """Metres east and north of a point on Earth.

    Attributes
    ----------
    origin_lat_deg : geodetic latitude (WGS84) of the point (0, 0), within (-89, 89).
    origin_lon_deg : its longitude, within [-180, 180].

    Raises
    ------
    GisError
        If the origin is out of range.

    Examples
    --------
    >>> frame = LocalFrame(58.4, 15.6)
    >>> frame.to_wgs84([[0.0, 0.0], [0.0, 1000.0]]).round(5).tolist()
    [[15.6, 58.4], [15.6, 58.40898]]
    >>> frame.from_wgs84([[15.6, 58.4]]).round(3).tolist()
    [[0.0, 0.0]]
    """

    origin_lat_deg: float
    origin_lon_deg: float
    _from_wgs84: Transformer = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not -89.0 < self.origin_lat_deg < 89.0:
            raise GisError(f"local frame: origin_lat_deg must lie within (-89, 89), got {self.origin_lat_deg!r}")
        if not -180.0 <= self.origin_lon_deg <= 180.0:
            raise GisError(f"local frame: origin_lon_deg must lie within [-180, 180], got {self.origin_lon_deg!r}")
        object.__setattr__(self, "_from_wgs84", _transformer(self.origin_lat_deg, self.origin_lon_deg))

    def to_wgs84(self, points_m: ArrayLike) -> FloatArray:
        """Give the longitude and latitude of local points.

        Parameters
        ----------
        points_m : (n, 2).

        Returns
        -------
        (n, 2) longitude, latitude in degrees.

        Raises
        ------
        GisError
            If the shape is wrong or a point is too far from the origin to be projected.
        """
        from pyproj.enums import TransformDirection

        return self._transform(points_m, TransformDirection.INVERSE)

    def from_wgs84(self, lonlat_deg: ArrayLike) -> FloatArray:
        """Give the local position of points on Earth.

        Parameters
        ----------
        lonlat_deg : (n, 2) longitude, latitude in degrees, in this order, as in GeoJSON.

        Returns
        -------
        (n, 2) metres.

        Raises
        ------
        GisError
            If the shape is wrong, a latitude is past a pole, or a point is too far from the origin to be projected.
        """
        from pyproj.enums import TransformDirection

        return self._transform(lonlat_deg, TransformDirection.FORWARD)

    def _transform(self, points: ArrayLike, direction: TransformDirection) -> FloatArray:
        array = np.asarray(points, dtype=np.float64)
        if array.ndim != 2 or array.shape[1] != 2:
            raise GisError(f"local frame: expected points of shape (n, 2), got shape {array.shape!r}")
        mapped = np.column_stack(self._from_wgs84.transform(array[:, 0], array[:, 1], direction=direction))
        if not np.isfinite(mapped).all():
            outside = array[~np.isfinite(mapped).all(axis=1)][0].tolist()
            raise GisError(f"local frame: expected points near {self._origin()}, got {outside!r}")
        return np.asarray(mapped, dtype=np.float64)

    def _origin(self) -> str:
        return f"lon {self.origin_lon_deg:g}, lat {self.origin_lat_deg:g}"


def _transformer(lat_deg: float, lon_deg: float) -> Transformer:
    from pyproj import CRS, Transformer

    local = CRS.from_proj4(f"+proj=tmerc +lat_0={lat_deg!r} +lon_0={lon_deg!r} +k=1 +datum=WGS84 +units=m +type=crs")
    return Transformer.from_crs(CRS.from_epsg(4326), local, always_xy=True)
