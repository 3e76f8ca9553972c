"""Car symbols through loss, return, mix-ups and ghosts."""

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from anchoring.anchorer import Anchorer
from anchoring.errors import AnchoringError
from anchoring.hypotheses.conditions import Verdict
from anchoring.hypotheses.language import default_linkage
from anchoring.observations import Observations
from anchoring.settings import AnchoringSettings
from tests.anchoring.support import BEND_RADIUS_M, Seen, bend, observations, run, straight_road
from tests.cases import first_kept

FRAME_US = 40_000
S = 1_000_000
Scene = Callable[[float], Mapping[str, Seen]]


def film(scene: Scene, seconds: float, *, period_us: int = FRAME_US) -> list[tuple[int, Mapping[str, Seen]]]:
    """Sample a scene, a function of time in seconds, at a constant rate."""
    return [(t_us, scene(t_us / S)) for t_us in range(0, int(seconds * S), period_us)]


def east(x_m: float, speed_mps: float = 10.0) -> Seen:
    return Seen(x_m, -1.75, speed_mps, 0.0)


def west(x_m: float, speed_mps: float = 10.0) -> Seen:
    return Seen(x_m, 1.75, speed_mps, math.pi)


def on_bend(seconds: float) -> Seen:
    """Drive 10 m/s along the outer lane of the bend."""
    radius_m = BEND_RADIUS_M + 1.75
    angle = 10.0 * seconds / radius_m
    x_m, y_m = radius_m * math.sin(angle), BEND_RADIUS_M - radius_m * math.cos(angle)
    return Seen(x_m, y_m, 10.0, math.remainder(angle, 2 * math.pi))


def test_car_is_established_after_four_tenths_of_a_second() -> None:
    cars, changes = run(Anchorer(straight_road()), film(lambda t: {"v1": east(10 * t)}, 1.0))
    first = next(k for k, now in enumerate(cars) if now.ids)
    assert first * FRAME_US == 400_000
    assert cars[first].ids == ("car1",)
    assert [(c.kind, c.level, c.lower, c.upper) for c in changes] == [
        ("established", "world", "v1", "w1"),
        ("established", "on_road", "w1", "r1"),
        ("established", "car", "r1", "car1"),
    ]


def test_cars_say_where_they_are_on_the_road() -> None:
    cars, _ = run(Anchorer(straight_road()), film(lambda t: {"v1": east(10 * t), "v2": west(100 - 5 * t)}, 1.0))
    now = cars[-1]
    assert now.positions.road.tolist() == [0, 0]
    assert now.positions.across_m.tolist() == [-1.75, 1.75]
    assert now.positions.along_m.tolist() == now.centre_m[:, 0].tolist()
    assert now.classes == ("car", "car")


