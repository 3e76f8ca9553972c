"""Relation changes of small scenes, and of random traffic against the slow version."""

import itertools
from collections import Counter, defaultdict
from collections.abc import Collection

import numpy as np
import pytest

from qsr.changes.crossings import RelationChange, Value
from qsr.changes.line_up import Seen
from qsr.errors import QsrError
from qsr.measuring.footprints import Footprints
from qsr.observer import RelationObserver
from qsr.relations import RELATIONS
from qsr.settings import RelationSettings
from tests.cases import first_kept
from tests.contracts.tables import table
from tests.qsr.oracle import Oracle
from tests.qsr.support import changes_of, footprints, random_traffic

NAMES = {relation.name for relation in RELATIONS}
LANES = [("r0 forth", 1), ("r0 back", -1), ("r1 forth", 1), ("r1 back", -1)]


def run(
    frames: list[Footprints], settings: RelationSettings | None = None, *, only: Collection[str] | None = None
) -> list[RelationChange]:
    observer = RelationObserver(("north", "south"), ("cross",), settings, only=only)
    return [change for frame in frames for change in observer.observe(frame)]


def passing(closing_mps: float, *, seconds: float, sigma_m: float, rng: np.random.Generator) -> list[Footprints]:
    """Let a pass b at 25 frames a second, the gap going from -x to +x."""
    frames = []
    for k in range(int(seconds * 25) + 1):
        x_m = (k / 25 - seconds / 2) * closing_mps + rng.normal(0, sigma_m)
        frames.append(footprints(k * 40_000, ("a", "b"), [[x_m, 3.0], [0.0, 0.0]], straight_road=True))
    return frames


def beside_of(frames: list[Footprints], settings: RelationSettings | None) -> list[tuple[int, Value, Value]]:
    """List the changes of whether a is beside b after the first; many frames at once are told as one by one, sooner."""
    observer = RelationObserver(("north", "south"), ("cross",), settings, only=["beside"])
    told = observer.observe_all([Seen(frame) for frame in frames])
    return changes_of([change for changes in told for change in changes], "beside", "a", "b")[1:]


def known_noise(frame: Footprints) -> Footprints:
    """Let a tracker say how sure it is, and two cars stand for the first two seconds."""
    has_moved = np.array([name[-1] != "3" or frame.t_us > 2_000_000 for name in frame.ids], np.bool_)
    return frame.having(sigma_m=np.full(len(frame.ids), 0.1), has_moved=has_moved)


@pytest.mark.parametrize(
    "seed",
    [
        *first_kept(range(4)),
        *(pytest.param(one, marks=pytest.mark.slow) for one in range(4, 12)),
    ],
)
def test_observer_equals_the_slow_version_on_random_traffic(seed: int) -> None:
    rng = np.random.default_rng(seed)
    settings = RelationSettings(
        enter_radius_m=25.0,
        leave_radius_m=30.0,
        close_m=8.0,
        backdate_us=700_000,
        oncoming_enter_m=40.0,
        oncoming_leave_m=50.0,
        widest_m=2.0,
    )
    fast = RelationObserver(("r0", "r1"), ("j0",), settings, lanes=LANES)
    slow = Oracle(["r0", "r1"], ["j0"], settings, LANES)
    seen: Counter[tuple[str, bool | str | None]] = Counter()
    count, noise_m = 70 if seed == 0 else 14, float(rng.choice([0.0, 0.3]))
    for shown in random_traffic(rng, frames=60, count=count, noise_m=noise_m):
        frame = known_noise(shown) if seed % 2 else shown
        got = {(c.name, c.args): c for c in fast.observe(frame)}
        expected = {(c.name, c.args): c for c in slow.observe(frame)}
        assert got.keys() == expected.keys()
        for key, change in got.items():
            other = expected[key]
            assert (change.decided_us, change.old, change.new) == (other.decided_us, other.old, other.new)
            assert abs(change.t_us - other.t_us) <= 1  # rounding
        seen.update((change.name, change.new) for change in got.values())
    assert seen.total() > 200
    assert {"following", "oncoming", "in_lane", "forward", "against_traffic"} <= {name for name, _ in seen}


@pytest.mark.parametrize("seed", first_kept(range(3)))
def test_changes_of_one_instance_form_a_chain_in_time(seed: int) -> None:
    changes = run(list(random_traffic(np.random.default_rng(seed), frames=150, count=20, noise_m=0.8)))
    chains = defaultdict(list)
    for change in changes:
        chains[change.name, change.args].append(change)
        assert change.name in NAMES
        assert change.old is not change.new
        assert change.decided_us - 2_000_000 <= change.t_us <= change.decided_us
    for chain in chains.values():
        for before, after in itertools.pairwise(chain):
            assert after.t_us > before.t_us
            if before.name not in {"on", "in_crossing"}:  # places are false without a word
                assert after.old is before.new


