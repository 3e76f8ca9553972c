"""Trajectory files: read whole, refused with the place of the first fault."""

from pathlib import Path

import numpy as np
import pytest

from service.errors import InputError
from service.runs.inputs.trajectories import load_trajectories
from tests.service.tracks import write_row

HEADER = "t_us,id,x_m,y_m,heading_rad,speed_mps,length_m,width_m"


def written(folder: Path, *lines: str) -> Path:
    path = folder / "tracks.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_rows_become_the_objects_of_each_time_in_order(tmp_path: Path) -> None:
    path = written(tmp_path, HEADER, "40,b,3,4,0,2,5,2", "0,a,1,2,1.5707963267948966,10,4,1.8", "40,a,1,3,0,0,4,1.8")
    first, second = load_trajectories(path)
    assert (first.t_us, first.ids) == (0, ("a",))
    assert (second.t_us, second.ids) == (40, ("a", "b"))
    np.testing.assert_allclose(first.velocity_mps, [[0.0, 10.0]], atol=1e-9)
    np.testing.assert_allclose(second.centre_m, [[1, 3], [3, 4]])
    assert second.observed.all()
    assert not second.clipped.any()


def test_other_column_names_are_mapped_and_seconds_become_microseconds(tmp_path: Path) -> None:
    path = written(tmp_path, "t,id,x,y,heading,speed,length,width,type", "0.2,7,1,2,0,3,4,2,car")
    names = {"t_s": "t", "x_m": "x", "y_m": "y", "heading_rad": "heading"}
    names |= {"speed_mps": "speed", "length_m": "length", "width_m": "width"}
    (objects,) = load_trajectories(path, names)
    assert (objects.t_us, objects.ids) == (200_000, ("7",))


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([], "expected columns t_us or t_s, id, x_m"),
        (["t_us,id,x_m"], r"expected columns y_m, heading_rad, .* got t_us, id, x_m"),
        ([HEADER], "expected at least one row"),
        ([HEADER, "0,a,1,2,0,0,4"], r"tracks.csv:2: expected 8 fields, got 7"),
        ([HEADER, "0,a,1,2,0,0,4,2", "0,b,one,2,0,0,4,2"], r"tracks.csv:3: column x_m: .* got 'one'"),
        ([HEADER, "0,a,1,2,0,0,4,nan"], r"column width_m: expected a number, got 'nan'"),
        (
            [HEADER, "0,a,1,2,0,0,4,2", "0,a,1,2,0,0,4,2"],
            r"tracks.csv:3: expected each id once a time, got 'a' at 0 us as in line 2",
        ),
    ],
    ids=["empty", "columns missing", "no rows", "short row", "not a number", "not finite", "twice"],
)
def test_fault_is_named_with_its_place(tmp_path: Path, lines: list[str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_trajectories(written(tmp_path, *lines))


def objects(folder: Path, *lines: str) -> Path:
    path = folder / "tracks.jsonl"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_objects_of_json_are_the_rows_of_a_table(tmp_path: Path) -> None:
    names = f"{HEADER},class,sensor,sigma_m"
    table = load_trajectories(written(tmp_path, names, "40,7,3,4,0,2,5,2,Bus,eye,0.5", "0,a b,1,2,1e-3,1,4,1.8,,ear,0"))
    shape = '"speed_mps": {}, "length_m": {}, "width_m": {}'
    first = '{"t_us": 40, "id": 7, "x_m": 3, "y_m": "4", "heading_rad": 0.0, ' + shape.format(2, 5, 2)
    # In another order, with the number as a text and without a class.
    second = '{"id": " a b ", "t_us": 0, "x_m": 1, "y_m": 2, "heading_rad": 1e-3, ' + shape.format(1, 4, 1.8)
    lines = f'{first}, "class": "Bus", "sensor": "eye", "sigma_m": 0.5}}', f'{second}, "sensor": "ear", "sigma_m": 0}}'
    found = load_trajectories(objects(tmp_path, lines[0], "", lines[1]))
    for name in ("ids", "classes", "sensors"):
        assert getattr(found, name) == getattr(table, name)
    for name in ("t_us", "values", "sigma_m"):
        np.testing.assert_array_equal(getattr(found, name), getattr(table, name))


OBJECT = '{"t_us": 0, "id": "a", "x_m": 1, "y_m": 2, "heading_rad": 0, "speed_mps": 0, "length_m": 4, "width_m": 2}'


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (
            OBJECT[:-1],
            r"tracks.jsonl:3: expected a JSON object of texts and numbers, got .* \(Input data was truncated\)",
        ),
        ("[1]", r"tracks.jsonl:3: expected a JSON object of texts and numbers, got '\[1\]'"),
        (OBJECT.replace('"x_m": 1', '"x_m": true'), r"tracks.jsonl:3: expected a JSON object of texts and numbers"),
        (OBJECT.replace('"x_m": 1', '"x_m": null'), r"tracks.jsonl:3: column x_m: expected a number, got ''"),
        (OBJECT.replace('"x_m": 1, ', ""), r"tracks.jsonl:3: column x_m: expected a number, got ''"),
        (OBJECT.replace('"x_m": 1', '"x_m": "one"'), r"tracks.jsonl:3: column x_m: expected a number, got 'one'"),
        (OBJECT.replace('"x_m": 1', '"x_m": 1e9'), r"tracks.jsonl:3: column x_m: expected -1e\+07 to 1e\+07"),
        (OBJECT.replace("{", '{"lane": 1, '), r"tracks.jsonl:3: expected the names of line 1, t_us, .*, got also lane"),
        (OBJECT, r"tracks.jsonl:4: expected each id once a time, got 'a' at 0 us as in line 3"),
    ],
)
def test_a_fault_in_an_object_is_named_with_its_line(tmp_path: Path, line: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_trajectories(objects(tmp_path, OBJECT.replace('"a"', '"b"'), "", line, OBJECT))


def test_the_first_object_has_the_columns(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"tracks.jsonl:1: expected columns id, x_m, .* got t_us, x"):
        load_trajectories(objects(tmp_path, '{"t_us": 0, "x": 1}'))
    path = objects(tmp_path, OBJECT.replace('"x_m"', '"x"').replace('"t_us"', '"t"'))
    (found,) = load_trajectories(path, {"x_m": "x", "t_s": "t"})
    assert found.centre_m.tolist() == [[1.0, 2.0]]


def test_missing_and_binary_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        load_trajectories(tmp_path / "nothing.csv")
    (tmp_path / "video.csv").write_bytes(b"\x00\x00\xff\xfe")
    with pytest.raises(InputError, match="expected text in UTF-8, got byte 0xff"):
        load_trajectories(tmp_path / "video.csv")


def test_unknown_name_in_the_column_map_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"expected names out of t_us, .* got 'time'"):
        load_trajectories(written(tmp_path, HEADER), {"time": "t"})


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("t_us", "-1"),
        ("t_us", "1000000000000001"),
        ("t_us", "1e300"),
        ("x_m", "1e9"),
        ("y_m", "-1e9"),
        ("heading_rad", "270"),
        ("speed_mps", "9999"),
        ("length_m", "0"),
        ("length_m", "-4.5"),
        ("length_m", "1e6"),
        ("width_m", "0"),
        ("width_m", "51"),
    ],
)
def test_a_value_out_of_its_range_is_refused_with_its_line(tmp_path: Path, column: str, value: str) -> None:
    path = write_row(tmp_path / "t.csv", **{column: value})
    with pytest.raises(InputError, match=rf"t\.csv:2: column {column}: expected .* to .*, got '{value}'"):
        load_trajectories(path)


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "", "4,5"])
def test_what_is_no_finite_number_is_refused_with_its_line(tmp_path: Path, value: str) -> None:
    with pytest.raises(InputError, match=r"t\.csv:2: "):
        load_trajectories(write_row(tmp_path / "t.csv", length_m=value))


