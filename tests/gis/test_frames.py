"""The local east/north frame against the geodesic."""

from __future__ import annotations

import numpy as np
import pytest
from pyproj import Geod

from gis.errors import GisError
from gis.frames import LocalFrame


def test_there_and_back_is_the_same_point() -> None:
    frame = LocalFrame(58.4, 15.6)
    points_m = np.random.default_rng(3).uniform(-10_000.0, 10_000.0, (200, 2))
    np.testing.assert_allclose(frame.from_wgs84(frame.to_wgs84(points_m)), points_m, atol=1e-4)


def test_distances_and_directions_agree_with_the_geodesic() -> None:
    frame = LocalFrame(-33.9, 151.2)
    lonlat_deg = frame.to_wgs84([[3000.0, 4000.0]])[0]
    azimuth_deg, _, distance_m = Geod(ellps="WGS84").inv(151.2, -33.9, *lonlat_deg)
    assert distance_m == pytest.approx(5000.0, abs=0.01)
    assert azimuth_deg == pytest.approx(np.degrees(np.arctan2(3.0, 4.0)), abs=0.001)


def test_frames_with_one_origin_are_equal() -> None:
    assert LocalFrame(58.4, 15.6) == LocalFrame(58.4, 15.6) != LocalFrame(58.4, 15.7)


@pytest.mark.parametrize(
    ("lat_deg", "lon_deg", "message"),
    [
        (90.0, 0.0, r"origin_lat_deg must lie within \(-89, 89\), got 90.0"),
        (np.nan, 0.0, r"origin_lat_deg must lie within \(-89, 89\), got nan"),
        (0.0, 200.0, r"origin_lon_deg must lie within \[-180, 180\], got 200.0"),
    ],
)
def test_an_origin_off_the_earth_is_an_error(lat_deg: float, lon_deg: float, message: str) -> None:
    with pytest.raises(GisError, match=message):
        LocalFrame(lat_deg, lon_deg)


def test_a_latitude_past_the_pole_is_an_error() -> None:
    with pytest.raises(GisError, match=r"expected points near lon 15.6, lat 58.4, got \[15.0, 95.0\]"):
        LocalFrame(58.4, 15.6).from_wgs84([[15.6, 58.4], [15.0, 95.0]])


def test_points_of_a_wrong_shape_are_an_error() -> None:
    with pytest.raises(GisError, match=r"expected points of shape \(n, 2\), got shape \(2,\)"):
        LocalFrame(58.4, 15.6).to_wgs84([1.0, 2.0])