def test_converse_relations_change_together() -> None:
    changes = set(run(list(random_traffic(np.random.default_rng(5), frames=120, count=20, noise_m=0.8))))
    converse = {relation.name: relation.converse for relation in RELATIONS if relation.converse}
    for change in changes:
        if change.name in converse:
            a, b = change.args
            times_and_values = (change.t_us, change.decided_us, change.old, change.new)
            assert RelationChange(converse[change.name], (b, a), *times_and_values) in changes


@pytest.mark.long
@pytest.mark.parametrize(("closing_mps", "seconds"), [(14.0, 4.0), (1.5, 24.0)], ids=["fast pass", "slow pass"])
@pytest.mark.parametrize("count", [25, pytest.param(50, marks=pytest.mark.slow)])
def test_noisy_pass_gives_one_beside_and_no_flicker(closing_mps: float, seconds: float, count: int) -> None:
    settings = RelationSettings(gap_sigma_m=0.6)
    exact, errors_s = 0, []
    for seed in range(count):
        frames = passing(closing_mps, seconds=seconds, sigma_m=0.6, rng=np.random.default_rng(seed))
        beside = beside_of(frames, settings)
        exact += [new for _, _, new in beside] == [True, False]
        truth_s = (seconds / 2 - 4.0 / closing_mps, seconds / 2 + 4.0 / closing_mps)
        errors_s += [abs(beside[0][0] / 1e6 - truth_s[0]), abs(beside[-1][0] / 1e6 - truth_s[1])]
    assert exact >= 0.96 * count
    assert np.mean(errors_s) < 0.6 / closing_mps + 0.02


@pytest.mark.long
@pytest.mark.parametrize(
    "closing", ["5 m/s", *(pytest.param(one, marks=pytest.mark.slow) for one in ("14 m/s", "3 m/s", "1.5 m/s"))]
)
def test_noisy_passes_flicker_as_often_as_the_page_says(closing: str) -> None:
    (row,) = (row for row in table("qsr.md", "closing speed") if row[0] == closing)
    closing_mps = float(closing.removesuffix(" m/s"))
    raised = RelationSettings(gap_sigma_m=0.6)
    assert [clean_passes(closing_mps, 0.6, settings) for settings in (None, raised)] == [int(row[1]), int(row[2])]


@pytest.mark.long
@pytest.mark.parametrize("closing_mps", [14.0, pytest.param(1.5, marks=pytest.mark.slow)])
def test_passes_as_noisy_as_the_shipped_setting_expects_do_not_flicker(closing_mps: float) -> None:
    assert clean_passes(closing_mps, RelationSettings().gap_sigma_m, None) == 50


def clean_passes(closing_mps: float, sigma_m: float, settings: RelationSettings | None) -> int:
    """Count the passes out of 50 that give exactly two changes of `beside`."""
    clean, seconds = 0, max(4.0, 36.0 / closing_mps)
    for seed in range(50):
        frames = passing(closing_mps, seconds=seconds, sigma_m=sigma_m, rng=np.random.default_rng(seed))
        beside = beside_of(frames, settings)
        clean += [new for _, _, new in beside] == [True, False]
    return clean


def test_pass_ends_behind_and_starts_beside_at_the_same_moment() -> None:
    changes = run(passing(10.0, seconds=4.0, sigma_m=0.0, rng=np.random.default_rng(0)))
    assert changes_of(changes, "behind", "a", "b") == [(0, None, True), (1_600_000, True, False)]
    assert changes_of(changes, "beside", "a", "b") == [
        (0, None, False),
        (1_600_000, False, True),
        (2_400_000, True, False),
    ]
    assert changes_of(changes, "ahead", "a", "b") == [(0, None, False), (2_400_000, False, True)]
    assert changes_of(changes, "ahead", "b", "a") == changes_of(changes, "behind", "a", "b")


def test_what_ends_comes_before_what_begins() -> None:
    changes = [
        c for c in run(passing(10.0, seconds=4.0, sigma_m=0.0, rng=np.random.default_rng(0))) if c.old is not None
    ]
    assert [(c.name, c.new) for c in changes if c.args == ("a", "b") and c.name != "close"] == [
        ("behind", False),
        ("beside", True),
        ("beside", False),
        ("ahead", True),
    ]


