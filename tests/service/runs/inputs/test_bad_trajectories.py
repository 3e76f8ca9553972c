"""What a file may say that cannot be: refused with row and column, or absorbed and counted, by the command line."""

import json
import random
from collections.abc import Sequence
from pathlib import Path

import pytest

from service.cli.app import run
from service.store.log import open_log
from tests.service.tracks import HEADER

Row = tuple[int, str, float, float]


def drive(frames: Sequence[int], *, name: str = "a", by_m: float = 0.0, y_m: float = 0.0) -> list[Row]:
    """Drive east at 10 m/s, ten rows a second, further on by so much."""
    return [(100_000 * k, name, k + by_m, y_m) for k in frames]


OTHER = drive(range(80), name="b", y_m=50.0)


def written(path: Path, rows: Sequence[Row]) -> Path:
    lines = [f"{t_us},{name},{x_m},{y_m},0,10,4.5,1.8" for t_us, name, x_m, y_m in rows]
    path.write_text("\n".join([HEADER, *lines, ""]))
    return path


def processed(
    folder: Path, capsys: pytest.CaptureFixture[str], rows: Sequence[Row]
) -> tuple[dict[str, list[int]], dict[str, int]]:
    """Process rows; return the times of each car that is linked, in frames, and what was counted on the way."""
    log = str(folder / "log.db")
    assert run(["process", str(written(folder / "t.csv", rows)), "--log", log, "--json"]) == 0
    summary = json.loads(capsys.readouterr().out.splitlines()[-1])
    cars: dict[str, list[int]] = {}
    with open_log(log) as opened:
        for state in opened.states(opened.run().id):
            cars.setdefault(state.car, []).extend([state.t_us // 100_000] * state.linked)
    return cars, next(one["dropped"] for one in summary["streams"] if one["label"] == "cars")


@pytest.mark.parametrize(
    ("column", "value"),
    [
        *(("x_m", value) for value in ("NaN", "inf", "-inf", "1e999")),
        *((column, value) for column in HEADER.replace("id,", "").split(",") for value in ("nan", "")),
    ],
)
def test_what_is_no_number_is_refused_with_row_and_column(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], column: str, value: str
) -> None:
    written(tmp_path / "t.csv", drive(range(3)))
    header, first, second, *rest = (tmp_path / "t.csv").read_text().splitlines()
    fields = second.split(",")
    fields[header.split(",").index(column)] = value
    (tmp_path / "t.csv").write_text("\n".join([header, first, ",".join(fields), *rest, ""]))
    assert run(["process", str(tmp_path / "t.csv"), "--log", str(tmp_path / "log.db")]) == 3
    message = capsys.readouterr().err
    assert f"t.csv:3: column {column}: expected" in message
    assert "Traceback" not in message
    assert not (tmp_path / "log.db").exists()


def test_one_name_twice_at_a_time_is_refused_with_both_rows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path / "t.csv", [*drive(range(5)), *drive([2], y_m=3.0)])
    assert run(["process", str(path), "--log", str(tmp_path / "log.db")]) == 3
    assert "t.csv:7: expected each id once a time, got 'a' at 200000 us as in line 4" in capsys.readouterr().err


def test_rows_whose_time_runs_back_are_put_in_order(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = drive(range(40))
    random.Random(1).shuffle(rows)
    assert processed(tmp_path, capsys, rows) == ({"car1": list(range(40))}, {})


def test_one_wild_row_is_left_out_and_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [*drive(range(20)), *drive([20], by_m=5000.0), *drive(range(21, 40))]
    assert processed(tmp_path, capsys, rows) == (
        {"car1": [*range(20), *range(21, 40)]},
        {"jumps refused": 1},
    )


def test_a_name_that_jumps_for_good_is_another_car_and_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [*drive(range(20)), *drive(range(20, 40), by_m=300.0)]
    assert processed(tmp_path, capsys, rows) == (
        {"car1": list(range(20)), "car2": list(range(20, 40))},
        {"jumps refused": 1},
    )


@pytest.mark.parametrize("other", [[], OTHER], ids=["no row at all meanwhile", "another car"])
def test_a_name_that_comes_back_is_the_same_car(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], other: list[Row]
) -> None:
    rows = [*drive(range(20)), *drive(range(60, 80))]
    cars, counts = processed(tmp_path, capsys, [*rows, *other])
    assert (cars["car1"], counts) == ([*range(20), *range(60, 80)], {})


def test_a_name_that_comes_back_too_far_away_is_another_car_and_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [*drive(range(20)), *drive(range(60, 80), by_m=1000.0)]
    cars, counts = processed(tmp_path, capsys, [*rows, *OTHER])
    assert (cars["car1"], cars["car3"], counts) == ([*range(20)], [*range(60, 80)], {"returns refused": 1})


def test_names_that_two_cars_exchange_for_good_stay_with_the_cars(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The file then says that each name jumps, which nobody believes: the cars go on where they were."""
    a, b = drive(range(20)), drive(range(20), name="b", by_m=100.0)
    swapped = [*drive(range(20, 40), name="b"), *drive(range(20, 40), by_m=100.0)]
    cars, counts = processed(tmp_path, capsys, [*a, *b, *swapped])
    assert {car: (times[0], times[-1]) for car, times in cars.items()} == {"car1": (0, 39), "car2": (0, 39)}
    assert counts == {"jumps refused": 2}