@pytest.mark.parametrize("value", ["1_0", "\u0661", "0x1p3", "1e", "NaN", "Infinity", "1e9999"])
def test_what_a_person_would_not_write_as_a_number_is_refused_with_row_and_column(tmp_path: Path, value: str) -> None:
    with pytest.raises(InputError, match=rf"t\.csv:2: column x_m: expected .*, got '{value}'"):
        load_trajectories(write_row(tmp_path / "t.csv", x_m=value))


@pytest.mark.parametrize(
    "name", ["", "  ", "a\0b", '"a\nb"', "a\x1b[2Jb"], ids=["empty", "blank", "NUL", "lines", "ESC"]
)
def test_an_id_that_is_empty_or_cannot_be_printed_is_refused_with_row_and_column(tmp_path: Path, name: str) -> None:
    path = tmp_path / "t.csv"
    path.write_text(f"{HEADER}\n0,{name},1,2,0,0,4,2\n", encoding="utf-8", newline="")
    with pytest.raises(InputError, match=r"t\.csv:2: column id: expected printable letters on one line"):
        load_trajectories(path)


def test_sensors_are_read_in_the_order_of_the_rows(tmp_path: Path) -> None:
    path = written(
        tmp_path, HEADER + ",sensor", "1,b,1,2,0,0,4,2,thermal", "1,a,1,2,0,0,4,2,colour", "0,c,1,2,0,0,4,2,x"
    )
    assert [one.sensors for one in load_trajectories(path)] == [("x",), ("colour", "thermal")]


