"""The figures of identity: hand-made symbols, whose returns and IDF1 can be counted on fingers."""

import json
from pathlib import Path

import numpy as np
import pytest

from anchoring.adapter import Anchored
from anchoring.observations import LinkChange, LinkKind
from benchmarks import evaluate_identity
from benchmarks.evaluate_identity import KINDS, Row, row_text, score_scene
from benchmarks.kept_identity import Followed, Returns, _judge_links, count_returns, follow, idf1, revise
from benchmarks.lost_tracks import STEP_US, Case, Place, lose_tracks, read_case
from data_gen.scenarios.catalogue import SCENARIOS
from tests.benchmarks.test_lost_tracks import drive

ROWS_A_SECOND = 1_000_000 // STEP_US


def followed(*stretches: tuple[str, str, int, str]) -> Followed:
    """Make rows of stretches: vehicle, track, its first second (it lasts two), and its symbol from its sixth row on."""
    rows = [
        (second * 1_000_000 + step * STEP_US, vehicle, track, symbol if step >= 5 else "")
        for vehicle, track, second, symbol in stretches
        for step in range(2 * ROWS_A_SECOND)
    ]
    t_us, vehicles, ids, symbols = zip(*sorted(rows), strict=True)
    return Followed(np.array(t_us), vehicles, ids, symbols)


@pytest.mark.parametrize(
    ("after", "returns"),
    [("car1", Returns(right=1)), ("car2", Returns(wrong=1)), ("car3", Returns(new=1)), ("", Returns(new=1))],
)
def test_return_is_judged_by_the_symbol_after_it(after: str, returns: Returns) -> None:
    assert count_returns(followed(("a", "t1", 0, "car1"), ("b", "t2", 0, "car2"), ("a", "t3", 5, after))) == returns


def test_symbol_that_another_gets_only_later_is_a_new_one() -> None:
    one = followed(("a", "t1", 0, "car1"), ("a", "t2", 5, "car2"), ("b", "t3", 9, "car2"))
    assert count_returns(one) == Returns(new=1)


def test_vehicle_without_a_car_before_and_short_stretch_without_one_say_nothing() -> None:
    assert count_returns(followed(("a", "t1", 0, ""), ("a", "t2", 5, "car1"))) == Returns()
    whole = followed(("a", "t1", 0, "car1"), ("a", "t2", 5, ""))
    kept = whole.t_us < 5_500_000
    count = int(kept.sum())
    cut = Followed(whole.t_us[kept], whole.vehicles[:count], whole.ids[:count], whole.symbols[:count])
    assert count_returns(cut) == Returns()


def test_idf1_counts_rows_of_the_symbol_that_a_vehicle_has_most() -> None:
    one = followed(("a", "t1", 0, "car1"), ("a", "t2", 5, "car2"))
    # 40 rows, of which 30 are named; 15 of them agree with the best of the two symbols.
    assert idf1([(one, one.symbols)]) == pytest.approx(15 / ((40 + 30) / 2))
    assert idf1([(one, revise(one))]) == pytest.approx(20 / 40)


def test_scenes_keep_their_names_and_times_apart() -> None:
    one = followed(("a", "t1", 0, "car1"))
    assert idf1([(one, revise(one)), (one, revise(one))]) == 1.0


def link(t_us: int, kind: LinkKind, lower: str, upper: str = "w1") -> LinkChange:
    return LinkChange(t_us, kind, "world", lower, upper, "")


def anchored(*changes: LinkChange, validated: tuple[str, ...] = (), refuted: tuple[str, ...] = ()) -> Anchored:
    return Anchored(None, changes, validated=validated, refuted=refuted)  # type: ignore[arg-type]  # no car is asked for


@pytest.mark.parametrize(
    ("vehicle", "validated", "wrong"),
    [("a", True, []), ("b", True, [(9, "t2", True)]), ("b", False, [(9, "t2", False)])],
)
def test_wrong_link_is_known_by_its_vehicle_and_validated_by_its_label(
    vehicle: str, validated: bool, wrong: list[tuple[int, str, bool]]
) -> None:
    said = [anchored(link(0, "established", "t1")), anchored(link(5, "lost", "t1"), validated=("t1->w1#1",))]
    label = ("t2->w1#2",)
    said += [
        anchored(link(9, "reestablished", "t2")),
        anchored(validated=label) if validated else anchored(link(12, "refuted", "t2"), refuted=label),
    ]
    links, found = _judge_links(said, {(0, "t1"): "a", (9, "t2"): vehicle})
    assert links == 1
    assert [(one.t_us, one.vision_id, one.is_validated) for one in found] == wrong


def test_anchoring_keeps_a_car_over_a_short_gap_and_is_told_nothing_of_the_truth() -> None:
    tracks = lose_tracks(drive(seconds=30), Case(hidden_m=20.0), Place(150.0, 0.0, is_disc=False), seed=1)
    found = follow(tracks, None)
    assert count_returns(found) == Returns(right=1)
    assert (found.links, found.wrong_links) == (1, ())
    assert set(found.symbols) == {"", "car1"}
    assert idf1([(found, revise(found))]) == 1.0
    assert len(found.frame_ms) == len(np.unique(tracks.rows.t_us))


def test_every_kind_is_of_a_scenario_that_exists_and_its_cases_can_be_read() -> None:
    assert {kind.scenario for kind in KINDS.values()} <= SCENARIOS.keys()
    assert all(read_case(text).name == text for kind in KINDS.values() for text in kind.cases)


def test_strip_lies_across_the_road_and_disc_on_the_junction() -> None:
    """Of vehicles that the camera sees, nearly all on a road pass the place."""
    rows = list(score_scene("motorway", [Case(), Case(hidden_m=30.0)], [1], seconds=12))
    assert [row.case for row in rows] == ["plain", "hidden 30"]
    assert rows[0].returns == Returns()
    assert rows[1].returns.count > 3
    assert rows[0].idf1_told < 0.99 < rows[0].idf1_revised


def test_row_says_shares_and_a_file_gets_them_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    row = Row("rural", "gap 4", Returns(right=6, wrong=1, new=1), 0.9, 0.95, 7, 2, 1, 0.5, 2.0)
    assert row_text(row) == "| rural | gap 4 | 8 | 0.750 | 0.125 | 0.125 | 0.900 | 0.950 | 7 | 2 | 1 | 0.50 | 2.0 |"
    monkeypatch.setattr(evaluate_identity, "score_scene", lambda *_, **__: [row])
    file = tmp_path / "figures.json"
    evaluate_identity.main(["--scenes", "rural", "--cases", "gap 4", "--seeds", "1", "--json", str(file)])
    assert row_text(row) in capsys.readouterr().out
    (stored,) = json.loads(file.read_text(encoding="utf-8"))
    assert stored["returns"] == {"right": 6, "wrong": 1, "new": 1}
