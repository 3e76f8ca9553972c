"""Do exported files carry everything, and can they be read back?"""

import csv
import io
import math
import random
from pathlib import Path

import pytest

from service.export.events import ExportFormat, events_csv, exported
from service.export.tracks import MotReport, footprint_corners, write_tracks_csv, write_tracks_mot
from service.questions.events.queries import EventFilter, decode_event
from service.records.runs import CameraRecord
from service.records.seen import CarState, ViewRecord
from service.store.log import open_log
from tests.service.logs import CAMERA, event_of_row, overtake, random_drafts, read_all, state, write_log


@pytest.fixture
def url(tmp_path: Path) -> str:
    odd = overtake(5, 6, roles={"überholer": 'car "7", x'}, hypotheses=(), sub_events=())
    return write_log(tmp_path / "a.db", [*random_drafts(random.Random(3), 60), odd])


def test_events_survive_a_round_trip_through_csv(url: str) -> None:
    found = [event_of_row(row) for row in csv.DictReader(io.StringIO(_whole(url, "csv"), newline=""))]
    assert found == read_all(url)
    assert len(found) > 30


def test_events_survive_a_round_trip_through_jsonl(url: str) -> None:
    assert [decode_event(line) for line in _whole(url, "jsonl").splitlines()] == read_all(url)


def _whole(url: str, form: ExportFormat) -> str:
    with open_log(url) as log:
        return "".join(map(str, exported(log, EventFilter(), form)))


def test_an_empty_csv_has_its_header() -> None:
    [text] = events_csv([], ["overtaker"])
    assert text.endswith("hypotheses,sub_events,role.overtaker\n")


def test_tracks_have_the_columns_of_the_truth() -> None:
    out = io.StringIO()
    write_tracks_csv([state(40_000, "car7", 1.5, -2.0, linked=False, lane="")], out)
    assert out.getvalue().splitlines() == [
        "t_us,id,class,x_m,y_m,heading_rad,speed_mps,length_m,width_m,road,lane,visible",
        "40000,car7,car,1.500,-2.000,0.000,13.900,4.500,1.800,road1,,0",
    ]


def test_a_mot_box_goes_round_the_footprint() -> None:
    # Ten pixels a metre: the car covers 4.5 x 1.8 m round (10, 5), so 45 x 18 px round pixel (200, 150).
    assert _mot([state(40_000, "car7", 10.0, 5.0)]) == ["2,3,179.00,142.50,45.00,18.00,1,-1,-1,-1"]


def test_a_predicted_car_has_no_confidence() -> None:
    (line,) = _mot([state(0, "car7", 10.0, 5.0, linked=False)])
    assert line.split(",")[6] == "0"


def test_states_without_a_box_are_counted() -> None:
    states = [state(0, "car7", 10.0, 5.0), state(0, "car7", 1000.0, 5.0), state(20_000, "car7", 10.0, 5.0)]
    out = io.StringIO()
    report = write_tracks_mot(states, out, frames=[(1, 0), (2, 40_000)], car_numbers={"car7": 3}, camera=CAMERA)
    assert (len(out.getvalue().splitlines()), report) == (1, MotReport(without_frame=1, outside=1))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_car_behind_the_camera_has_no_box(sign: float) -> None:
    # Looking along +y from y = 0: depth grows with y, and what lies at y < 0 is behind.
    numbers = (100.0, 32.0, 0.0, 0.0, 10.0, 200.0, 0.0, 0.1, 0.0)
    camera = CameraRecord(tuple(sign * number for number in numbers), 640, 360)
    out = io.StringIO()
    states = [state(0, "car7", 0.0, 20.0), state(0, "car7", 0.0, -20.0)]
    report = write_tracks_mot(states, out, frames=[(1, 0)], car_numbers={"car7": 1}, camera=camera)
    assert (len(out.getvalue().splitlines()), report) == (1, MotReport(without_frame=0, outside=1))


def test_corners_turn_with_the_heading() -> None:
    corners = footprint_corners(state(0, "car7", heading_rad=math.pi / 2, length_m=4.0, width_m=2.0))
    assert [(round(x, 9), round(y, 9)) for x, y in corners] == [(-1, 2), (-1, -2), (1, -2), (1, 2)]


def _mot(states: list[CarState]) -> list[str]:
    out = io.StringIO()
    write_tracks_mot(states, out, frames=[(1, 0), (2, 40_000)], car_numbers={"car7": 3}, camera=CAMERA)
    return out.getvalue().splitlines()


def test_a_moving_camera_has_boxes_where_it_looked_and_none_while_it_was_lost() -> None:
    a, b, c, d, e, f, *last = CAMERA.pixel_from_ground
    aside = (a, b, c + 50.0, d, e, f - 20.0, *last)  # everything 50 px to the right and 20 px up
    views = [ViewRecord(0, CAMERA.pixel_from_ground), ViewRecord(40_000, aside), ViewRecord(80_000, ())]
    states = [state(t_us, "car7", 10.0, 5.0) for t_us in (0, 40_000, 80_000, 120_000)]
    frames = [(k + 1, 40_000 * k) for k in range(4)]
    out = io.StringIO()
    report = write_tracks_mot(states, out, frames=frames, car_numbers={"car7": 3}, camera=CAMERA, views=views)
    assert (len(out.getvalue().splitlines()), report) == (2, MotReport(without_frame=0, outside=2))
    boxes = [[float(text) for text in line.split(",")[2:6]] for line in out.getvalue().splitlines()]
    assert boxes == [[179.0, 142.5, 45.0, 18.0], [229.0, 122.5, 45.0, 18.0]]