def test_change_is_dated_back_no_further_than_asked() -> None:
    settings = RelationSettings(least_margin_m=2.0, backdate_us=500_000)
    frames = passing(1.0, seconds=20.0, sigma_m=0.0, rng=np.random.default_rng(0))
    changes = run(frames, settings)
    beside = [change for change in changes if change.name == "beside" and change.old is not None]
    assert {change.decided_us - change.t_us for change in beside} == {500_000}


def test_fast_pass_between_two_frames_still_has_an_order() -> None:
    frames = [footprints(0, "ab", [[-10, 3], [0, 0]]), footprints(1_000_000, "ab", [[10, 3], [0, 0]])]
    changes = run(frames)
    assert changes_of(changes, "behind", "a", "b")[-1] == (300_000, True, False)
    assert changes_of(changes, "ahead", "a", "b")[-1] == (700_000, False, True)


def test_oncoming_cars_are_never_behind_beside_or_ahead() -> None:
    frames = [
        footprints(k * 40_000, "ab", [[k * 0.5 - 25, -1.7], [25 - k * 0.5, 1.7]], heading_rad=[0.0, np.pi])
        for k in range(100)
    ]
    changes = run(frames)
    assert {c.new for c in changes if c.name in {"behind", "beside", "ahead", "same_direction"}} == {False, None}
    assert [new for _, _, new in changes_of(changes, "left", "b", "a")] == [True, None]
    assert [new for _, _, new in changes_of(changes, "left", "a", "b")] == [True, None]


def test_bent_road_is_measured_along_itself() -> None:
    # b stands a quarter turn further on: in free space a would be beside or ahead of it.
    frame = footprints(0, "ab", [[0, 0], [14, 14]], heading_rad=[0.0, 1.57])
    bent = Footprints.of(
        t_us=0,
        ids=("a", "b"),
        centre_m=frame.centre_m,
        heading_rad=frame.heading_rad,
        speed_mps=frame.speed_mps,
        length_m=frame.length_m,
        width_m=frame.width_m,
        road=np.zeros(2, np.int32),
        along_m=np.array([0.0, 22.0]),
        across_m=np.zeros(2),
        tangent_rad=np.array([0.0, 1.57]),
        junction=frame.junction,
    )
    assert changes_of(run([frame]), "behind", "a", "b") == [(0, None, False)]
    assert changes_of(run([bent]), "behind", "a", "b") == [(0, None, True)]


def test_pair_becomes_unknown_when_it_leaves_the_near_set_and_not_before() -> None:
    def at(t_us: int, x_m: float) -> Footprints:
        return footprints(t_us, "ab", [[x_m, 0], [0, 0]])

    changes = run([at(0, 40), at(1, 48), at(2, 50), at(3, 46), at(4, 43)])
    assert changes_of(changes, "ahead", "a", "b") == [(0, None, True), (2, True, None), (4, None, True)]


def test_lost_object_leaves_everything_about_it_unknown() -> None:
    frames = [
        footprints(0, "abc", [[0, 0], [10, 0], [20, 0]], road=1, junction=[0, -1, -1]),
        footprints(40_000, "ac", [[0, 0], [20, 0]], road=1, junction=[0, -1]),
    ]
    gone = [change for change in run(frames) if change.t_us == 40_000]
    assert all("b" in change.args and change.new is None for change in gone)
    # nine relations in both orders and a conflict with each of the two others; moving, on, forward
    assert len(gone) == 2 * 19 + 3


def test_object_that_comes_back_starts_anew() -> None:
    one, none = footprints(0, "ab", [[0, 0], [10, 0]]), footprints(1, "a", [[0, 0]])
    again = footprints(2, "ab", [[0, 0], [-10, 0]])
    assert changes_of(run([one, none, again]), "behind", "a", "b") == [
        (0, None, True),
        (1, True, None),
        (2, None, False),
    ]


def test_car_changes_road_after_the_dwell_with_the_time_of_the_first_frame_there() -> None:
    roads = [0, 0, 1, 0, 0, 1, 1, 1, 1, -1, -1, -1]
    frames = [footprints(k * 100_000, "a", [[0, 0]], road=road) for k, road in enumerate(roads)]
    changes = run(frames)
    assert changes_of(changes, "on", "a", "north") == [(0, None, True), (500_000, True, False)]
    assert changes_of(changes, "on", "a", "south") == [(500_000, False, True), (900_000, True, False)]


