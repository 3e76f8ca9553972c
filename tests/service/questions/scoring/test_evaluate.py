"""Scores of recognised events against the truth."""

import json
import math
from pathlib import Path

import pytest

from benchmarks.pooled_scores import merge_evaluations
from service.errors import TruthError
from service.questions.scoring.evaluate import (
    Positions,
    TrueEvent,
    evaluate_events,
    load_truth,
    positions_from_rows,
)
from service.records.events import EventRecord
from tests.service.logs import overtake, run

SECOND = 1_000_000


def lane_positions(**x_by_id: float) -> Positions:
    """Put each thing at a fixed place for ten seconds, a row a second."""
    rows = [(t * SECOND, name, (x, 0.0)) for t in range(11) for name, x in x_by_id.items()]
    return positions_from_rows([row[0] for row in rows], [row[1] for row in rows], [row[2] for row in rows])


CARS = lane_positions(car1=0.5, car2=20.0, car3=60.0)
VEHICLES = lane_positions(a=0.0, b=20.3, c=40.0)


def recognised(name: str, type_: str, roles: dict[str, str], start_us: int, end_us: int) -> EventRecord:
    return EventRecord.of(overtake(start_us, end_us, type=type_, roles=roles), run(), name)


def claim(overtaker: str, overtaken: str, start_s: float, end_s: float, name: str = "e1") -> EventRecord:
    roles = {"overtaker": overtaker, "overtaken": overtaken, "road": "we"}
    return recognised(name, "overtake", roles, round(start_s * SECOND), round(end_s * SECOND))


def fact(overtaker: str, overtaken: str, start_s: float, end_s: float, *, countable: bool = True) -> TrueEvent:
    roles = {"overtaker": overtaker, "overtaken": overtaken}
    return TrueEvent("overtake", roles, round(start_s * SECOND), round(end_s * SECOND), countable)


def counts(claims: list[EventRecord], facts: list[TrueEvent]) -> tuple[int, int, int, int]:
    result = evaluate_events(claims, CARS, facts, VEHICLES, event_type="overtake")
    return len(result.right), len(result.border), len(result.wrong), len(result.missed)


def test_same_pair_within_two_seconds_is_right() -> None:
    assert counts([claim("car1", "car2", 4, 7)], [fact("a", "b", 2, 5)]) == (1, 0, 0, 0)


def test_more_than_two_seconds_off_is_wrong_and_missed() -> None:
    assert counts([claim("car1", "car2", 4.1, 7)], [fact("a", "b", 2, 5)]) == (0, 0, 1, 1)


def test_what_overlaps_border_truth_is_border_however_long_it_lasts() -> None:
    assert counts([claim("car1", "car2", 4.1, 9)], [fact("a", "b", 2, 5, countable=False)]) == (0, 1, 0, 0)
    assert counts([claim("car1", "car2", 7.1, 9)], [fact("a", "b", 2, 5, countable=False)]) == (0, 0, 1, 0)


def test_swapped_roles_are_wrong() -> None:
    assert counts([claim("car2", "car1", 2, 5)], [fact("a", "b", 2, 5)]) == (0, 0, 1, 1)


def test_a_car_that_nobody_saw_meanwhile_is_the_vehicle_that_it_was_before_and_after() -> None:
    def score(cars: Positions) -> int:
        result = evaluate_events(
            [claim("car1", "car2", 2, 5)], cars, [fact("a", "b", 2, 5)], VEHICLES, event_type="overtake"
        )
        return len(result.right)

    rows = [(t * SECOND, name, (x, 0.0)) for t in (0, 1, 6, 7) for name, x in (("car1", 0.5), ("car2", 20.0))]
    hidden = positions_from_rows(*zip(*rows, strict=True))
    assert score(hidden) == 1
    other = [(t_us, name, (40.0 if t_us > 5 * SECOND and name == "car2" else x, y)) for t_us, name, (x, y) in rows]
    assert score(positions_from_rows(*zip(*other, strict=True))) == 0
    gone = [row for row in rows if row[0] < 5 * SECOND]
    assert score(positions_from_rows(*zip(*gone, strict=True))) == 0


