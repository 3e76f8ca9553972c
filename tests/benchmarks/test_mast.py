"""Low views are scored on what their pictures show: large and free enough, for long enough."""

from pathlib import Path

import numpy as np

from benchmarks.evaluate_mast import Measured, ShownTruth, compare_shown, load_shown, pooled, write_boxes
from service.questions.scoring.evaluate import Evaluation
from service.records.seen import CarState

STEP_US = 100_000
EYE_M = np.zeros(2)
NO_EVENTS = {name: Evaluation(name, (), (), (), ()) for name in ("pass", "near_miss")}
HEADER = "t_us,id,x_m,y_m,visible,visible_share,left_px,top_px,right_px,bottom_px"


def truth_of(*names: str, frames: int = 30, counts: bool = True) -> ShownTruth:
    """Let vehicles stand 10 m apart from each other, 20 m away."""
    t_us = np.repeat(np.arange(frames) * STEP_US, len(names))
    centre_m = np.tile([(20.0, 10.0 * place) for place in range(len(names))], (frames, 1))
    return ShownTruth(t_us, np.tile(names, frames), centre_m, np.full(len(t_us), counts))


def states_at(car: str, x_m: float, y_m: float, frames: range) -> list[CarState]:
    return [CarState(frame * STEP_US, car, x_m, y_m, 0.0, 0.0, 4.0, 2.0) for frame in frames]


def measured(truth: ShownTruth, *states: list[CarState]) -> Measured:
    joined = sorted((one for rows in states for one in rows), key=lambda state: state.t_us)
    return compare_shown(truth, joined, EYE_M, NO_EVENTS, seconds=3.0)


def test_a_vehicle_is_found_if_a_symbol_is_near_most_of_the_time() -> None:
    truth = truth_of("a", "b")
    half = measured(truth, states_at("car1", 20.0, 1.0, range(16)), states_at("car2", 20.0, 10.0, range(15)))
    assert (half.vehicles, half.found) == (2, 1)


def test_far_symbols_may_be_farther_off() -> None:
    truth = truth_of("a")
    # 1.5 m and 5 % of 20 m.
    assert measured(truth, states_at("car1", 22.4, 0.0, range(30))).found == 1
    assert measured(truth, states_at("car1", 22.6, 0.0, range(30))).found == 0


def test_symbols_on_nothing_are_wrong_and_those_on_what_hardly_shows_are_not() -> None:
    wrong = measured(truth_of("a"), states_at("car1", 20.0, 0.0, range(30)), states_at("car2", 60.0, 60.0, range(10)))
    assert (wrong.rows_right, wrong.rows_wrong) == (30, 10)
    ignored = measured(truth_of("a", counts=False), states_at("car1", 20.0, 0.0, range(30)))
    assert (ignored.vehicles, ignored.rows_right, ignored.rows_wrong) == (0, 0, 0)


def test_a_symbol_between_two_vehicles_stays_on_its_own_while_that_is_near_enough() -> None:
    truth = truth_of("a", "b")
    truth = ShownTruth(truth.t_us, truth.name, truth.centre_m * (1.0, 0.2), truth.counts)  # 2 m apart
    wild = [*states_at("car1", 20.0, 0.0, range(10)), *states_at("car1", 20.0, 1.9, range(10, 20))]
    assert measured(truth, wild, states_at("car1", 20.0, 0.0, range(20, 30))).switches == 0
    gone = states_at("car1", 20.0, 4.0, range(10, 30))
    assert measured(truth, states_at("car1", 20.0, 0.0, range(10)), gone).rows_right == 30


def test_a_new_name_on_a_vehicle_is_a_switch_and_a_gap_is_none() -> None:
    truth = truth_of("a")
    gap = states_at("car1", 20.0, 0.0, range(10)), states_at("car1", 20.0, 0.0, range(14, 30))
    assert measured(truth, *gap).switches == 0
    other = states_at("car1", 20.0, 0.0, range(10)), states_at("car2", 20.0, 0.0, range(14, 30))
    assert measured(truth, *other).switches == 1


def test_only_long_stretches_of_large_and_free_boxes_count(tmp_path: Path) -> None:
    lines = [HEADER]
    for frame in range(30):
        t_us = frame * STEP_US
        lines.append(f"{t_us},large,20,0,1,0.9,10,10,30,24")
        lines.append(f"{t_us},small,90,0,1,0.9,10,10,24,20")
        lines.append(f"{t_us},hidden,20,5,0,0.3,10,10,40,40")
        lines.append(f"{t_us},brief,20,9,1,{0.9 if frame % 15 else 0.2},10,10,40,40")
        lines.append(f"{t_us},outside,20,50,0,0,,,,")
    path = tmp_path / "truth.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    truth = load_shown(path)
    assert set(truth.name[truth.counts]) == {"large"}


def test_pooled_scenes_add_up() -> None:
    one = Measured(4, 3, 10, 2, 1, (2, 1, 0), 1, 20.0)
    assert pooled([one, one]) == Measured(8, 6, 20, 4, 2, (4, 2, 0), 2, 40.0)


def test_the_boxes_of_the_truth_are_those_that_show(tmp_path: Path) -> None:
    rows = [
        "0,whole,0,0,1,1.0,10,20,50,40,car",
        "0,hidden,0,0,1,0.29,10,20,50,40,car",
        "0,small,0,0,1,1.0,10,20,19,29,car",
        "0,outside,0,0,0,0.0,,,,,car",
        "100000,whole,0,0,1,1.0,30,20,70,40,truck",
    ]
    truth, boxes = tmp_path / "truth.csv", tmp_path / "boxes.csv"
    truth.write_text("\n".join([f"{HEADER},class", *rows]), encoding="utf-8")
    header = "t_us,left_px,top_px,width_px,height_px,score,class"
    write_boxes(truth, boxes, edge_noise=0.0, missed=0.0)
    exact = [header, "0,10.0,20.0,40.0,20.0,1,car", "100000,30.0,20.0,40.0,20.0,1,truck"]
    assert boxes.read_text(encoding="utf-8").splitlines() == exact
    write_boxes(truth, boxes, edge_noise=0.1, missed=0.0)
    assert [line.split(",")[0] for line in boxes.read_text(encoding="utf-8").splitlines()] == ["t_us", "0", "100000"]
    assert boxes.read_text(encoding="utf-8").splitlines() != exact
    write_boxes(truth, boxes, edge_noise=0.0, missed=1.0)
    assert boxes.read_text(encoding="utf-8").splitlines() == [header]
