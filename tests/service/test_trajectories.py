"""Trajectory files: read whole, refused with the place of the first fault."""

from pathlib import Path

import numpy as np
import pytest

from service.errors import InputError
from service.trajectories import load_trajectories

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
        ([HEADER, "0,a,1,2,0,0,4,nan"], r"column width_m: expected a finite number, got 'nan'"),
        ([HEADER, "0,a,1,2,0,0,4,2", "0,a,1,2,0,0,4,2"], "expected each id once a time, got 'a' twice at 0 us"),
    ],
    ids=["empty", "columns missing", "no rows", "short row", "not a number", "not finite", "twice"],
)
def test_fault_is_named_with_its_place(tmp_path: Path, lines: list[str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_trajectories(written(tmp_path, *lines))


def test_missing_and_binary_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        load_trajectories(tmp_path / "nothing.csv")
    (tmp_path / "video.csv").write_bytes(b"\x00\x00\xff\xfe")
    with pytest.raises(InputError, match="expected a UTF-8 CSV file, got byte 0xff"):
        load_trajectories(tmp_path / "video.csv")


def test_unknown_name_in_the_column_map_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"expected names out of t_us, .* got 'time'"):
        load_trajectories(written(tmp_path, HEADER), {"time": "t"})
