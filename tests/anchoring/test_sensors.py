"""Several sensors on one view: what they see of one car is one car, however each of them loses it."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from anchoring.anchorer import Anchorer
from anchoring.hypotheses.adapter import load_linkage
from anchoring.hypotheses.language import default_text
from anchoring.observations import Cars, LinkChange
from anchoring.settings import AnchoringSettings
from tests.anchoring.support import Seen, observations, straight_road

S = 1_000_000
ROW_US = 100_000
STATEMENT = ": one vision_object per sensor"


def told(
    scene: Callable[[int], Mapping[str, Seen]], seconds: float, *, anchorer: Anchorer | None = None, seed: int = 1
) -> tuple[list[Cars], list[LinkChange]]:
    """Anchor a scene of ten rows a second with noise of 0.3 m; the first letter of a track names its sensor."""
    anchorer = anchorer or Anchorer(straight_road())
    random = np.random.default_rng(seed)
    cars, changes = [], list[LinkChange]()
    for t_us in range(0, int(seconds * S), ROW_US):
        seen = observations(t_us, scene(t_us))
        noisy_m = seen.centre_m + random.normal(0.0, 0.3, seen.centre_m.shape)
        now, made = anchorer.observe(replace(seen, centre_m=noisy_m, sensors=tuple(one[0] for one in seen.ids)))
        cars.append(now)
        changes += made
    return cars, changes


def at(t_us: int, x_m: float = 0.0, y_m: float = -1.75) -> Seen:
    return Seen(x_m + 10 * t_us / S, y_m)


def names(cars: list[Cars]) -> set[str]:
    return {name for now in cars for name in now.ids}


def both(t_us: int) -> Mapping[str, Seen]:
    return {"colour1": at(t_us), "thermal1": at(t_us)}


def first_lost(t_us: int) -> Mapping[str, Seen]:
    seen = dict(both(t_us))
    if 3 * S <= t_us < 7 * S:
        del seen["colour1"]
    elif t_us >= 7 * S:
        seen["colour2"] = seen.pop("colour1")
    return seen


def test_tracks_of_two_sensors_are_one_car() -> None:
    cars, changes = told(both, 5)
    assert names(cars) == {"car1"}
    joined = [(one.lower, one.upper) for one in changes if one.kind == "joined"]
    assert joined == [("thermal1", "w1")]
    assert cars[-1].vision_ids == ("colour1",)
    assert not [one for one in changes if one.kind == "parted"]


def test_the_car_goes_on_when_the_sensor_that_leads_loses_it() -> None:
    cars, changes = told(first_lost, 10)
    assert names(cars) == {"car1"}
    assert all(now.linked.all() for now in cars)
    assert not any(now.hidden for now in cars)
    world = [
        (one.t_us // S, one.kind, one.lower) for one in changes if one.level == "world" and one.kind != "validated"
    ]
    assert world == [
        (0, "established", "colour1"),
        (0, "joined", "thermal1"),
        (3, "parted", "thermal1"),
        (3, "lost", "colour1"),
        (3, "reestablished", "thermal1"),
        (7, "joined", "colour2"),
    ]
    assert cars[-1].vision_ids == ("thermal1",)


def test_the_car_goes_on_when_the_other_sensor_loses_it() -> None:
    cars, changes = told(lambda t_us: both(t_us) if t_us < 3 * S else {"colour1": at(t_us)}, 5)
    assert names(cars) == {"car1"}
    assert all(now.linked.all() for now in cars)
    assert [(one.lower, one.reason) for one in changes if one.kind == "parted"] == [
        ("thermal1", "the vision object is gone")
    ]


def test_nothing_seen_for_a_while_parts_and_joins_again() -> None:
    cars, changes = told(lambda t_us: {} if 3 * S <= t_us < 4 * S else both(t_us), 8)
    assert names(cars) == {"car1"}
    made = [(one.t_us, one.kind) for one in changes if one.kind in ("joined", "parted")]
    assert [kind for _, kind in made] == ["joined", "parted", "joined"]
    assert made[1][0] == 3 * S
    assert cars[-1].linked.all()


def test_a_track_that_leaves_the_other_becomes_a_car_of_its_own() -> None:
    def scene(t_us: int) -> Mapping[str, Seen]:
        return {
            "colour1": at(t_us),
            "thermal1": Seen(at(t_us).x_m + 5 * max(t_us - 3 * S, 0) / S, -1.75, 10.0 if t_us < 3 * S else 15.0),
        }

    cars, changes = told(scene, 8)
    assert [one.lower for one in changes if one.kind == "parted"] == ["thermal1"]
    assert cars[-1].ids == ("car1", "car2")


@pytest.mark.long
def test_cars_side_by_side_are_not_joined_wrongly() -> None:
    def scene(t_us: int) -> Mapping[str, Seen]:
        seen = {"colour1": at(t_us), "thermal1": at(t_us, 0.0, 1.25), "colour2": at(t_us, 0.0, 1.25)}
        return (
            seen | {"thermal2": at(t_us)}
            if t_us > 2 * S
            else {"colour1": seen["colour1"], "thermal1": at(t_us, 0.0, 1.25)}
        )

    for seed in range(10):
        cars, changes = told(scene, 6, seed=seed)
        joined = {(one.lower, one.upper) for one in changes if one.kind == "joined"}
        assert joined == {("colour2", "w2"), ("thermal2", "w1")}
        assert names(cars) == {"car1", "car2"}


def test_tracks_of_one_sensor_are_never_joined() -> None:
    _, changes = told(lambda t_us: {"colour1": at(t_us), "colour2": at(t_us)}, 5)
    assert not [one for one in changes if one.kind == "joined"]


def test_three_sensors_are_one_car() -> None:
    cars, changes = told(lambda t_us: {**both(t_us), "radar1": at(t_us)}, 5)
    assert names(cars) == {"car1"}
    assert {one.lower for one in changes if one.kind == "joined"} == {"thermal1", "radar1"}


def test_a_text_without_the_statement_joins_nothing() -> None:
    assert STATEMENT in default_text()
    settings = AnchoringSettings()
    linkage = load_linkage(default_text().replace(STATEMENT, ""), settings)
    cars, changes = told(first_lost, 10, anchorer=Anchorer(straight_road(), settings, linkage=linkage))
    assert not [one for one in changes if one.kind == "joined"]
    assert not all(now.linked.all() for now in cars)  # as with one sensor: seen late, or lost at the gap
