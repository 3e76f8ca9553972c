"""Roads made of lanelets, and passes found in a file whose cars get lost."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks import evaluate_gaps, lanelet_network
from gis.roads.lane_graph import LaneGraph
from service.runs.inputs.sites.site import load_site


def band(left_m: float, start_m: float, end_m: float) -> dict[str, list[list[float]]]:
    """Bounds of a lanelet that runs east, 3 m wide, with more points on its right."""
    right = [[x, left_m - 3.0] for x in np.linspace(start_m, end_m, 4).tolist()]
    return {"left": [[start_m, left_m], [end_m, left_m]], "right": right}


LANELETS = {
    "1": {**band(0, 0, 100), "successors": ["3"], "adj_left": [["2", "same"]]},
    "2": {**band(3, 0, 100), "successors": [], "adj_left": [["9", "opposite"]]},
    "3": {**band(0, 100, 300), "successors": [], "adj_left": []},
    "9": {"left": [[100, 3], [0, 3]], "right": [[100, 6], [0, 6]], "successors": [], "adj_left": [["2", "opposite"]]},
}


def test_lanelets_become_lanes_with_their_neighbours_and_what_follows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "place.json"
    file.write_text(json.dumps(LANELETS))
    monkeypatch.setattr("sys.argv", ["lanelet_network", str(file), str(tmp_path / "made")])
    lanelet_network.main()
    network = load_site(tmp_path / "made" / "site.toml").network
    assert network is not None

    assert [lane.id for lane in network.lanes] == ["1_0", "1_1", "3_0", "9_0"]
    assert {lane.width_m for lane in network.lanes} == {3.0}
    at = network.locate([[50, -1.5], [50, 1.5], [200, -1.5], [50, 4.5]])
    assert at.lane.tolist() == [0, 1, 2, 3]
    assert [(road.id, road.lanes) for road in network.roads] == [("1", ("1_0", "1_1", "9_0")), ("3", ("3_0",))]
    assert [lane.direction for lane in network.lanes] == [1, 1, 1, -1]
    graph = LaneGraph.of(network)
    assert graph is not None
    places = graph.project(
        np.array([[50.0, -1.5], [200.0, -1.5]]), np.zeros(2), network.locate([[50, -1.5], [200, -1.5]])
    )
    assert graph.gaps_m(places, np.array([[0], [1]])).ravel().tolist() == pytest.approx([150.0, np.inf])


@pytest.mark.long
def test_pass_is_found_although_the_cars_get_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "tracks.csv"
    with file.open("w", newline="") as opened:
        writer = csv.writer(opened)
        writer.writerow(["t", "id", "x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m"])
        for step in range(150):
            for name, x_m, y_m, speed_mps in ("slow", 60, 0, 10), ("fast", 0, 3.5, 20):
                writer.writerow([step / 10, name, x_m + speed_mps * step / 10, y_m, 0, speed_mps, 4.5, 1.8])
    monkeypatch.setattr(evaluate_gaps, "GAPS_PER_MINUTE", 12.0)
    evaluate_gaps.main([str(file), "--columns", "t_s=t", "--gaps", "0.6", "--seconds", "14"])
    plain, gaps = (
        [cell.strip() for cell in line.split("|")[1:-1]] for line in capsys.readouterr().out.splitlines()[-2:]
    )
    assert plain[:3] == ["0", "1", "1"]
    assert gaps[:3] == ["0.6", "1", "1"]
    assert plain[5:8] == ["0", "0", "0"]
    assert int(gaps[5]) >= 2  # as many came back, all under the right symbols
    assert gaps[6:8] == ["0", "0"]
