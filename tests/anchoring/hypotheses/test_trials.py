"""Links on trial: who carries which label, and what becomes of it."""

import random
from itertools import pairwise

import pytest

from anchoring.hypotheses.hypotheses import Weighing
from anchoring.hypotheses.trials import DoubtfulLinks, Trials
from anchoring.observations import NEW, Level, LinkChange, LinkKind
from anchoring.settings import AnchoringSettings

S = 1_000_000
SETTINGS = AnchoringSettings(trial_us=2 * S, open_us=4 * S, decided_nats=3.0)
Judged = tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]


def link(t_us: int, kind: LinkKind, level: Level, lower: str, upper: str) -> LinkChange:
    return LinkChange(t_us, kind, level, lower, upper, "")


def chain(t_us: int, vision: str, number: int) -> list[LinkChange]:
    """Establish a car from its vision object upwards."""
    names = [vision, f"w{number}", f"r{number}", f"car{number}"]
    levels: list[Level] = ["world", "on_road", "car"]
    return [link(t_us, "established", level, *pair) for level, pair in zip(levels, pairwise(names), strict=True)]


def found(t_us: int, vision: str, margin_nats: float, runner_up: str = NEW) -> LinkChange:
    return LinkChange(t_us, "reestablished", "world", vision, "w1", "", "", 5.0, margin_nats, runner_up, t_us - S)


def judged(trials: Trials, t_us: int, *changes: LinkChange, **weighed: float) -> Judged:
    """Judge a frame; weighings are margins by world object, against v9."""
    trials.judge(t_us, changes, {upper: Weighing(upper, None, margin, "v9") for upper, margin in weighed.items()})
    return trials.validated, trials.refuted, trials.undecided


def test_every_link_of_a_new_car_is_a_hypothesis_until_its_trial_ends() -> None:
    trials = Trials(SETTINGS)
    assert judged(trials, S, *chain(S, "v1", 1)) == ((), (), ())
    labels = ("v1->w1#1", "w1->r1#2", "r1->car1#3")
    assert trials.doubtful.by_car() == {"car1": labels}
    assert judged(trials, 3 * S - 1) == ((), (), ())
    assert judged(trials, 3 * S) == (labels, (), ())
    assert trials.doubtful.by_car() == {}


def test_a_refuted_link_takes_its_label_with_it() -> None:
    trials = Trials(SETTINGS)
    judged(trials, 0, *chain(0, "v1", 1))
    assert judged(trials, S, link(S, "refuted", "world", "v1", "w1")) == ((), ("v1->w1#1",), ())
    assert trials.doubtful.by_car() == {"car1": ("w1->r1#2", "r1->car1#3")}


@pytest.mark.parametrize("kind", ["lost", "ended"])
def test_a_link_that_ends_without_being_refuted_is_validated(kind: LinkKind) -> None:
    trials = Trials(SETTINGS)
    judged(trials, 0, *chain(0, "v1", 1))
    assert judged(trials, S, link(S, kind, "world", "v1", "w1")) == (("v1->w1#1",), (), ())


def test_a_refutation_after_the_trial_takes_nothing_back() -> None:
    trials = Trials(SETTINGS)
    judged(trials, 0, *chain(0, "v1", 1))
    judged(trials, 2 * S)
    assert judged(trials, 2 * S + 1, link(2 * S + 1, "refuted", "world", "v1", "w1")) == ((), (), ())


def test_a_car_that_is_found_again_by_its_name_is_a_new_hypothesis() -> None:
    trials = Trials(SETTINGS)
    judged(trials, 0, *chain(0, "v1", 1))
    judged(trials, 2 * S, link(2 * S, "lost", "world", "v1", "w1"))
    judged(trials, 3 * S, link(3 * S, "reestablished", "world", "v1", "w1"))
    assert trials.doubtful.by_car() == {"car1": ("v1->w1#4",)}
    assert judged(trials, 5 * S) == (("v1->w1#4",), (), ())


@pytest.mark.parametrize(("margin_nats", "is_clear"), [(3.0, True), (2.9, False)])
def test_a_link_by_evidence_is_judged_by_its_margin_when_nothing_can_take_it_over(
    margin_nats: float, is_clear: bool
) -> None:
    trials, label = Trials(SETTINGS), ("v2->w1#1",)
    judged(trials, 0, found(0, "v2", margin_nats))
    assert judged(trials, 4 * S - 1) == ((), (), ())
    assert judged(trials, 4 * S) == ((label, (), ()) if is_clear else ((), (), label))


