"""Names that are trusted: the same one is the same car, however long it was away, unless nobody could come so fast."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import pytest

from anchoring.anchorer import Anchorer
from anchoring.observations import Cars, LinkChange
from anchoring.settings import AnchoringSettings
from tests.anchoring.support import Seen, run, straight_road

S = 1_000_000
ROW_US = 100_000


FORGETFUL = AnchoringSettings(survive_us=3 * S)
"""Evidence finds nobody who was away for longer; names do."""


def east(t_us: int, x_m: float = 0.0) -> Seen:
    """Show a car that keeps to its lane at 10 m/s."""
    return Seen(x_m + 10 * t_us / S, -1.75, 10.0, 0.0)


def told(
    scene: Callable[[int], Mapping[str, Seen]], seconds: float, *, anchorer: Anchorer | None = None
) -> tuple[list[Cars], list[LinkChange]]:
    """Anchor a scene of ten rows a second, with names that are trusted unless another anchorer is given."""
    frames = [(t_us, scene(t_us)) for t_us in range(0, int(seconds * S), ROW_US)]
    return run(anchorer or Anchorer(straight_road(), trusts_ids=True), frames)


def away(start_us: int, end_us: int, x_m: float = 0.0) -> Callable[[int], Mapping[str, Seen]]:
    """Show a car but for a while, after which it is somewhere else by so much."""
    return lambda t_us: {} if start_us <= t_us < end_us else {"v": east(t_us, x_m if t_us >= end_us else 0.0)}


@pytest.mark.parametrize("gap_us", [ROW_US, 2 * S, 4 * S, 60 * S])
def test_a_name_that_comes_back_is_the_same_car_at_once(gap_us: int) -> None:
    cars, _ = told(away(2 * S, 2 * S + gap_us), gap_us / S + 4)
    back = cars[(2 * S + gap_us) // ROW_US]
    assert (back.ids, back.vision_ids, back.linked.tolist()) == (("car1",), ("v",), [True])
    assert {name for now in cars for name in now.ids} == {"car1"}


def test_nobody_believes_the_names_of_our_own_tracker() -> None:
    cars, _ = told(away(2 * S, 6 * S), 8, anchorer=Anchorer(straight_road(), FORGETFUL))
    assert {name for now in cars for name in now.ids} == {"car1", "car2"}


def test_a_car_may_have_stood_or_turned_while_nobody_saw_it() -> None:
    def scene(t_us: int) -> Mapping[str, Seen]:
        back = replace(east(t_us - 2 * (t_us - 2 * S)), speed_mps=10.0, heading_rad=3.1, y_m=1.75)
        return {"v": east(t_us)} if t_us < 2 * S else {"v": back} if t_us >= 4 * S else {}

    cars, changes = told(scene, 6)
    assert {name for now in cars for name in now.ids} == {"car1"}
    assert not [one for one in changes if one.kind == "refuted"]


def test_what_came_too_fast_is_another_car_and_is_counted() -> None:
    anchorer = Anchorer(straight_road(), trusts_ids=True)
    cars, _ = told(away(2 * S, 3 * S, x_m=100.0), 5, anchorer=anchorer)
    assert cars[-1].ids == ("car2",)
    assert anchorer.refused == {"returns refused": 1}


def test_a_name_that_jumps_while_it_is_seen_is_another_car_and_is_counted() -> None:
    anchorer = Anchorer(straight_road(), trusts_ids=True)
    cars, _ = told(lambda t_us: {"v": east(t_us, 60.0 if t_us >= 2 * S else 0.0)}, 4, anchorer=anchorer)
    assert cars[-1].ids == ("car2",)
    assert anchorer.refused == {"jumps refused": 1}


def test_one_wild_row_does_not_end_a_car() -> None:
    anchorer = Anchorer(straight_road(), trusts_ids=True)
    cars, _ = told(lambda t_us: {"v": east(t_us, 500.0 if t_us == 2 * S else 0.0)}, 4, anchorer=anchorer)
    assert {name for now in cars for name in now.ids} == {"car1"}
    assert cars[-1].linked.all()
    assert anchorer.refused == {"jumps refused": 1}


@pytest.mark.parametrize("until_us", [2 * S, 60 * S])
def test_a_car_that_was_taken_for_another_name_goes_back_to_its_own(until_us: int) -> None:
    def scene(t_us: int) -> Mapping[str, Seen]:
        """Let another name stand where the car would be, until the car's own comes back from behind."""
        own = {"v": east(t_us)} if t_us < 2 * S else {"v": east(t_us, -30.0)} if t_us >= 3 * S else {}
        return own | ({"u": east(t_us)} if 2.5 * S <= t_us < until_us else {})

    def lasting(t_us: int) -> Mapping[str, Seen]:
        return scene(t_us) if until_us < 60 * S else scene(t_us) | ({"u": east(t_us)} if t_us >= 2.5 * S else {})

    cars, changes = told(lasting, 5)
    last = dict(zip(cars[-1].vision_ids, cars[-1].ids, strict=True))
    assert last == ({"v": "car1"} if until_us < 60 * S else {"v": "car1", "u": "car2"})
    assert [one.lower for one in changes if one.kind == "refuted"] == ([] if until_us < 60 * S else ["u"])


