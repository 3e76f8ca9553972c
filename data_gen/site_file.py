"""What would a user know about a synthetic scene? Writes `site.toml`: clock, roads, camera, none of the truth."""

import json
from pathlib import Path

from data_gen.drawing.cameras import CameraPath
from gis.camera import GroundCamera

_SITE = """\
name = {name}
start_utc = 2026-05-01T08:00:00Z

[frame]
origin_lat_deg = 58.4
origin_lon_deg = 15.6

[network]
sumo = "{network}"
"""
_CAMERA = """
[camera]
{camera}"""
_COMMENT = "# Ground metres (east, north, 1) from pixels (right, down, 1), row by row"


def write_site(
    file: Path,
    *,
    name: str,
    network: Path,
    path: CameraPath,
    poses: Path | None,
    thermal: tuple[Path, CameraPath] | None,
) -> None:
    """Write the site file of a scene.

    Parameters
    ----------
    file : to write.
    name : of the scene.
    network, poses : files beside it; poses are told only if they are given.
    path : of the colour camera; a moving one is described by its first frame.
    thermal : video and path of the thermal camera, if there is one.
    """
    lines = ["moving = true"] if path.is_moving else []
    if poses is not None:
        lines.append(f'poses = "{poses.name}"')
    camera = "\n".join([*lines, _homography(path), ""])
    if thermal is not None:
        video, thermal_path = thermal
        camera += f'\n[camera.thermal]\nvideo = "{video.name}"\n{_homography(thermal_path)}\n'
    file.write_text(_site(name, network) + _CAMERA.format(camera=camera), encoding="utf-8")


def write_site_without_camera(file: Path, *, name: str, network: Path) -> None:
    """Write the site file of trajectories, which need no camera.

    Parameters
    ----------
    file : to write.
    name : of the scene.
    network : file beside it.
    """
    file.write_text(_site(name, network), encoding="utf-8")


def _site(name: str, network: Path) -> str:
    return _SITE.format(name=json.dumps(name), network=network.name)


def _homography(path: CameraPath) -> str:
    camera: GroundCamera = path.views[0].camera
    # Any scale is the same camera; this one reads like the homographies that people write.
    matrix = camera.ground_from_pixel / camera.ground_from_pixel[2, 2]
    rows = ",\n".join(f"  {row!r}" for row in matrix.tolist())
    comment = f"{_COMMENT}, of the first frame." if path.is_moving else f"{_COMMENT}."
    return f"{comment}\nhomography = [\n{rows}\n]"