def test_symbol_without_a_vehicle_near_it_is_wrong() -> None:
    assert counts([claim("car1", "car3", 2, 5)], [fact("a", "c", 2, 5)]) == (0, 0, 1, 1)


def test_truth_that_does_not_count_is_border_when_found_and_ignored_when_not() -> None:
    border = fact("a", "b", 2, 5, countable=False)
    assert counts([claim("car1", "car2", 2, 5)], [border]) == (0, 1, 0, 0)
    assert counts([], [border]) == (0, 0, 0, 0)


def test_one_truth_is_found_once() -> None:
    claims = [claim("car1", "car2", 2, 5, "near"), claim("car1", "car2", 3, 6, "far")]
    result = evaluate_events(claims, CARS, [fact("a", "b", 2, 5)], VEHICLES, event_type="overtake")
    assert [match.recognised.id for match in result.right] == ["near"]
    assert [event.id for event in result.wrong] == ["far"]


def test_other_event_types_take_no_part() -> None:
    other = recognised("e", "pass", {"overtaker": "car1", "overtaken": "car2"}, 2 * SECOND, 5 * SECOND)
    assert counts([other], [fact("a", "b", 2, 5)]) == (0, 0, 0, 1)


def test_time_errors_are_means_of_absolute_differences() -> None:
    claims = [claim("car1", "car2", 2.5, 5), claim("car2", "car1", 6, 7.5)]
    facts = [fact("a", "b", 2, 5), fact("b", "a", 6.5, 8)]
    result = evaluate_events(claims, CARS, facts, VEHICLES, event_type="overtake")
    assert result.mean_start_error_s == pytest.approx(0.5)
    assert result.mean_end_error_s == pytest.approx(0.25)


def test_nothing_claimed_and_nothing_to_find_has_no_errors() -> None:
    result = evaluate_events([], CARS, [], VEHICLES, event_type="overtake")
    assert (result.precision, result.recall, result.f1) == (None, None, None)
    assert result.as_record()["recall_interval"] is None
    assert math.isnan(result.mean_start_error_s)
    assert result.as_record()["mean_end_error_s"] is None


def test_pooled_scores_add_counts() -> None:
    one = evaluate_events([claim("car1", "car2", 2, 5)], CARS, [fact("a", "b", 2, 5)], VEHICLES, event_type="overtake")
    other = evaluate_events([claim("car1", "car3", 2, 5)], CARS, [], VEHICLES, event_type="overtake")
    assert merge_evaluations([one, other]).precision == 0.5


def test_truth_folder_is_read(tmp_path: Path) -> None:
    event = {"type": "overtake", "roles": {"overtaker": "a", "overtaken": "b"}, "start_us": 1, "end_us": 2}
    (tmp_path / "truth_events.jsonl").write_text(json.dumps(event | {"countable": True, "why_not_countable": ""}))
    (tmp_path / "truth.csv").write_text("t_us,id,x_m,y_m\n40,b,3,4\n0,a,1,2\n")
    (true_event,), vehicles = load_truth(tmp_path)
    assert true_event.countable
    assert vehicles.ids == ("a", "b")


def test_truth_folder_without_its_files_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TruthError, match=r"expected a truth folder with truth_events.jsonl, got none there"):
        load_truth(tmp_path)


def test_truth_line_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    (tmp_path / "truth_events.jsonl").write_text('{"type": "overtake"}\n')
    (tmp_path / "truth.csv").write_text("t_us,id,x_m,y_m\n")
    with pytest.raises(TruthError, match=r"truth_events.jsonl:1: expected a truth event"):
        load_truth(tmp_path)


def breakdown(vehicle: str) -> TrueEvent:
    return TrueEvent("breakdown", {"car": vehicle}, 2 * SECOND, 3 * SECOND, countable=True)