def test_a_refuted_name_is_not_believed_again() -> None:
    def scene(t_us: int) -> Mapping[str, Seen]:
        """Exchange the names of two cars that meet, and hide both a second later."""
        there, back = east(t_us), Seen(40 - 10 * t_us / S, 1.75, 10.0, 3.14159)
        names = ("v", "w") if t_us < 2 * S else ("w", "v")
        return dict(zip(names, (there, back), strict=True))

    anchorer = Anchorer(straight_road(), trusts_ids=True)
    cars, _ = told(scene, 5, anchorer=anchorer)
    assert dict(zip(cars[-1].ids, cars[-1].vision_ids, strict=True)) == {"car1": "w", "car2": "v"}


def test_links_of_a_car_that_comes_back_after_its_end_are_told_and_on_trial_again() -> None:
    _, changes = told(away(2 * S, 6 * S), 8, anchorer=Anchorer(straight_road(), FORGETFUL, trusts_ids=True))
    assert [(one.kind, one.lower, one.upper) for one in changes if one.t_us > 2 * S] == [
        ("ended", "r1", "car1"),
        ("ended", "w1", "r1"),
        ("ended", "", "w1"),
        ("reestablished", "v", "w1"),
        ("reestablished", "w1", "r1"),
        ("reestablished", "r1", "car1"),
    ]
    assert [one.label for one in changes if one.kind == "reestablished"] == ["v->w1#4", "w1->r1#5", "r1->car1#6"]


def test_a_car_off_the_road_is_off_the_road_when_it_comes_back() -> None:
    def scene(t_us: int) -> Mapping[str, Seen]:
        on = t_us < 2 * S or t_us > 9.5 * S
        shown = replace(east(t_us), y_m=-1.75 if on else -8.0)
        return {} if 5 * S <= t_us < 9 * S else {"v": shown}

    settings = AnchoringSettings(jump_m=20.0)
    cars, _ = told(scene, 11, anchorer=Anchorer(straight_road(), settings, trusts_ids=True))
    assert cars[9 * S // ROW_US].ids == ()
    assert cars[-1].ids == ("car1",)


def test_what_went_longest_ago_is_forgotten_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("anchoring.anchorer.MOST_AWAY", 1)

    def scene(t_us: int) -> Mapping[str, Seen]:
        first, second = ({"a": east(t_us)}, {"b": east(t_us, 100.0)})
        return first | second if t_us < 2 * S or t_us >= 8 * S else second if t_us < 2.5 * S else {}

    cars, _ = told(scene, 10, anchorer=Anchorer(straight_road(), FORGETFUL, trusts_ids=True))
    assert dict(zip(cars[-1].vision_ids, cars[-1].ids, strict=True)) == {"a": "car3", "b": "car2"}
