"""Does the comparison of golden logs tell every kind of change, in few words, and let through what it should?"""

from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import pytest

from tests.golden.comparing import SHOWN, Comparison, compare
from tests.golden.pinned import Row, Table, read_tables, write_tables

FRAME_US = 40_000
GOLDEN = Path(__file__).parent / "rural_video" / "log.txt"
Tables = dict[str, Table]


@pytest.fixture(scope="module")
def golden() -> Tables:
    return read_tables(GOLDEN)


def compared(golden: Tables, table: str, change: Callable[[list[Row]], object]) -> Comparison:
    """Compare after a change of the rows of one table."""
    rows = deepcopy(list(golden[table].rows))
    change(rows)
    return compare({table: golden[table]}, {table: replace(golden[table], rows=tuple(rows))}, frame_us=FRAME_US)


def only(golden: Tables, table: str, change: Callable[[list[Row]], object]) -> str:
    """Give the single difference after a change."""
    (difference,) = compared(golden, table, change).differences
    return difference


def moved(column: str, by: float, place: int = 7) -> Callable[[list[Row]], object]:
    def move(rows: list[Row]) -> None:
        value = rows[place][column]
        assert isinstance(value, int | float)
        rows[place][column] = value + by

    return move


def in_body(change: Callable[[dict[str, object]], object], place: int = 0) -> Callable[[list[Row]], object]:
    def edit(rows: list[Row]) -> None:
        body = rows[place]["body"]
        assert isinstance(body, dict)
        change(body)

    return edit


def test_golden_log_is_like_itself(golden: Tables) -> None:
    assert compare(golden, golden, frame_us=FRAME_US) == Comparison((), ())


def test_golden_logs_survive_the_disk(golden: Tables, tmp_path: Path) -> None:
    write_tables(golden, tmp_path / "log.txt")
    assert read_tables(tmp_path / "log.txt") == golden


@pytest.mark.parametrize("table", ["links", "relations", "hypotheses"])
def test_time_off_by_two_frames_is_told(golden: Tables, table: str) -> None:
    row = golden[table].rows[7]
    message = only(golden, table, moved("t_us", 2 * FRAME_US))
    assert message.startswith(f"{table}: ")
    assert message.endswith(f"t_us: expected {row['t_us']}, got {int(str(row['t_us'])) + 2 * FRAME_US}")


def test_time_of_an_event_off_by_two_frames_is_told(golden: Tables) -> None:
    start_us = int(str(golden["events"].rows[0]["start_us"]))
    told = f"start_us: expected {start_us}, got {start_us + 80_000}"
    assert told in only(golden, "events", moved("start_us", 80_000, place=0))
    text = {"start": "2026-05-01T08:00:03.665531Z"}
    assert "body.start: expected '2026-05-01T08:00:03.5" in only(
        golden, "events", in_body(lambda body: body.update(text))
    )


@pytest.mark.parametrize(
    ("table", "column", "by"),
    [
        ("car_states", "x_m", 0.03),
        ("car_states", "along_m", -0.03),
        ("seen_objects", "y_m", 0.03),
        ("seen_objects", "length_m", 0.05),
        ("car_states", "heading_rad", 0.03),
        ("car_states", "speed_mps", 0.1),
        ("car_states.lives", "x_m", 0.03),
        ("car_states.lives", "rows", 1),
    ],
)
def test_number_beyond_its_tolerance_is_told(golden: Tables, table: str, column: str, by: float) -> None:
    assert f" {column}: expected " in only(golden, table, moved(column, by))


@pytest.mark.parametrize(
    ("table", "column", "by"),
    [
        ("relations", "t_us", FRAME_US),
        ("links", "t_us", -FRAME_US),
        ("car_states", "x_m", 0.009),
        ("car_states", "heading_rad", 6.2832),
    ],
)
def test_number_within_its_tolerance_passes(golden: Tables, table: str, column: str, by: float) -> None:
    assert compared(golden, table, moved(column, by, place=len(golden[table].rows) - 1)).differences == ()


def test_exact_comparison_has_no_tolerance(golden: Tables) -> None:
    rows = [row | {"x_m": float(str(row["x_m"])) + 0.0001} for row in golden["car_states"].rows[:1]]
    moved_rows = replace(golden["car_states"], rows=(*rows, *golden["car_states"].rows[1:]))
    both = {"car_states": golden["car_states"]}, {"car_states": moved_rows}
    assert compare(*both, frame_us=FRAME_US).differences == ()
    assert len(compare(*both, frame_us=FRAME_US, is_exact=True).differences) == 1