@pytest.mark.parametrize("network", [straight_road(), None], ids=["road", "free space"])
def test_symbol_survives_a_second_without_its_vision_object(network: object) -> None:
    def scene(t: float) -> dict[str, Seen]:
        return {"v1": east(10 * t)} if t < 1 else {"v2": east(10 * t)} if t >= 2 else {}

    cars, changes = run(Anchorer(network), film(scene, 3.0))  # type: ignore[arg-type]  # parametrised
    assert {name for now in cars for name in now.ids} == {"car1"}
    assert [(c.kind, c.lower) for c in changes if c.level == "world"] == [
        ("established", "v1"),
        ("lost", "v1"),
        ("reestablished", "v2"),
    ]
    during = cars[1_400_000 // FRAME_US]
    assert during.linked.tolist() == [False]
    assert during.vision_ids == ("",)
    assert during.centre_m[0] == pytest.approx([14.0, -1.75])


def test_lost_car_is_predicted_along_a_bend_and_found_there() -> None:
    def scene(t: float) -> dict[str, Seen]:
        return {"v1": on_bend(t)} if t < 2 else {"v2": on_bend(t)} if t >= 5 else {}

    settings = AnchoringSettings(predict_us=3 * S, survive_us=4 * S)
    cars, changes = run(Anchorer(bend(), settings), film(scene, 6.0))
    truth = on_bend(4.8)
    before_return = cars[int(4.8 * S) // FRAME_US]
    # The lane is longer than the reference line it is measured on.
    assert before_return.centre_m[0] == pytest.approx([truth.x_m, truth.y_m], abs=1.2)
    assert before_return.heading_rad[0] == pytest.approx(truth.heading_rad, abs=0.06)
    assert cars[-1].ids == ("car1",)
    assert [c.lower for c in changes if c.kind == "reestablished"] == ["v2"]


def test_prediction_is_given_out_for_a_second_and_the_symbol_kept_for_longer() -> None:
    def scene(t: float) -> dict[str, Seen]:
        return {"v1": east(10 * t)} if t < 1 else {"v2": east(10 * t)} if t >= 3.5 else {}

    cars, _ = run(Anchorer(straight_road()), film(scene, 4.0))
    given = [k * FRAME_US for k, now in enumerate(cars) if now.ids]
    gap = [(a, b) for a, b in itertools.pairwise(given) if b - a > FRAME_US]
    assert gap == [(1_960_000, 3_520_000)]  # known again in the first frame
    assert {name for now in cars for name in now.ids} == {"car1"}


def test_car_that_stays_away_ends_and_another_symbol_follows() -> None:
    def scene(t: float) -> dict[str, Seen]:
        return {"v1": east(10 * t)} if t < 1 else {"v2": east(10 * t)} if t >= 5 else {}

    cars, changes = run(Anchorer(straight_road(), AnchoringSettings(survive_us=3 * S)), film(scene, 6.0))
    assert cars[-1].ids == ("car2",)
    assert [(c.level, c.upper) for c in changes if c.kind == "ended"] == [
        ("car", "car1"),
        ("on_road", "r1"),
        ("world", "w1"),
    ]


def test_coasting_vision_object_gives_a_predicted_car_with_its_name() -> None:
    def scene(t: float) -> dict[str, Seen]:
        seen = on_bend(t)
        # A tracker that knows no roads goes straight on.
        return {"v1": seen if t < 2 else replace(on_bend(2), observed=False)}

    cars, changes = run(Anchorer(bend()), film(scene, 2.8))
    assert cars[-1].linked.tolist() == [False]
    assert cars[-1].vision_ids == ("v1",)
    truth = on_bend(2.76)
    assert cars[-1].centre_m[0] == pytest.approx([truth.x_m, truth.y_m], abs=0.5)
    assert not [c for c in changes if c.kind == "lost"]


def test_new_vision_object_on_a_coasting_car_takes_it_over() -> None:
    def scene(t: float) -> dict[str, Seen]:
        if t < 1:
            return {"v1": east(10 * t)}
        seen = {"v1": replace(east(10 * t), observed=False)}
        return seen | ({"v2": east(10 * t + 0.3)} if t >= 1.2 else {})

    cars, changes = run(Anchorer(straight_road()), film(scene, 2.5))
    assert {name for now in cars for name in now.ids} == {"car1"}
    assert cars[-1].vision_ids == ("v2",)
    assert [(c.kind, c.lower) for c in changes if c.level == "world"] == [
        ("established", "v1"),
        ("lost", "v1"),
        ("reestablished", "v2"),
    ]


def test_car_that_is_seen_again_and_taken_over_at_once_is_filled_once() -> None:
    anchorer, filled = Anchorer(straight_road()), list[tuple[str, ...]]()
    for k in range(60):
        mine, other = Seen(100.0 + k, -1.75), Seen(96.0 + k, -0.75, observed=k < 40 or k % 2 == 0)
        seen = (
            {"v1": mine} if k < 20 else {"v2": other} if 36 <= k < 48 else {"v2": other, "v3": mine} if k > 47 else {}
        )
        _, changes = anchorer.observe(observations(k * 100_000, seen))
        filled += [then.ids for then in anchorer.filled if any(change.kind == "refuted" for change in changes)]
    assert set(filled) == {("car1",)}


def test_two_cars_that_meet_out_of_sight_keep_their_symbols() -> None:
    def scene(t: float) -> dict[str, Seen]:
        if t < 1:
            return {"v1": east(10 * t), "v2": west(35 - 10 * t)}
        return {"v3": west(35 - 10 * t), "v4": east(10 * t)} if t >= 2.5 else {}

    cars, _ = run(Anchorer(straight_road()), film(scene, 3.0))
    assert cars[-1].ids == ("car1", "car2")
    assert cars[-1].vision_ids == ("v4", "v3")


def test_overtake_out_of_sight_keeps_both_symbols() -> None:
    def scene(t: float) -> dict[str, Seen]:
        slow, fast = east(40 + 10 * t), east(18 + 22 * t, 22.0)
        if t < 1:
            return {"v1": slow, "v2": replace(fast, y_m=-0.5)}
        return {"v3": slow, "v4": replace(fast, y_m=1.5)} if t >= 2.8 else {}

    cars, _ = run(Anchorer(straight_road()), film(scene, 3.4))
    assert cars[-1].ids == ("car1", "car2")
    assert cars[-1].vision_ids == ("v3", "v4")


def test_vision_ids_swapped_by_oncoming_cars_are_refuted_and_linked_the_right_way() -> None:
    def scene(t: float) -> dict[str, Seen]:
        there, back = east(10 * t), west(40 - 10 * t)
        if t < 2:
            return {"v1": there, "v2": back}
        # After the meeting the tracker goes on with the wrong car; its headings follow within 0.2 s.
        if t < 2.2:
            return {"v1": replace(back, heading_rad=0.0), "v2": replace(there, heading_rad=math.pi)}
        return {"v1": back, "v2": there}

    cars, changes = run(Anchorer(straight_road()), film(scene, 4.0))
    refuted = [c for c in changes if c.kind == "refuted"]
    assert sorted((c.lower, c.upper) for c in refuted) == [("v1", "w1"), ("v2", "w2")]
    assert all("same_heading" in c.reason for c in refuted)
    assert refuted[0].t_us <= 2_600_000
    assert cars[-1].ids == ("car1", "car2")
    assert cars[-1].vision_ids == ("v2", "v1")
    assert cars[-1].centre_m[0, 0] > cars[-1].centre_m[1, 0]


def test_vision_ids_swapped_while_overtaking_are_refuted_by_their_speed() -> None:
    def scene(t: float) -> dict[str, Seen]:
        slow, fast = east(40 + 8 * t, 8.0), replace(east(28 * t, 28.0), y_m=1.75)
        swapped = {"v1": fast, "v2": slow}
        return {"v1": slow, "v2": fast} if t < 2 else swapped

    cars, changes = run(Anchorer(straight_road()), film(scene, 4.0))
    assert "same_speed" in next(c for c in changes if c.kind == "refuted").reason
    assert cars[-1].ids == ("car1", "car2")
    assert cars[-1].vision_ids == ("v2", "v1")


def test_vision_ids_swapped_side_by_side_are_refuted_because_the_other_car_fits_better() -> None:
    def scene(t: float) -> dict[str, Seen]:
        slow, fast = east(40 + 8 * t, 8.0), replace(east(24 + 16 * t, 16.0), y_m=1.75)
        return {"v1": slow, "v2": fast} if t < 2 else {"v1": fast, "v2": slow}

    cars, changes = run(Anchorer(straight_road()), film(scene, 4.0))
    refuted = [c for c in changes if c.kind == "refuted"]
    assert {c.upper for c in refuted} == {"w1", "w2"}
    assert all("not_swapped" in c.reason for c in refuted)
    assert cars[-1].ids == ("car1", "car2")
    assert cars[-1].vision_ids == ("v2", "v1")


def test_vision_object_that_slips_to_a_car_whose_own_is_lost_is_refuted() -> None:
    def scene(t: float) -> dict[str, Seen]:
        slow, fast = east(40 + 8 * t, 8.0), replace(east(20 + 18 * t, 18.0), y_m=1.75)
        if t < 2:
            return {"v1": slow, "v2": fast}
        return {"v1": fast} | ({"v3": slow} if t > 2.3 else {})

    cars, changes = run(Anchorer(straight_road()), film(scene, 4.0))
    assert [(c.lower, c.upper) for c in changes if c.kind == "refuted"] == [("v1", "w1")]
    assert cars[-1].ids == ("car1", "car2")
    assert cars[-1].vision_ids == ("v3", "v1")


def test_vision_object_that_jumps_to_another_place_is_refuted() -> None:
    def scene(t: float) -> dict[str, Seen]:
        return {"v1": east(10 * t if t < 1 else 10 * t + 60)}

    cars, changes = run(Anchorer(straight_road()), film(scene, 3.0))
    assert [(c.lower, c.upper, c.reason) for c in changes if c.kind == "refuted"] == [
        ("v1", "w1", "no longer: no_jump")
    ]
    assert cars[1_040_000 // FRAME_US].vision_ids == ("",)
    assert cars[-1].ids == ("car2",)


def test_a_jump_within_what_is_known_of_a_place_is_no_jump() -> None:
    def refuted(sigma_m: float) -> bool:
        anchorer, kinds = Anchorer(straight_road()), list[str]()
        for number in range(30):
            x_m = 10.0 * number * FRAME_US * 1e-6 + (6.0 if number >= 15 else 0.0)
            seen = observations(number * FRAME_US, {"v1": east(x_m)})
            _, changes = anchorer.observe(replace(seen, sigma_m=np.array([sigma_m])))
            kinds += [change.kind for change in changes]
        return "refuted" in kinds

    assert refuted(0.2)
    assert not refuted(2.0)


def test_a_car_whose_front_is_known_only_once_it_drives_is_the_same_car() -> None:
    anchorer, kinds = Anchorer(straight_road()), list[str]()
    for number in range(80):
        t_s = number * FRAME_US * 1e-6
        seen = observations(number * FRAME_US, {"v1": east(2.0 * t_s**2, 4.0 * t_s)})
        backwards = replace(seen, heading_rad=np.array([math.pi]))
        cars, changes = anchorer.observe(backwards if t_s < 1.6 else seen)
        kinds += [change.kind for change in changes]
    assert "refuted" not in kinds
    assert cars.ids == ("car1",)


def test_vision_object_that_grows_is_refuted() -> None:
    def scene(t: float) -> dict[str, Seen]:
        return {"v1": replace(east(10 * t), length_m=4.5 if t < 2 else 12.0)}

    _, changes = run(Anchorer(straight_road()), film(scene, 4.0))
    refuted = [c for c in changes if c.kind == "refuted"]
    assert "same_size" in refuted[0].reason
    assert refuted[0].t_us == pytest.approx(3 * S, abs=2 * FRAME_US)


@pytest.mark.parametrize(
    "scene",
    [
        pytest.param(lambda t: {"v1": east(10 * t)} if t < 0.36 else {}, id="short"),
        pytest.param(lambda t: {"v1": replace(east(10 * t), y_m=30.0)}, id="off the road"),
        pytest.param(lambda t: {"v1": replace(east(10 * t), width_m=9.0)}, id="too wide"),
        pytest.param(lambda t: {"v1": replace(east(10 * t), length_m=0.4, width_m=0.4)}, id="too small"),
        pytest.param(lambda t: {"v1": east(90 * t, 90.0)}, id="too fast"),
        pytest.param(lambda t: {"v1": replace(east(10 * t), observed=int(t * 25) % 5 != 0)}, id="flickering"),
    ],
)
def test_ghost_never_becomes_a_car(scene: Scene) -> None:
    cars, changes = run(Anchorer(straight_road()), film(scene, 3.0))
    assert not any(now.ids for now in cars)
    assert not [c for c in changes if c.level == "car"]


def test_fragment_inside_a_car_never_becomes_one() -> None:
    def scene(t: float) -> dict[str, Seen]:
        return {"v1": east(10 * t)} | ({"v2": replace(east(10 * t + 1), length_m=2.0)} if t > 1 else {})

    cars, _ = run(Anchorer(straight_road()), film(scene, 3.0))
    assert {name for now in cars for name in now.ids} == {"car1"}


def test_car_leaving_the_view_ends_without_prediction_beyond_the_edge() -> None:
    def scene(t: float) -> dict[str, Seen]:
        return {"v1": replace(east(10 * t), clipped=t < 0.3 or t > 1.7)} if t < 2 else {}

    cars, changes = run(Anchorer(straight_road()), film(scene, 3.0))
    assert [(c.t_us, c.reason) for c in changes if c.kind == "ended" and c.level == "car"] == [
        (2_200_000, "left the view")
    ]
    assert not any(now.ids for now in cars[2_200_000 // FRAME_US :])


def test_size_is_the_median_of_what_was_seen_in_full() -> None:
    rng = np.random.default_rng(0)

    def scene(t: float) -> dict[str, Seen]:
        clipped = t < 0.5
        length_m = 1.8 if clipped else 4.5 + rng.normal(0, 0.3)
        return {"v1": replace(east(10 * t), length_m=length_m, clipped=clipped)}

    cars, _ = run(Anchorer(straight_road()), film(scene, 6.0))
    assert cars[-1].length_m[0] == pytest.approx(4.5, abs=0.25)
    steps_m = np.abs(np.diff([now.length_m[0] for now in cars[60:]]))
    assert steps_m.max() < 0.15


def test_two_lost_cars_that_could_be_either_are_not_linked_until_it_is_clear() -> None:
    def scene(t: float) -> dict[str, Seen]:
        if t < 1:
            return {"v1": east(10 * t), "v2": east(10 * t + 5)}
        return {"v3": east(10 * t + 2.5)} if t >= 2 else {}

    _, changes = run(Anchorer(straight_road()), film(scene, 3.5))
    assert not [c for c in changes if c.kind == "reestablished"]
    # It waits longer than usual, then is something new.
    assert [c.t_us for c in changes if c.kind == "established" and c.lower == "v3"] == [2_800_000]


def test_car_in_view_together_with_the_lost_one_is_not_taken_for_it() -> None:
    def scene(t: float) -> dict[str, Seen]:
        lost = {"v1": east(20 + 10 * t)} if t < 1 else {}
        return lost | ({"v2": replace(east(20 + 10 * t), y_m=-0.2)} if t >= 0.7 else {})

    cars, changes = run(Anchorer(straight_road()), film(scene, 2.5))
    assert not [c for c in changes if c.kind == "reestablished"]
    assert cars[-1].ids == ("car2",)


def test_car_off_the_road_is_not_given_out_but_keeps_its_symbol() -> None:
    def scene(t: float) -> dict[str, Seen]:
        return {"v1": replace(east(10 * t), y_m=-1.75 if t < 1 or t > 5 else -12.0, speed_mps=10.0)}

    settings = AnchoringSettings(jump_m=20.0)
    cars, changes = run(Anchorer(straight_road(), settings), film(scene, 7.0))
    assert [(c.kind, c.level) for c in changes[3:]] == [("refuted", "on_road"), ("reestablished", "on_road")]
    assert cars[4 * S // FRAME_US].ids == ()
    assert cars[-1].ids == ("car1",)


def test_trajectories_at_five_hertz_make_cars_too() -> None:
    scene: Scene = lambda t: {f"v{k}": east(30 * k + 10 * t) for k in range(100)}  # noqa: E731
    cars, changes = run(Anchorer(straight_road(4000.0)), film(scene, 4.0, period_us=200_000))
    assert [len(now.ids) for now in cars[:4]] == [0, 0, 100, 100]
    assert cars[-1].ids == tuple(f"car{k + 1}" for k in range(100))
    assert {c.kind for c in changes} == {"established"}


class NeverEstablish:
    """Stands for a formula of a temporal logic."""

    is_idle = False

    def progress(self, t_us: int, state: Mapping[str, bool]) -> Verdict:
        assert {"visible", "on_road", "size_ok"} <= state.keys()
        return Verdict.UNKNOWN


def test_conditions_can_be_replaced() -> None:
    usual = default_linkage(AnchoringSettings())
    world, on_road, car = usual.linkages
    linkage = usual._replace(linkages=(world, on_road, replace(car, establish=NeverEstablish)))
    cars, changes = run(Anchorer(straight_road(), linkage=linkage), film(lambda t: {"v1": east(10 * t)}, 2.0))
    assert not any(now.ids for now in cars)
    assert [c.level for c in changes] == ["world", "on_road"]


@pytest.mark.parametrize(
    "seed", [*first_kept(range(3)), *(pytest.param(one, marks=pytest.mark.slow) for one in range(3, 16))]
)
def test_one_car_has_one_vision_object_and_the_other_way_round(seed: int) -> None:
    rng = np.random.default_rng(seed)
    frames = random_tracks(rng, seconds=12.0)
    cars, changes = run(Anchorer(straight_road() if seed % 2 else None), frames)
    for (t_us, seen), now in zip(frames, cars, strict=True):
        linked = [name for name in now.vision_ids if name]
        assert len(set(linked)) == len(linked)
        assert len(set(now.ids)) == len(now.ids)
        assert set(linked) <= set(seen)
        assert now.t_us == t_us
        assert all(name for name, is_linked in zip(now.vision_ids, now.linked, strict=True) if is_linked)
        assert np.isfinite(now.centre_m).all()
    upper: dict[str, str] = {}
    lower: dict[str, str] = {}
    for change in (change for change in changes if change.level == "world"):
        if change.kind in {"established", "reestablished"}:
            assert change.lower not in upper
            assert change.upper not in lower
            upper[change.lower], lower[change.upper] = change.upper, change.lower
        elif change.kind in {"lost", "refuted"}:
            assert upper.pop(change.lower) == change.upper
            assert lower.pop(change.upper) == change.lower


@pytest.mark.long
def test_same_input_gives_the_same_output() -> None:
    frames = random_tracks(np.random.default_rng(3), seconds=8.0)
    first, second = (run(Anchorer(straight_road()), frames) for _ in range(2))
    assert first[1] == second[1]
    assert [(now.ids, now.vision_ids) for now in first[0]] == [(now.ids, now.vision_ids) for now in second[0]]


def random_tracks(rng: np.random.Generator, *, seconds: float) -> list[tuple[int, dict[str, Seen]]]:
    """Drive ten cars both ways; tracks break, coast, swap and jump at random."""
    start_m, speed = rng.uniform(0, 150, 10), rng.uniform(5, 25, 10)
    names, next_name = {k: f"v{k}" for k in range(10)}, 10
    hidden_until = np.zeros(10)
    frames = []
    for t_us in range(0, int(seconds * S), FRAME_US):
        t = t_us / S
        seen = {}
        for k in range(10):
            if rng.random() < 0.01:
                hidden_until[k] = t + rng.uniform(0.1, 3.0)
                names[k], next_name = f"v{next_name}", next_name + 1
            if rng.random() < 0.003:
                other = int(rng.integers(10))
                names[k], names[other] = names[other], names[k]
            car = (
                east(start_m[k] + speed[k] * t, speed[k]) if k % 2 else west(300 - start_m[k] - speed[k] * t, speed[k])
            )
            if t >= hidden_until[k]:
                seen[names[k]] = replace(car, observed=bool(rng.random() < 0.95), x_m=car.x_m + rng.normal(0, 0.1))
        frames.append((t_us, seen))
    return frames


def test_empty_frames_are_fine() -> None:
    cars, changes = run(Anchorer(straight_road()), [(0, {}), (1, {})])
    assert [now.ids for now in cars] == [(), ()]
    assert changes == []


def test_frame_that_is_not_later_is_refused() -> None:
    anchorer = Anchorer(None)
    anchorer.observe(observations(7, {}))
    with pytest.raises(AnchoringError, match="expected a frame after 7 us, got one at 7 us"):
        anchorer.observe(observations(7, {}))


def test_linkages_must_lead_from_world_object_to_car() -> None:
    usual = default_linkage(AnchoringSettings())
    with pytest.raises(AnchoringError, match=r"got levels \['world', 'on_road'\]"):
        Anchorer(straight_road(), linkage=usual._replace(linkages=usual.linkages[:2]))


def test_observations_refuse_arrays_of_another_length_and_double_ids() -> None:
    one = observations(0, {"v1": Seen(0.0)})
    with pytest.raises(AnchoringError, match=r"different ids, got \('a', 'a'\)"):
        replace(one, ids=("a", "a"))
    with pytest.raises(AnchoringError, match=r"points must have shape \(1, 2\), got \(2, 2\)"):
        replace(one, centre_m=np.zeros((2, 2)))
    with pytest.raises(AnchoringError, match=r"1 entries, got \(3,\)"):
        replace(one, clipped=np.zeros(3, dtype=np.bool_))


@pytest.mark.parametrize("name", ["centre_m", "velocity_mps", "heading_rad", "length_m", "width_m"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_observations_refuse_what_is_not_finite_with_its_name_and_field(name: str, value: float) -> None:
    good = observations(7, {"v1": Seen(0.0), "v2": Seen(9.0)})
    numbers = getattr(good, name).copy()
    numbers[1, ...] = value
    with pytest.raises(AnchoringError, match=f"at 7 us: {name} of 'v2': expected finite numbers, got .*{value}"):
        replace(good, **{name: numbers})


def test_settings_refuse_what_cannot_be_meant() -> None:
    with pytest.raises(AnchoringError, match="jump_m must be a number >= 0, got -1"):
        AnchoringSettings(jump_m=-1.0)
    with pytest.raises(AnchoringError, match=r"survive_us must be at least predict_us \(1000000\), got 5"):
        AnchoringSettings(survive_us=5)


def seen_surely(t_us: int, seen: Mapping[str, Seen]) -> Observations:
    return replace(observations(t_us, seen), sigma_m=np.full(len(seen), 0.1))


def seen_at(x_m: float) -> Seen:
    return Seen(x_m, speed_mps=0.0)


def test_car_has_moved_once_it_is_its_length_ahead_of_where_it_began() -> None:
    anchorer, moved = Anchorer(None), []
    for number in range(40):
        x_m = max(0, number - 10) * 0.4
        cars, _ = anchorer.observe(seen_surely(number * FRAME_US, {"v": Seen(x_m, speed_mps=5.0 if x_m else 0.0)}))
        moved.append(cars.has_moved.tolist())
    assert moved[10] == moved[21] == [False]
    assert moved[22] == [True]  # 4.8 m of 4.5 m


def test_what_jumps_before_it_has_a_name_has_not_driven_there() -> None:
    anchorer = Anchorer(None)
    for number in range(40):
        seen = replace(seen_at(0.0), observed=number % 5 < 3) if number < 20 else seen_at(8.0)
        cars, _ = anchorer.observe(seen_surely(number * FRAME_US, {"v": seen}))
    assert (cars.ids, cars.has_moved.tolist()) == (("car1",), [False])


@pytest.mark.parametrize(("back_m", "has_moved"), [(0.0, False), (5.0, True)])
def test_car_that_is_back_where_it_began_has_only_seemed_to_move(back_m: float, has_moved: bool) -> None:
    ways_m = [0.0] * 20 + [2.5] + [5.0] * 10 + [2.5, *[back_m] * 10]
    anchorer = Anchorer(None)
    told = [anchorer.observe(seen_surely(k * FRAME_US, {"v": seen_at(way_m)}))[0] for k, way_m in enumerate(ways_m)]
    assert told[25].has_moved.tolist() == [True]
    assert told[-1].has_moved.tolist() == [has_moved]


@pytest.mark.parametrize(("found_m", "has_moved"), [(2.0, False), (8.0, True)])
def test_car_that_is_found_again_where_it_began_has_only_seemed_to_move(found_m: float, has_moved: bool) -> None:
    anchorer = Anchorer(straight_road())
    for number in range(80):
        name, x_m = ("v1", 100.0 + min(5.0, 2.5 * max(0, number - 20))) if number < 30 else ("v2", 100.0 + found_m)
        seen = {} if 30 <= number < 50 else {name: Seen(x_m, -1.75, speed_mps=0.0)}
        cars, _ = anchorer.observe(seen_surely(number * FRAME_US, seen))
    assert (cars.ids, cars.vision_ids, cars.has_moved.tolist()) == (("car1",), ("v2",), [has_moved])


@pytest.mark.parametrize(("sigma_m", "is_standing"), [(0.6, True), (np.nan, False)])
def test_noise_of_two_places_is_no_way_that_a_hidden_car_has_driven(sigma_m: float, *, is_standing: bool) -> None:
    anchorer, speeds_mps = Anchorer(straight_road()), list[float]()
    for number in range(60):
        x_m = 100.0 if number < 40 else 101.0
        seen = observations(number * FRAME_US, {"v": Seen(x_m, -1.75, speed_mps=0.0, observed=not 30 <= number < 40)})
        anchorer.observe(replace(seen, sigma_m=np.array([sigma_m])))
        speeds_mps += [speed_mps for cars in anchorer.filled for speed_mps in cars.speed_mps.tolist()]
    assert speeds_mps
    assert (max(speeds_mps) < 1.0) is is_standing


def test_car_that_comes_away_against_its_front_has_not_moved() -> None:
    frames = [(number * FRAME_US, {"v": Seen(-0.1 * number, speed_mps=2.5)}) for number in range(80)]
    anchorer = Anchorer(None)
    assert [anchorer.observe(seen_surely(*frame))[0] for frame in frames][-1].has_moved.tolist() == [False]


@pytest.mark.parametrize("guessed_rad", [0.2, math.pi - 0.2, -math.pi + 0.3])
def test_front_of_a_car_that_was_seen_to_drive_stays_while_a_new_track_only_stands(guessed_rad: float) -> None:
    anchorer, told = Anchorer(straight_road()), []
    for number in range(140):
        name, x_m = ("v1", 0.8 * min(number, 45)) if number < 60 else ("v2", 36.0)
        heading_rad = guessed_rad if name == "v2" else 0.0
        seen = Seen(x_m, -1.75, speed_mps=0.0 if number >= 45 else 10.0, heading_rad=heading_rad)
        cars, _ = anchorer.observe(seen_surely(number * FRAME_US, {} if 60 <= number < 80 else {name: seen}))
        told.append((cars.ids, cars.vision_ids, bool(np.cos(cars.heading_rad[-1:]).min(initial=1.0) > 0)))
    assert told[-1] == (("car1",), ("v2",), True)
    assert all(ahead for _, _, ahead in told)


def test_car_of_which_the_tracker_does_not_say_how_sure_it_is_counts_as_moved() -> None:
    cars, _ = run(Anchorer(None), [(number * FRAME_US, {"v": Seen(0.0, speed_mps=0.0)}) for number in range(12)])
    assert cars[-1].has_moved.tolist() == [True]


def test_car_that_moved_has_moved_whatever_is_linked_to_it_later() -> None:
    anchorer = Anchorer(straight_road())
    for number in range(70):
        x_m, name = 0.8 * min(number, 45), "v1" if number < 30 else "v2"
        seen = {} if 30 <= number < 44 else {name: Seen(x_m, -1.75, 10.0 if number < 45 else 0.0)}
        cars, _ = anchorer.observe(seen_surely(number * FRAME_US, seen))
    assert (cars.ids, cars.vision_ids, cars.has_moved.tolist()) == (("car1",), ("v2",), [True])
