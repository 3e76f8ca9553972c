"""What would a user know about a synthetic scene? Writes `site.toml`: clock, roads, camera, none of the truth."""

import json
from pathlib import Path

from data_gen.drawing.cameras import CameraPath
from gis.cameras.camera import GroundCamera

_SITE = """\
name = {name}
start_utc = 2026-05-01T08:00:00Z

[frame]
origin_lat_deg = 58.4
origin_lon_deg = 15.6

[network]
sumo = "{network}"
"""
_COMMENT = "# Ground metres (east, north, 1) from pixels (right, down, 1), row by row"


def write_site(
    file: Path,
    *,
    name: str,
    network: Path,
    path: CameraPath | None = None,
    poses: Path | None = None,
    thermal: tuple[Path, CameraPath] | None = None,
) -> None:
    """Write the site file of a scene.

    Parameters
    ----------
    file : to write.
    name : of the scene.
    network, poses : files beside it; poses are told only if they are given.
    path : of the colour camera; a moving one is described by its first frame. Trajectories need no camera.
    thermal : video and path of the thermal camera, if there is one.
    """
    text = _SITE.format(name=json.dumps(name), network=network.name)
    if path is not None:
        moving = "moving = true\n" if path.is_moving else ""
        told = "" if poses is None else f'poses = "{poses.name}"\n'
        text += f"\n[camera]\n{moving}{told}{_homography(path)}\n"
    if thermal is not None:
        video, thermal_path = thermal
        text += f'\n[camera.thermal]\nvideo = "{video.name}"\n{_homography(thermal_path)}\n'
    file.write_text(text, encoding="utf-8")


def _homography(path: CameraPath) -> str:
    camera: GroundCamera = path.views[0].camera
    # Any scale is the same camera; this one reads like the homographies that people write.
    matrix = camera.ground_from_pixel / camera.ground_from_pixel[2, 2]
    rows = ",\n".join(f"  {row!r}" for row in matrix.tolist())
    comment = f"{_COMMENT}, of the first frame." if path.is_moving else f"{_COMMENT}."
    return f"{comment}\nhomography = [\n{rows}\n]"
