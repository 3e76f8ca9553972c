"""What does the truth say of whole scenarios? Hard negatives have no overtake, and every turn of a junction is told."""

from collections import Counter
from collections.abc import Mapping

import pytest

from data_gen.drawing.view import camera_over
from data_gen.truth.clip import clip_events, visible_masks
from data_gen.truth.event import ROLES, TruthEvent
from gis.roads.sumo_net import read_sumo_net
from tests.data_gen.scenario_clips import clip, lane_sequences

pytestmark = pytest.mark.long

NO_OPTIONS: Mapping[str, str] = {}


def events_of(name: str, *, seconds: int) -> tuple[TruthEvent, ...]:
    played = clip(name, NO_OPTIONS, seconds=seconds)
    view = camera_over(played.scenario.view, (1280, 720))
    visible = visible_masks(played.states, (view,) * len(played.states))
    return clip_events(played.states, read_sumo_net(played.scenario.network_file), visible)


@pytest.mark.parametrize(
    ("name", "plenty"), [("following_only", "follow"), ("meeting_only", None), ("queue_passing", "pass")]
)
def test_hard_negatives_have_plenty_of_one_thing_and_nothing_like_an_overtake(name: str, plenty: str | None) -> None:
    counts = Counter(event.type for event in events_of(name, seconds=40) if event.countable)
    assert not counts.keys() & {"overtake", "aborted_overtake", "wrong_way", "cut_in"}
    assert plenty is None or counts[plenty] >= 3


def test_every_countable_turn_of_a_junction_is_the_one_between_its_edges() -> None:
    played = clip("junction", NO_OPTIONS, seconds=40)
    visible = visible_masks(played.states, None)
    events = clip_events(played.states, read_sumo_net(played.scenario.network_file), visible)
    arms = ("north", "east", "south", "west")
    lanes = lane_sequences(played.states)
    kinds = {1: "turn_left", 2: "drive_straight", 3: "turn_right"}
    seen: Counter[str] = Counter()
    for event in events:
        if event.countable and event.type in kinds.values():
            edges = [lane.rsplit("_", 2)[0] for lane in lanes[event.actor]]
            quarter = (arms.index(edges[-1]) - arms.index(edges[0])) % 4
            assert event.type == kinds[quarter]
            seen[event.type] += 1
    assert len(seen) == 3
    crossings = [event for event in events if event.type == "crossing"]
    assert len(crossings) == len({event.actor for event in crossings})


def test_events_are_in_order_and_have_the_roles_of_their_type() -> None:
    events = events_of("motorway", seconds=30)
    assert [event.start_us for event in events] == sorted(event.start_us for event in events)
    assert all(len(event.vehicles) == len(ROLES[event.type]) for event in events)
    assert all(event.countable == (event.why_not_countable is None) for event in events)
    counts = Counter(event.type for event in events if event.countable)
    assert counts["overtake"] >= 3
    assert counts["pass"] >= counts["overtake"]
