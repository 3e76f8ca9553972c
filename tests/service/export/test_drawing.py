"""Overlays: what is drawn when, and where."""

import numpy as np
import pytest

from gis.cameras.camera import GroundCamera
from service.export.drawing import OverlayReader, colour_of, draw_overlay
from service.records.events import ChronicleRef, EventRecord
from service.records.seen import CarState

SECOND = 1_000_000
CAMERA = GroundCamera.from_homography(np.linalg.inv([[10.0, 0.0, 0.0], [0.0, -10.0, 99.0], [0.0, 0.0, 1.0]]))


def state(t_us: int, x_m: float, *, car: str = "car1", linked: bool = True) -> CarState:
    return CarState(
        t_us=t_us, car=car, x_m=x_m, y_m=5.0, heading_rad=0.0, speed_mps=1.0, length_m=4.0, width_m=2.0, linked=linked
    )


def event(start_us: int, end_us: int) -> EventRecord:
    return EventRecord(
        id="r-1",
        seq=1,
        type="overtake",
        chronicle=ChronicleRef("overtake", "1"),
        source="v.mp4",
        run="r",
        start="",
        end="",
        start_us=start_us,
        end_us=end_us,
        roles={"overtaker": "car1"},
        status="recognised",
        hypotheses=(),
        sub_events=(),
        place=None,
        recognised_us=end_us,
    )


def test_reader_gives_the_cars_of_the_frame_and_their_recent_trails() -> None:
    reader = OverlayReader([state(t * SECOND, float(t)) for t in range(8)], [])
    reader.at(0)
    overlay = reader.at(6 * SECOND)
    assert [car.x_m for car in overlay.cars] == [6.0]
    assert overlay.trails["car1"][:, 0].tolist() == [3.0, 4.0, 5.0, 6.0]


def test_frame_without_states_has_no_cars_but_keeps_the_trails() -> None:
    overlay = OverlayReader([state(0, 1.0)], []).at(SECOND)
    assert not overlay.cars
    assert list(overlay.trails) == ["car1"]


def test_hidden_car_is_shown_between_its_rows_where_it_drives_on() -> None:
    rows = [state(0, 1.0), state(SECOND, 2.0, linked=False), state(1_200_000, 2.3, linked=False)]
    reader = OverlayReader(rows, [])
    shown = [[round(car.x_m, 2) for car in reader.at(t_us).cars] for t_us in (100_000, 1_100_000, 1_250_000, 1_600_000)]
    assert shown == [[], [2.1], [2.35], []]


def test_trail_of_a_car_that_is_gone_ends() -> None:
    reader = OverlayReader([state(0, 1.0)], [])
    assert not reader.at(4 * SECOND).trails


def test_event_is_shown_while_it_goes_on_and_a_moment_longer() -> None:
    reader = OverlayReader([], [event(2 * SECOND, 3 * SECOND)])
    shown = [bool(reader.at(t).events) for t in (SECOND, 2 * SECOND, 4 * SECOND, 5 * SECOND)]
    assert shown == [False, True, True, False]


def test_box_is_drawn_in_the_colour_of_the_car_where_it_is() -> None:
    picture = np.zeros((100, 200, 3), np.uint8)
    drawn = draw_overlay(picture, OverlayReader([state(0, 10.0)], []).at(0), CAMERA)
    assert tuple(drawn[99 - 40, 100].tolist()) == colour_of("car1")
    assert not picture.any()
    assert not drawn[:, :60].any()


@pytest.mark.parametrize("name", ["car1", "car2", "car999"])
def test_colour_belongs_to_the_name_and_is_bright(name: str) -> None:
    assert colour_of(name) == colour_of(name)
    assert max(colour_of(name)) > 200


def drawn_pixels(picture: np.ndarray, car: str = "car1") -> int:
    return int((picture == np.array(colour_of(car), np.uint8)).all(axis=-1).sum())


def test_predicted_car_has_a_dashed_box() -> None:
    picture = np.zeros((100, 200, 3), np.uint8)
    closed, dashed = (
        draw_overlay(picture, OverlayReader([state(0, 10.0, linked=linked)], []).at(0), CAMERA)
        for linked in (True, False)
    )
    rows, columns = slice(35, 65), slice(75, 115)  # the box alone, without the name beside it
    assert 0.3 < drawn_pixels(dashed[rows, columns]) / drawn_pixels(closed[rows, columns]) < 0.8


def test_lost_view_is_said_and_no_car_drawn() -> None:
    picture = np.zeros((100, 200, 3), np.uint8)
    drawn = draw_overlay(picture, OverlayReader([state(0, 10.0)], []).at(0), None)
    assert not drawn_pixels(drawn)
    assert drawn[80:].any()
    assert not drawn[:80].any()


def test_what_is_behind_the_camera_is_left_out() -> None:
    """An oblique camera whose horizon lies at x = 20 m."""
    pixel_from_ground = [[10.0, 0.0, 0.0], [0.0, -10.0, 99.0], [-0.05, 0.0, 1.0]]
    oblique = GroundCamera.from_homography(np.linalg.inv(pixel_from_ground))
    picture = np.zeros((100, 200, 3), np.uint8)
    states = [state(0, 10.0), state(0, 40.0, car="car2"), state(SECOND, 40.0), state(SECOND, 10.0, car="car3")]
    reader = OverlayReader(states, [])
    assert not drawn_pixels(draw_overlay(picture, reader.at(0), oblique), "car2")
    later = draw_overlay(picture, reader.at(SECOND), oblique)  # the trail of car1 goes to where nothing is seen
    assert drawn_pixels(later, "car3")
