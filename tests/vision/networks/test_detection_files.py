from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vision.errors import VisionError
from vision.networks.box_detector import CLASS_NAMES, GroundBoxes, ImageBoxes
from vision.networks.detection_files import ReadingRules, read_detections
from vision.networks.stored_detections import StoredDetections, StoredInstant


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def in_image(stored: StoredDetections, index: int = 0, t_us: int = 0) -> ImageBoxes:
    found = stored.detect(StoredInstant(index, t_us))
    assert isinstance(found, ImageBoxes)
    return found


def on_ground(stored: StoredDetections, t_us: int) -> GroundBoxes:
    found = stored.detect(StoredInstant(0, t_us))
    assert isinstance(found, GroundBoxes)
    return found


def test_mot_frames_and_pixels_count_from_one(tmp_path: Path) -> None:
    stored = read_detections(written(tmp_path, "det.txt", "1,-1,11,21,40,20,0.9,-1,-1\n3,-1,1,1,4,2,1,-1,-1\n"))
    first = in_image(stored, 0)
    assert first.bounds_px().tolist() == [[9.5, 19.5, 49.5, 39.5]]
    assert [len(in_image(stored, index)) for index in (1, 2, 3)] == [0, 1, 0]


def test_mot_without_confidence_or_with_minus_one_is_believed(tmp_path: Path) -> None:
    stored = read_detections(written(tmp_path, "det.txt", "1,4,11,21,40,20\n\n1,-1,11,21,40,20,-1,-1,-1,-1\n"))
    assert in_image(stored).score.tolist() == [1.0, 1.0]


def test_rows_below_the_threshold_and_other_classes_are_left_out(tmp_path: Path) -> None:
    text = "1,-1,1,1,4,2,0.1,3,1\n1,-1,5,1,4,2,0.9,1,1\n1,-1,9,1,4,2,87.5,3,1\n"
    stored = read_detections(written(tmp_path, "det.txt", text), ReadingRules(classes={3: "truck"}))
    found = in_image(stored)
    assert found.centre_px.tolist() == [[9.5, 0.5]]
    assert (found.score.tolist(), CLASS_NAMES[found.class_number[0]]) == ([1.0], "truck")


def test_csv_of_upright_boxes_in_pixels(tmp_path: Path) -> None:
    text = "t_s,left_px,top_px,width_px,height_px,score,class\n0.04,9.5,19.5,40,20,0.5,bus\n"
    found = in_image(read_detections(written(tmp_path, "det.csv", text)), t_us=40_000)
    # The corner of pixel 10 lies at 9.5 when pixels count from their centres, so left_px = 10 would start a box there.
    assert found.centre_px.tolist() == [[29.0, 29.0]]
    assert CLASS_NAMES[found.class_number[0]] == "bus"


def test_csv_of_oriented_boxes_in_any_column_order(tmp_path: Path) -> None:
    text = "angle_rad,frame,x_px,y_px,width_px,length_px\n-0.5,7,30,40,8,20\n"
    found = in_image(read_detections(written(tmp_path, "det.csv", text)), 7)
    assert (found.angle_rad.tolist(), found.size_px.tolist()) == ([-0.5], [[20.0, 8.0]])
    assert found.is_oriented.all()


def test_csv_on_the_ground_leaves_open_what_it_does_not_say(tmp_path: Path) -> None:
    rules = ReadingRules(columns={"t_us": "stamp", "x_m": "east", "y_m": "north"})
    stored = read_detections(written(tmp_path, "det.csv", "stamp,east,north,length_m\n0,5,6,4.4\n"), rules)
    found = on_ground(stored, 0)
    assert (found.centre_m.tolist(), found.length_m.tolist()) == ([[5.0, 6.0]], [4.4])
    assert np.isnan([found.heading_rad, found.width_m]).all()


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("det.txt", "1,-1,1,1,4\n", r"det.txt:1: expected 6 to 10 fields, got 5"),
        ("det.txt", "0,-1,1,1,4,2\n", r"det.txt:1: frame: expected 1 to 1e\+09, got '0'"),
        ("det.txt", "1,-1,1,1,4,2\n1.5,-1,1,1,4,2\n", r"det.txt:2: frame: expected a whole number, got '1.5'"),
        ("det.txt", "1,-1,1,1,0,2\n", r"det.txt:1: width_px: expected 0.001 to 1e\+06, got '0'"),
        ("det.txt", "1,-1,1,1,4,2,nan\n", r"det.txt:1: score: expected a finite number, got 'nan'"),
        ("det.txt", "frame,id,left,top,width,height\n", r"det.txt:1: frame: expected a finite number, got 'frame'"),
        ("det.csv", "", r"det.csv:1: expected a column t_us, t_s or frame, got an empty file"),
        ("det.csv", "t_us,x_m\n", r"det.csv:1: expected columns x_m, y_m or x_px, .*, got t_us, x_m"),
        ("det.csv", "t_us,x_m,y_m\n0,1\n", r"det.csv:2: expected 3 fields, got 2"),
        ("det.csv", "t_us,x_m,y_m\n0,1,2\n-4,1,2\n", r"det.csv:3: t_us: expected 0 to 1e\+14, got '-4'"),
        ("det.csv", "t_us,x_m,y_m,heading_rad\n0,1,2,90\n", r"heading_rad: expected -6.3 to 6.3, got '90'"),
        ("det.csv", "t_us,x_m,y_m,class\n0,1,2,horse\n", r"det.csv:2: class: expected one of car, .*, got 'horse'"),
        ("det.csv", "t_us,x_m,y_m,class\n0,1,2,3\n", r"class: expected .* a number and a table of classes, got '3'"),
        ("det.json", "{}", r"det.json: expected MOT text \(.txt\) or CSV \(.csv\), got '.json'"),
    ],
)
def test_bad_lines_are_told_with_their_number(tmp_path: Path, name: str, text: str, message: str) -> None:
    with pytest.raises(VisionError, match=message):
        read_detections(written(tmp_path, name, text))


def test_unknown_column_in_the_map_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, "det.csv", "t_us,x_m,y_m\n")
    with pytest.raises(VisionError, match=r"column map: expected names out of t_us, .*, got 'speed_mps'"):
        read_detections(path, ReadingRules(columns={"speed_mps": "v"}))


def test_missing_and_binary_files_are_told(tmp_path: Path) -> None:
    with pytest.raises(VisionError, match=r"expected a readable file of detections, got No such file"):
        read_detections(tmp_path / "none.csv")
    (tmp_path / "det.csv").write_bytes(b"t_us,x_m,y_m\n\xff\xfe")
    with pytest.raises(VisionError, match=r"expected UTF-8, got byte 0xff"):
        read_detections(tmp_path / "det.csv")