def test_moving_has_hysteresis_around_two_metres_a_second() -> None:
    speeds = [0.0, 1.0, 2.4, 1.7, 2.0, 3.0, 2.0, 1.6, 1.0]
    frames = [footprints(k * 100_000, "a", [[0, 0]], speed_mps=speed) for k, speed in enumerate(speeds)]
    assert changes_of(run(frames), "moving", "a") == [(0, None, False), (400_000, False, True), (600_000, True, False)]


def test_bodies_close_to_each_other_are_close_by_freespace_not_by_centres() -> None:
    frames = [
        footprints(0, "ab", [[0, 0], [30, 0]], length_m=12.0),
        footprints(1, "ab", [[0, 0], [0, 30]], length_m=12.0),
    ]
    assert changes_of(run(frames[:1]), "close", "a", "b") == [(0, None, True)]
    assert changes_of(run(frames[1:]), "close", "a", "b") == [(1, None, False)]


def test_only_the_relations_asked_for_are_given_out() -> None:
    frames = list(random_traffic(np.random.default_rng(1), frames=40, count=12))
    everything, some = (
        RelationObserver(("r0", "r1"), ("j0",)),
        RelationObserver(("r0", "r1"), ("j0",), only=["ahead", "on"]),
    )
    for frame in frames:
        assert some.observe(frame) == [c for c in everything.observe(frame) if c.name in {"ahead", "on"}]
    with pytest.raises(QsrError, match=r"expected names out of .*, got 'besides'"):
        RelationObserver((), (), only=["besides"])


def test_empty_frames_are_fine() -> None:
    assert run([footprints(0, "", []), footprints(1, "", [])]) == []


def test_frame_that_is_not_later_is_refused() -> None:
    observer = RelationObserver((), ())
    observer.observe(footprints(5, "", []))
    with pytest.raises(QsrError, match="expected a frame after 5 us, got one at 5 us"):
        observer.observe(footprints(5, "", []))


def test_footprints_refuse_arrays_of_another_length_double_ids_and_other_columns() -> None:
    with pytest.raises(QsrError, match=r"different ids, got \('a', 'a'\)"):
        footprints(0, "aa", [[0, 0], [1, 0]])
    with pytest.raises(QsrError, match=r"centre_m must have shape \(1, 2\), got \(2, 2\)"):
        Footprints.of(0, ("a",), centre_m=np.zeros((2, 2)))
    with pytest.raises(QsrError, match=r"length_m must have shape \(2,\), got \(1,\)"):
        Footprints.of(0, ("a", "b"), length_m=np.zeros(1))
    with pytest.raises(QsrError, match=r"expected columns of \('centre_m', .*\), got 'colour'"):
        Footprints.of(0, ("a",), colour=np.zeros(1))


def test_place_that_is_not_on_the_list_is_refused() -> None:
    with pytest.raises(QsrError, match="index of on at 0 us must be below 2, got 2"):
        run([footprints(0, "a", [[0, 0]], road=2)])


def test_settings_refuse_what_cannot_be_meant() -> None:
    with pytest.raises(QsrError, match=r"close_m must be a number >= 0, got -1"):
        RelationSettings(close_m=-1.0)
    with pytest.raises(QsrError, match=r"leave_radius_m must be at least enter_radius_m \(40.0\), got 30.0"):
        RelationSettings(leave_radius_m=30.0)


def least_confidence(sigma_m: float, confidence: float = 1.0) -> float:
    """Say how sure the less sure change of `beside` in a pass is."""
    frames = passing(closing_mps=5.0, seconds=4.0, sigma_m=0.0, rng=np.random.default_rng(0))
    noise = {"sigma_m": np.full(2, sigma_m), "confidence": np.array([confidence, 1.0])}
    changes = run([frame.having(**noise) for frame in frames])
    return min(one.confidence for one in changes if one.name == "beside" and one.old is not None)


def test_change_is_less_sure_the_noisier_the_places_and_the_less_sure_the_cars_are() -> None:
    clear, fair, poor = least_confidence(0.1), least_confidence(0.5), least_confidence(2.0)
    assert 0.5 < poor < fair < clear
    assert clear > 0.99
    assert least_confidence(0.1, 0.9) == pytest.approx(0.9 * clear, abs=0.001)
    assert least_confidence(float("nan")) == 1.0


def test_what_is_first_said_of_a_car_is_sure() -> None:
    frame = footprints(0, ("a", "b"), [[0.0, 0.0], [10.0, 3.0]], straight_road=True)
    unsure = frame.having(sigma_m=np.ones(2), confidence=np.full(2, 0.5))
    assert {change.confidence for change in run([unsure])} == {1.0}
