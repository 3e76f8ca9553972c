"""The figures of identity: hand-made symbols, whose returns and IDF1 can be counted on fingers."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anchoring.adapter import Anchored
from anchoring.observations import Cars, LinkChange, LinkKind
from benchmarks import evaluate_identity
from benchmarks.evaluate_identity import (
    KINDS,
    PeerRow,
    Row,
    lose_all,
    make_scenes,
    overtake_text,
    peer_text,
    row_text,
    score_case,
    score_crowd,
    wrong_link_text,
)
from benchmarks.hidden_crowd import HIDDEN_US, crowd_network, crowd_tracks
from benchmarks.kept_identity import NamedRows, Returns, WrongLink, _judge_links, count_returns, follow, idf1, revise
from benchmarks.lost_tracks import STEP_US, Case, Place, lose_tracks, read_case
from benchmarks.peer_identity import SWEEPS, as_detections, best_of_peer, name_rows
from benchmarks.tracker_runners import PEERS, Followed, Job, Settings
from data_gen.scenarios.catalogue import SCENARIOS
from dyknow.streams.hypotheses import Hypotheses
from service.questions.scoring.evaluate import Evaluation
from service.records.events import EventRecord
from tests.benchmarks.test_lost_tracks import drive
from tests.service.logs import overtake, run

ROWS_A_SECOND = 1_000_000 // STEP_US


def rows_of(*stretches: tuple[str, str, int, str]) -> NamedRows:
    """Make rows of stretches: vehicle, track, its first second (it lasts two), and its symbol from its sixth row on."""
    rows = [
        (second * 1_000_000 + step * STEP_US, vehicle, track, symbol if step >= 5 else "")
        for vehicle, track, second, symbol in stretches
        for step in range(2 * ROWS_A_SECOND)
    ]
    t_us, vehicles, ids, symbols = zip(*sorted(rows), strict=True)
    return NamedRows(np.array(t_us), vehicles, ids, symbols)


@pytest.mark.parametrize(
    ("after", "returns"),
    [("car1", Returns(right=1)), ("car2", Returns(wrong=1)), ("car3", Returns(new=1)), ("", Returns(new=1))],
)
def test_return_is_judged_by_the_symbol_after_it(after: str, returns: Returns) -> None:
    assert count_returns(rows_of(("a", "t1", 0, "car1"), ("b", "t2", 0, "car2"), ("a", "t3", 5, after))) == returns


def test_symbol_that_another_gets_only_later_is_a_new_one() -> None:
    one = rows_of(("a", "t1", 0, "car1"), ("a", "t2", 5, "car2"), ("b", "t3", 9, "car2"))
    assert count_returns(one) == Returns(new=1)


def test_vehicle_without_a_car_before_and_short_stretch_without_one_say_nothing() -> None:
    assert count_returns(rows_of(("a", "t1", 0, ""), ("a", "t2", 5, "car1"))) == Returns()
    whole = rows_of(("a", "t1", 0, "car1"), ("a", "t2", 5, ""))
    kept = whole.t_us < 5_500_000
    count = int(kept.sum())
    cut = NamedRows(whole.t_us[kept], whole.vehicles[:count], whole.ids[:count], whole.symbols[:count])
    assert count_returns(cut) == Returns()


def test_idf1_counts_rows_of_the_symbol_that_a_vehicle_has_most() -> None:
    one = rows_of(("a", "t1", 0, "car1"), ("a", "t2", 5, "car2"))
    # 40 rows, of which 30 are named; 15 of them agree with the best of the two symbols.
    assert idf1([(one, one.symbols)]) == pytest.approx(15 / ((40 + 30) / 2))
    assert idf1([(one, revise(one))]) == pytest.approx(20 / 40)


def test_scenes_keep_their_names_and_times_apart() -> None:
    one = rows_of(("a", "t1", 0, "car1"))
    assert idf1([(one, revise(one)), (one, revise(one))]) == 1.0


def link(t_us: int, kind: LinkKind, lower: str, label: str = "") -> LinkChange:
    return LinkChange(t_us, kind, "world", lower, "w1", "", label)


def anchored(
    *changes: LinkChange,
    validated: tuple[str, ...] = (),
    refuted: tuple[str, ...] = (),
    undecided: tuple[str, ...] = (),
) -> Anchored:
    nobody: Cars = None  # type: ignore[assignment]  # no car is asked for
    return Anchored(nobody, changes, Hypotheses(validated=validated, refuted=refuted, undecided=undecided))


LABEL = ("t2->w1#2",)
LOST = (anchored(link(0, "established", "t1", "t1->w1#1")), anchored(link(5, "lost", "t1"), validated=("t1->w1#1",)))
FOUND = anchored(link(9, "reestablished", "t2", *LABEL))


@pytest.mark.parametrize(("end", "undecided"), [(anchored(validated=LABEL), 0), (anchored(undecided=LABEL), 1)])
def test_link_to_another_track_of_the_same_vehicle_is_right(end: Anchored, undecided: int) -> None:
    assert _judge_links([*LOST, FOUND, end], {(0, "t1"): "a", (9, "t2"): "a"}) == (1, (), undecided)


@pytest.mark.parametrize(
    ("ends", "is_validated"),
    [
        ([anchored(validated=LABEL)], True),
        ([anchored(refuted=LABEL)], False),
        ([anchored(undecided=LABEL)], False),
        ([], False),
    ],
)
def test_wrong_link_is_believed_when_it_is_validated(ends: list[Anchored], is_validated: bool) -> None:
    found = _judge_links([*LOST, FOUND, *ends], {(0, "t1"): "a", (9, "t2"): "b"})
    assert found == (1, (WrongLink(9, "t2", is_validated),), 0)


@pytest.mark.parametrize(("gone", "is_wrong"), [("lost", False), ("refuted", True)])
def test_car_is_of_whom_its_track_was_on_at_last_unless_that_was_refuted(gone: LinkKind, is_wrong: bool) -> None:
    """Track t1 went over from a to b, and b is found again."""
    said = [anchored(link(0, "established", "t1")), anchored(link(5, gone, "t1")), FOUND]
    _, wrong, _ = _judge_links(said, {(0, "t1"): "a", (3, "t1"): "b", (9, "t2"): "b"})
    assert bool(wrong) == is_wrong


@pytest.mark.parametrize(
    ("failed", "wrong"), [((), ["t2"]), (("no_jump",), ["t2", "t3"])], ids=["taken over", "jumped"]
)
def test_car_that_is_taken_over_is_of_whom_it_was_when_it_was_lost(failed: tuple[str, ...], wrong: list[str]) -> None:
    """Track t2 of b is taken for the car of a, until t3, which is of a."""
    back = LinkChange(12, "refuted", "world", "t2", "w1", "", failed=failed)
    said = [*LOST, FOUND, anchored(back, refuted=LABEL), anchored(link(12, "reestablished", "t3", "t3->w1#3"))]
    _, links, _ = _judge_links(said, {(0, "t1"): "a", (9, "t2"): "b", (12, "t3"): "a"})
    assert [one.vision_id for one in links] == wrong


def test_anchoring_keeps_a_car_over_a_short_gap_and_is_told_nothing_of_the_truth() -> None:
    tracks = lose_tracks(drive(seconds=30), Case(hidden_m=20.0), Place(150.0, 0.0, is_disc=False), seed=1)
    found = follow(tracks, None)
    assert count_returns(found) == Returns(right=1)
    assert (found.links, found.wrong_links) == (1, ())
    assert set(found.symbols) == {"car1"}  # from its first row on, as in the log
    assert idf1([(found, revise(found))]) == 1.0
    assert len(found.frame_ms) == len(np.unique(tracks.rows.t_us))


def test_crowd_goes_at_once_and_comes_back_at_once_on_its_lanes() -> None:
    tracks = crowd_tracks(20, seed=1)
    times_us, count = np.unique(tracks.rows.t_us, return_counts=True)
    assert set(count) == {1, 20}
    assert np.diff(times_us[count == 20]).max() == HIDDEN_US + STEP_US
    assert len(set(tracks.ids)) == 39
    positions = crowd_network(20).locate(tracks.rows.values[:, :2])
    assert (positions.lane >= 0).mean() > 0.99  # 0.3 m of noise may leave the road
    directions = np.array([lane.direction for lane in crowd_network(20).lanes])[positions.lane]
    heads_east = np.cos(tracks.rows.values[:, 2]) > 0
    assert ((directions > 0) == heads_east).mean() > 0.99
    assert score_crowd(20, 1).returns == Returns(right=19)


def test_peer_gets_the_rows_without_their_names_in_boxes_around_them() -> None:
    tracks = lose_tracks(drive(cars=2), Case(), Place(0.0, 0.0, is_disc=False), seed=1)
    values = tracks.rows.values.copy()
    values[:, 2], values[:, 4:6] = np.where(np.array(tracks.rows.vehicles) == "c1", np.pi / 2, 0.0), (4.0, 2.0)
    detected = as_detections(replace(tracks, rows=replace(tracks.rows, values=values)))
    assert np.array_equal(detected.found_m, values[:, :2])
    assert detected.frame_count == 300
    sizes_m = np.column_stack((detected.length_m, detected.width_m))
    assert sizes_m[:2] == pytest.approx(np.array([[4.0, 2.0], [2.0, 4.0]]))


def test_best_settings_of_a_peer_are_those_that_keep_names() -> None:
    """A peer that sees every row a little beside its place, and names it after its car with one setting only."""
    tracks = lose_tracks(drive(cars=2), Case(hidden_m=60.0), Place(150.0, 0.0, is_disc=False), seed=1)
    number_of = {name: place for place, name in enumerate(dict.fromkeys(tracks.ids))}
    by_track = np.array([number_of[name] for name in tracks.ids])

    def run(jobs: Sequence[Job]) -> list[Followed]:
        return [
            Followed(one.true_frame, one.true_car if _is_best(settings) else by_track, one.found_m + 0.5, 0.0)
            for one, settings in jobs
        ]

    settings, (named,) = best_of_peer("norfair", run, [tracks])
    assert _is_best(settings)
    assert count_returns(named) == Returns(right=2)
    assert idf1([(named, named.symbols)]) == 1.0
    far = Followed(tracks.rows.t_us // STEP_US, by_track, tracks.rows.values[:, :2] + 5.0, 0.0)
    assert set(name_rows(tracks, far).symbols) == {""}


def _is_best(settings: Settings) -> bool:
    return (settings["distance_m"], settings["keep_s"], settings["noise"]) == (8.0, 6.0, 4.0)


def test_peers_have_as_many_settings_to_choose_from() -> None:
    assert {int(np.prod([len(values) for values in sweep.values()])) for sweep in SWEEPS.values()} == {12}
    assert SWEEPS.keys() <= set(PEERS)


def test_every_kind_is_of_a_scenario_that_exists_and_its_cases_can_be_read() -> None:
    assert {kind.scenario for kind in KINDS.values()} <= SCENARIOS.keys()
    assert all(read_case(text).name == text for kind in KINDS.values() for text in kind.cases)


@pytest.mark.long
def test_strip_lies_across_the_road_and_all_overtakes_of_good_tracks_are_told(tmp_path: Path) -> None:
    scenes = make_scenes("motorway", [1], tmp_path, seconds=12)
    plain, hidden = (
        score_case("motorway", case, scenes, lose_all("motorway", case, scenes), with_overtakes=case == Case())
        for case in (Case(), Case(hidden_m=30.0))
    )
    assert (plain.case, hidden.case) == ("plain", "hidden 30")
    assert plain.returns == Returns()
    assert hidden.returns.count > 3
    assert 0.99 < plain.idf1_told <= plain.idf1_revised
    assert hidden.overtakes is None
    assert plain.overtakes is not None
    assert plain.overtakes.right
    assert not plain.overtakes.wrong


ROW = Row("rural", "gap 4", Returns(right=6, wrong=1, new=1), 0.9, 0.95, 7, 2, 1, 1, 0.5)


def test_row_says_counts_shares_and_intervals() -> None:
    cells = [cell.strip() for cell in row_text(ROW).split("|")[1:-1]]
    assert cells[:5] == ["rural", "gap 4", "6", "1", "1"]
    assert cells[5:7] == ["0.750 [0.409 to 0.929]", "0.125 [0.022 to 0.471]"]
    assert cells[7:] == ["0.900", "0.950", "7", "2", "1", "1", "0.50"]
    assert wrong_link_text([ROW, ROW]) == (
        "wrong links of all cases: 4, validated in the end: 2, 0.500 [0.150 to 0.850]\n"
        "right links of all cases: 10, undecided in the end: 2, 0.200 [0.057 to 0.510]"
    )
    event = EventRecord.of(overtake(0, 1, roles={}), run(), "e1")
    score = Evaluation("overtake", (), (), (event,), ())
    assert overtake_text(ROW, score) == "| rural | gap 4 | 0 | 1 | 0 | 0 | 0.000 [0.000 to 0.793] | - |"


def test_tables_are_printed_and_a_file_gets_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    peer = PeerRow("rural", "gap 4", "norfair", Returns(right=1), 0.75, {"keep_s": 6.0})
    monkeypatch.setattr(evaluate_identity, "make_scenes", lambda *_, **__: [])
    monkeypatch.setattr(evaluate_identity, "score_case", lambda *_, **__: ROW)
    monkeypatch.setattr(evaluate_identity, "score_peers", lambda *_, **__: [peer])
    file = tmp_path / "figures.json"
    evaluate_identity.main(["--scenes", "rural", "--cases", "gap 4", "--crowd", "10", "--json", str(file)])
    printed = capsys.readouterr().out
    assert row_text(ROW) in printed
    assert peer_text(peer) in printed
    assert "| 0.750 | keep_s 6 |" in printed
    assert "| 10 | 9 | 0 | 0 |" in printed
    stored = json.loads(file.read_text(encoding="utf-8"))
    assert stored["cases"][0]["returns"] == {"right": 6, "wrong": 1, "new": 1}
    assert stored["peers"][0]["settings"] == {"keep_s": 6.0}
    assert stored["crowds"][0]["cars"] == 10