@pytest.mark.parametrize("kind", ["lost", "ended"])
def test_a_doubtful_link_that_ends_is_undecided(kind: LinkKind) -> None:
    trials = Trials(SETTINGS)
    judged(trials, 0, found(0, "v2", 2.0))
    assert judged(trials, S, link(S, kind, "world", "v2", "w1")) == ((), (), ("v2->w1#1",))
    assert trials.doubtful.by_car() == {}


def test_the_least_margin_counts_and_is_told_with_what_was_nearly_as_likely() -> None:
    trials = Trials(SETTINGS)
    judged(trials, 0, found(0, "v2", 6.0))
    judged(trials, S, w1=1.5)
    judged(trials, 2 * S, w1=8.0)
    (told,) = trials.judge(4 * S, [], {})
    assert (told.kind, told.lower, told.upper, told.label) == ("undecided", "v2", "w1", "v2->w1#1")
    assert (told.score_nats, told.margin_nats, told.runner_up, told.hidden_us) == (5.0, 1.5, "v9", None)
    assert told.reason == "v9 was never nearer than 1.5 nats"


def test_a_link_that_is_no_longer_the_likeliest_is_undecided() -> None:
    trials = Trials(SETTINGS)
    judged(trials, 0, found(0, "v2", 6.0))
    judged(trials, S, w1=-0.5)
    (told,) = trials.judge(4 * S, [], {})
    assert told.reason == "v9 was likelier at times, by 0.5 nats"


def test_a_new_car_that_may_be_a_lost_one_is_open_as_long_as_that_may_turn_out() -> None:
    trials = Trials(SETTINGS)
    judged(trials, 0, *chain(0, "v2", 2))
    judged(trials, S, w2=1.0)
    assert judged(trials, 2 * S) == (("w2->r2#2", "r2->car2#3"), (), ())
    assert judged(trials, 4 * S) == ((), (), ("v2->w2#1",))


def test_what_rests_on_an_undecided_link_carries_its_label_until_the_link_ends() -> None:
    trials = Trials(SETTINGS)
    judged(trials, 0, *chain(0, "v2", 2), w2=1.0)
    judged(trials, S, w2=1.0)
    judged(trials, 9 * S)
    assert trials.doubtful.by_car() == {"car2": ("v2->w2#1",)}
    assert judged(trials, 9 * S, link(9 * S, "refuted", "world", "v2", "w2")) == ((), (), ())
    assert trials.doubtful.by_car() == {}


def test_nothing_is_kept_of_links_that_are_gone() -> None:
    trials = Trials(SETTINGS)
    for number in range(1000):
        t_us = number * 10 * S
        judged(trials, t_us, *chain(t_us, f"v{number}", number))
        judged(trials, t_us + S, **{f"w{number}": 1.0})
        judged(trials, t_us + 5 * S)
        names = [f"v{number}", f"w{number}", f"r{number}", f"car{number}"]
        ends = [link(t_us, "ended", "car", *names[2:]), link(t_us, "ended", "on_road", *names[1:3])]
        judged(trials, t_us + 6 * S, *ends, link(t_us, "ended", "world", *names[:2]))
    doubtful = trials.doubtful
    assert len(trials._open) + len(doubtful._labels) + len(doubtful._keys) + len(doubtful._uppers) == 0


@pytest.mark.parametrize("seed", range(5))
def test_doubtful_links_can_be_told_from_the_rows_and_the_verdicts(seed: int) -> None:
    """As monitors over a log do it."""
    rng, trials, again = random.Random(seed), Trials(SETTINGS), DoubtfulLinks()
    linked: set[str] = set()
    for frame in range(200):
        t_us, changes = frame * S // 2, list[LinkChange]()
        for number in range(1, 5):
            vision, world = f"v{number}", f"w{number}"
            if rng.random() < 0.2 and vision not in linked:
                linked.add(vision)
                changes += chain(t_us, vision, number)
            elif rng.random() < 0.1 and vision in linked:
                linked.remove(vision)
                changes.append(link(t_us, rng.choice(["lost", "refuted", "ended"]), "world", vision, world))
        weighed = {
            f"w{number}": Weighing("", None, rng.uniform(-1, 9), NEW) for number in range(1, 5) if rng.random() < 0.1
        }
        for row in trials.judge(t_us, changes, weighed):
            again.take(row)
        for label in trials.validated:
            again.believe(label)
        assert again.by_car() == trials.doubtful.by_car()
