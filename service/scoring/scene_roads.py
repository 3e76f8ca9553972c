"""Which vehicles of a scene are on its roads? Who is parked beside them is not looked for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import shapely

from service.runs.inputs.site import load_site
from service.scoring.object_rows import ObjectRows


def load_scene_roads(folder: Path) -> shapely.Geometry | None:
    """Find the roads of a scene.

    Parameters
    ----------
    folder : of the scene, with `site.toml`.

    Returns
    -------
    Their surface in metres, prepared; None where no site file tells of roads.

    Raises
    ------
    ServiceError
        If the site file cannot be read.
    """
    path = folder / "site.toml"
    network = load_site(path).network if path.is_file() else None
    if network is None:
        return None
    surface = network.surface()
    shapely.prepare(surface)
    return surface


def keep_to_roads(rows: ObjectRows, roads: shapely.Geometry | None) -> ObjectRows:
    """Add to the border what has its centre beside the roads; nothing if no roads are known.

    Examples
    --------
    >>> import numpy as np
    >>> nothing, false = np.zeros(2), np.zeros(2, bool)
    >>> names = np.array(["driving", "parked"])
    >>> centre_m = np.array([[5.0, 1.0], [5.0, 6.0]])
    >>> rows = ObjectRows(np.zeros(2, int), names, centre_m, nothing, nothing, nothing, false, false, names)
    >>> keep_to_roads(rows, shapely.box(0, 0, 100, 4)).is_border.tolist()
    [False, True]
    """
    if roads is None:
        return rows
    x_m, y_m = rows.centre_m.T
    return replace(rows, is_border=rows.is_border | ~shapely.intersects_xy(roads, x_m, y_m))