def breakdowns(*cars: str) -> list[EventRecord]:
    return [recognised(f"e{car}", "breakdown", {"car": car}, 2 * SECOND, 3 * SECOND) for car in cars]


def test_events_of_a_type_without_truth_are_unjudged_and_not_wrong() -> None:
    claims = breakdowns("car1", "car2")
    result = evaluate_events(claims, CARS, [fact("a", "b", 2, 5)], VEHICLES, event_type="breakdown")
    assert (result.has_truth, result.unjudged, result.wrong) == (False, tuple(claims), ())
    assert (result.precision, result.recall, result.f1) == (None, None, None)


def test_one_event_of_a_type_says_that_the_truth_tells_of_it() -> None:
    result = evaluate_events(breakdowns("car1", "car2"), CARS, [breakdown("a")], VEHICLES, event_type="breakdown")
    assert (result.has_truth, result.unjudged, len(result.right), len(result.wrong)) == (True, (), 1, 1)


def test_every_type_of_a_generated_scene_is_judged_without_any_there() -> None:
    for name in ("overtake", "pass", "turn_left", "follow", "wrong_way", "near_miss", "queue_jump"):
        claims = [recognised("e1", name, {"car": "car1"}, SECOND, SECOND)]
        assert len(evaluate_events(claims, CARS, [], VEHICLES, event_type=name).wrong) == 1


def test_unjudged_events_of_several_scenes_add_up() -> None:
    one = evaluate_events(breakdowns("car1"), CARS, [], VEHICLES, event_type="breakdown")
    other = evaluate_events(breakdowns("car1", "car2"), CARS, [], VEHICLES, event_type="breakdown")
    pooled = merge_evaluations([one, other])
    assert (len(pooled.unjudged), pooled.has_truth) == (3, False)


@pytest.mark.parametrize(("type_", "right"), [("near_miss", 1), ("pass", 0)], ids=["near miss", "pass"])
def test_only_the_roles_of_a_near_miss_may_be_exchanged(type_: str, right: int) -> None:
    roles = ("car", "other") if type_ == "near_miss" else ("passer", "passed")
    one = recognised("e1", type_, dict(zip(roles, ("car1", "car2"), strict=True)), 2 * SECOND, 3 * SECOND)
    true = TrueEvent(type_, dict(zip(roles, ("b", "a"), strict=True)), 2 * SECOND, 3 * SECOND, countable=True)
    assert len(evaluate_events([one], CARS, [true], VEHICLES, event_type=type_).right) == right


@pytest.mark.parametrize(
    "change",
    [{"type": 3}, {"roles": []}, {"roles": {"car": 3}}, {"start_us": 1e400}, {"end_us": "soon"}],
    ids=["type", "no roles", "role", "infinite", "text"],
)
def test_a_true_event_with_a_wrong_field_is_refused(tmp_path: Path, change: dict[str, object]) -> None:
    event = {"type": "overtake", "roles": {"overtaker": "a"}, "start_us": 0, "end_us": 1, "countable": True}
    (tmp_path / "truth.csv").write_text("t_us,id,x_m,y_m\n0,a,0,0\n")
    (tmp_path / "truth_events.jsonl").write_text(json.dumps(event) + "\n" + json.dumps(event | change))
    with pytest.raises(TruthError, match=r"truth_events\.jsonl:2: expected a truth event"):
        load_truth(tmp_path)


@pytest.mark.parametrize("row", ["0,a,nan,0", "0,a,0,inf", "99999999999999999999,a,0,0"])
def test_a_true_position_that_is_no_place_is_refused(tmp_path: Path, row: str) -> None:
    (tmp_path / "truth.csv").write_text(f"t_us,id,x_m,y_m\n0,a,0,0\n{row}\n")
    (tmp_path / "truth_events.jsonl").write_text("")
    with pytest.raises(TruthError, match=r"truth\.csv:3: expected t_us, id, x_m, y_m"):
        load_truth(tmp_path)
