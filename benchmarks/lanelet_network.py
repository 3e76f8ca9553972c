"""Make the roads that `gis` reads from lanelets: ``python -m benchmarks.lanelet_network LANELETS.json FOLDER``.

Lanelets are one JSON object, a name to ``left`` and ``right`` ([[x, y], ...] metres in driving direction),
``successors`` (names) and ``adj_left`` ([[name, "same" or "opposite"], ...]). Those side by side become the lanes of an
edge, successors its connections, in a SUMO network `FOLDER/roads.net.xml`, with a site file `FOLDER/site.toml` that
names it. Lanelets have no speed limits: ``--speed-limit-mps`` is that of all.
"""

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import shapely

from gis.polyline import FloatArray

# JSON as `json` reads it.
Lanelets = Mapping[str, Mapping[str, Any]]

SITE = """\
name = "{name}"

[network]
sumo = "roads.net.xml"
"""


def main() -> None:
    """Write the network and the site file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lanelets", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--speed-limit-mps", type=float, default=22.2)
    options = parser.parse_args()
    root = sumo_network(json.loads(options.lanelets.read_text(encoding="utf-8")), options.speed_limit_mps)
    ElementTree.indent(root)
    options.folder.mkdir(parents=True, exist_ok=True)
    ElementTree.ElementTree(root).write(options.folder / "roads.net.xml", encoding="utf-8", xml_declaration=True)
    (options.folder / "site.toml").write_text(SITE.format(name=options.lanelets.stem), encoding="utf-8")


def sumo_network(lanelets: Lanelets, speed_limit_mps: float) -> ElementTree.Element:
    """Write lanelets as a SUMO network.

    Parameters
    ----------
    lanelets : see above. speed_limit_mps : of all of them.

    Returns
    -------
    The element `net`. The lane of index 0 is the outermost on the right, as everywhere in SUMO.
    """
    place_of = {
        name: (edge, index) for edge, members in _side_by_side(lanelets).items() for index, name in enumerate(members)
    }
    root = ElementTree.Element("net")
    edges: dict[str, ElementTree.Element] = {}
    for name, (edge, index) in place_of.items():
        if edge not in edges:
            ends = {"from": f"before {edge}", "to": f"after {edge}"}
            edges[edge] = ElementTree.SubElement(root, "edge", {"id": edge, **ends})
        line_m, width_m = _middle(lanelets[name])
        values = {"index": index, "speed": speed_limit_mps, "width": round(width_m, 2), "shape": _shape(line_m)}
        texts = {key: str(value) for key, value in values.items()}
        lane = ElementTree.SubElement(edges[edge], "lane", {"id": f"{edge}_{index}", **texts})
        for other in _on_the_left(lanelets, name, "opposite"):
            ElementTree.SubElement(lane, "neigh", {"lane": "{}_{}".format(*place_of[other])})
    for name, (edge, index) in place_of.items():
        for after in lanelets[name]["successors"]:
            onto, at = place_of[after]
            ends = {"from": edge, "to": onto, "fromLane": str(index), "toLane": str(at)}
            ElementTree.SubElement(root, "connection", ends)
    return root


def _side_by_side(lanelets: Lanelets) -> dict[str, list[str]]:
    """Group lanelets into edges, from right to left, each named after its first."""
    left_of = {name: others[0] for name in lanelets if (others := _on_the_left(lanelets, name, "same"))}
    edges: dict[str, list[str]] = {}
    for name in lanelets:
        if name not in left_of.values():
            edges[name] = [name]
            while edges[name][-1] in left_of:
                edges[name].append(left_of[edges[name][-1]])
    return edges


def _on_the_left(lanelets: Lanelets, name: str, direction: str) -> list[str]:
    return [other for other, goes in lanelets[name]["adj_left"] if goes == direction]


def _middle(lanelet: Mapping[str, Any]) -> tuple[FloatArray, float]:
    """Draw the line half way between the two bounds, and measure how far they are apart."""
    shares = np.linspace(0.0, 1.0, max(len(lanelet["left"]), len(lanelet["right"])))
    left_m, right_m = (
        shapely.get_coordinates(shapely.line_interpolate_point(shapely.LineString(bound), shares, normalized=True))
        for bound in (lanelet["left"], lanelet["right"])
    )
    middle_m: FloatArray = (left_m + right_m) / 2
    line = shapely.LineString(middle_m)
    return middle_m, float(2 * np.median(shapely.distance(line, shapely.points(left_m))))


def _shape(line_m: FloatArray) -> str:
    return " ".join(f"{x:.3f},{y:.3f}" for x, y in line_m)


if __name__ == "__main__":
    main()