def test_a_sensor_that_is_left_out_of_one_row_is_refused_with_its_line(tmp_path: Path) -> None:
    path = written(tmp_path, HEADER + ",sensor", "0,a,1,2,0,0,4,2,colour", "0,b,1,2,0,0,4,2,")
    with pytest.raises(
        InputError, match=r"tracks\.csv:3: column sensor: expected printable letters on one line, got ''"
    ):
        load_trajectories(path)


def test_lines_are_counted_through_quoted_line_breaks(tmp_path: Path) -> None:
    path = written(tmp_path, HEADER + ",note", '0,a,1,2,0,0,4,2,"one', 'two"', "0,b,x,2,0,0,4,2,")
    with pytest.raises(InputError, match=r"tracks\.csv:4: column x_m"):
        load_trajectories(path)


def test_a_column_that_comes_twice_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"tracks\.csv:1: expected column x_m once, got 2 of it"):
        load_trajectories(written(tmp_path, HEADER + ",x_m", "0,a,1,2,0,0,4,2,9"))


def test_a_byte_order_mark_and_blanks_around_fields_are_read_over(tmp_path: Path) -> None:
    (objects,) = load_trajectories(written(tmp_path, "\ufeff" + HEADER, " 0, a ,+1,2e0,0,0,4.,.5 "))
    assert (objects.ids, objects.centre_m.tolist()) == (("a",), [[1.0, 2.0]])


def test_classes_are_read_whatever_their_case_and_unknown_words_are_told(tmp_path: Path) -> None:
    rows = ["0,a,1,2,0,0,12,2.6,Bus", "0,b,1,2,0,0,4,2,van", "0,c,1,2,0,0,4,2,tram", "0,d,1,2,0,0,4,2,"]
    found = load_trajectories(written(tmp_path, HEADER + ",type", *rows), {"class": "type"})
    assert found.classes == ("bus", "van", "unknown", "unknown")
    assert len(found.warnings) == 1
    assert "tracks.csv: column class: expected car, " in found.warnings[0]
    assert "got 'tram' (1 rows): taken as unknown" in found.warnings[0]


def test_columns_that_nobody_reads_are_named(tmp_path: Path) -> None:
    found = load_trajectories(written(tmp_path, "t_s," + HEADER + ",colour", "1,0,a,1,2,0,0,4,2,red"))
    assert found.warnings[0].endswith("got others, which are left out: 't_s', 'colour'")


def test_a_file_without_classes_has_none(tmp_path: Path) -> None:
    found = load_trajectories(written(tmp_path, HEADER, "0,a,1,2,0,0,4,2"))
    assert (found.classes, found.warnings) == ((), ())