def test_missing_and_extra_rows_are_told_of_every_table(golden: Tables) -> None:
    for table in (name for name in golden if golden[name].rows):
        missing = only(golden, table, lambda rows: rows.pop(len(rows) // 2))
        extra = only(golden, table, lambda rows: rows.append(deepcopy(rows[len(rows) // 2])))
        assert missing.startswith(f"{table}: "), table
        assert missing.endswith("expected this row, got none"), table
        assert extra.endswith("expected no such row, got one"), table


def test_swapped_roles_are_told(golden: Tables) -> None:
    def swap(body: dict[str, object]) -> None:
        roles = body["roles"]
        assert isinstance(roles, dict)
        roles["overtaker"], roles["overtaken"] = roles["overtaken"], roles["overtaker"]

    differences = compared(golden, "events", in_body(swap)).differences
    assert [one.partition("#")[0].rpartition(": body")[2] for one in differences] == [
        ".roles.overtaker: expected 'car3', got 'car5'",
        ".roles.overtaken: expected 'car5', got 'car3'",
    ]


def test_other_value_of_a_relation_and_other_reason_of_a_link_are_told(golden: Tables) -> None:
    assert "new: expected 'false', got 'true'" in only(golden, "relations", lambda rows: rows[0].update(new="true"))
    assert "reason: expected" in only(golden, "links", lambda rows: rows[0].update(reason="a guess"))
    assert "hypotheses: expected ['r" in only(golden, "relations", lambda rows: rows[0].update(hypotheses=[]))


def test_rows_of_one_moment_in_another_order_are_told(golden: Tables) -> None:
    def swap(rows: list[Row]) -> None:
        rows[3], rows[4] = rows[4], rows[3]

    assert "order of rows: expected after" in only(golden, "relations", swap)


def test_cause_of_dropped_samples_is_told(golden: Tables) -> None:
    change = in_body(lambda body: body.update(dropped={"cars late": 3}))
    assert "body.dropped.cars late: expected nothing, got 3" in only(golden, "streams", change)


def test_part_more_of_an_event_is_told(golden: Tables) -> None:
    def add(body: dict[str, object]) -> None:
        parts = body["sub_events"]
        assert isinstance(parts, list)
        parts.append({"label": "t3", "t_us": 5_000_000})

    assert "body.sub_events[]: expected 2, got 3" in only(golden, "events", in_body(add))


def test_new_tables_columns_and_fields_are_said_and_pass(golden: Tables) -> None:
    def with_column(table: Table) -> Table:
        return Table(table.name, (*table.columns, "codec"), tuple(row | {"codec": "h264"} for row in table.rows))

    def with_field(table: Table) -> Table:
        rows = deepcopy(list(table.rows))
        for place in range(len(rows)):
            in_body(lambda body: body.update(decided_us=1), place)(rows)
        return replace(table, rows=tuple(rows))

    got: Mapping[str, Table] = golden | {
        "inputs": Table("inputs", ("path",), ({"path": "video.mp4"},)),
        "runs": with_column(golden["runs"]),
        "events": with_field(golden["events"]),
    }
    comparison = compare(golden, got, frame_us=FRAME_US)
    assert comparison == Comparison((), ("table inputs", "field events.body.decided_us", "column runs.codec"))


def test_removed_tables_columns_and_fields_fail(golden: Tables) -> None:
    less = {name: table for name, table in golden.items() if name != "views"}
    assert compare(golden, less, frame_us=FRAME_US).differences == ("views: expected this table, got none",)
    narrow = replace(golden["cars"], columns=golden["cars"].columns[:-1])
    (message,) = compare(golden, golden | {"cars": narrow}, frame_us=FRAME_US).differences
    assert message.startswith("cars: expected columns ['last_us'], got [")
    message = only(golden, "streams", in_body(lambda body: body.pop("updates")))
    assert message.endswith("body.updates: expected 0, got nothing")


def test_report_shows_a_handful_and_counts_the_rest(golden: Tables) -> None:
    def shift(rows: list[Row]) -> None:
        for row in rows:
            row["x_m"] = float(str(row["x_m"])) + 1

    comparison = compared(golden, "car_states", shift)
    first, *shown = comparison.report().splitlines()
    count = len(golden["car_states"].rows)
    assert first == f"{count} differences to the golden log (car_states {count}), among them"
    assert len(shown) == SHOWN
