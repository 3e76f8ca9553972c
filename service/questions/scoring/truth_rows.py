"""What did a scene's vehicles do at the times of the frames? Reads `truth.csv` for scores of detections and tracks.

A true row is *border* where the vehicle cannot be seen properly: its centre is hidden or out of view (`visible` is 0),
or its footprint with `EDGE_M` around it reaches over the edge of the picture.
"""

import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from service.errors import TruthError
from service.questions.scoring.object_rows import ObjectRows
from service.questions.scoring.pairs import BoolArray, FloatArray, IntArray, StrArray
from service.questions.scoring.scene_view import SceneView
from vision.objects import Table

EDGE_M = 1.0
STANDING_MPS = 0.5
STANDING_US = 2_000_000

NUMBERS = ("x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m", "visible")


@dataclass(frozen=True, slots=True, eq=False)
class TruthTable(Table):
    """Hold `truth.csv`, ordered by time.

    Attributes
    ----------
    t_us : (n,). name, kind : (n,). values : (n, 7) the columns `NUMBERS`.
    """

    t_us: IntArray
    name: StrArray
    kind: StrArray
    values: FloatArray

    def times_us(self) -> IntArray:
        """Return the distinct times, ascending."""
        return np.unique(self.t_us)

    def knows(self, frame_us: IntArray) -> BoolArray:
        """Tell for which frames the truth has a time near enough."""
        return nearest_times(frame_us, self.times_us()) >= 0

    def rows_at(self, frame_us: IntArray, view: SceneView | None) -> ObjectRows:
        """Give the true rows of frames: those of the nearest time, no farther than half a step of the truth.

        Parameters
        ----------
        frame_us : (f,) times of the frames; a frame that is told twice has its rows twice.
        view : what the picture shows; None to judge the border by `visible` alone.
        """
        times_us, starts = np.unique(self.t_us, return_index=True)
        counts = np.diff(np.append(starts, len(self.t_us)))
        place = nearest_times(frame_us, times_us)
        joined = np.flatnonzero(place >= 0)
        of_frame = counts[place[joined]]
        frame = np.repeat(joined, of_frame)
        first = np.repeat(starts[place[joined]] - np.concatenate(([0], np.cumsum(of_frame)[:-1])), of_frame)
        return self._rows(np.arange(len(frame)) + first, frame.astype(np.int64), view)

    def _rows(self, row: IntArray, frame: IntArray, view: SceneView | None) -> ObjectRows:
        x_m, y_m, heading_rad, _, length_m, width_m, visible = self.values[row].T
        rows = ObjectRows(
            frame=frame,
            name=self.name[row],
            centre_m=np.column_stack((x_m, y_m)),
            heading_rad=heading_rad,
            length_m=length_m,
            width_m=width_m,
            is_border=visible == 0,
            is_standing=self._is_standing()[row],
            kind=self.kind[row],
        )
        return rows if view is None else view.look_at(rows, self.t_us[row], edge_m=EDGE_M)

    def _is_standing(self) -> BoolArray:
        """Tell which rows belong to a stretch of `STANDING_US` or more below `STANDING_MPS`."""
        order = np.lexsort((self.t_us, self.name))
        slow = self.values[order, NUMBERS.index("speed_mps")] < STANDING_MPS
        name, t_us = self.name[order], self.t_us[order]
        begins = np.append(True, (name[1:] != name[:-1]) | (slow[1:] != slow[:-1]))
        stretch = np.cumsum(begins) - 1
        first = np.flatnonzero(begins)
        last = np.append(first[1:], len(t_us)) - 1
        is_long = (t_us[last] - t_us[first] >= STANDING_US) & slow[first]
        standing = np.zeros(len(t_us), np.bool_)
        standing[order] = is_long[stretch]
        return standing


def nearest_times(frame_us: IntArray, times_us: IntArray, *, within_steps: float = 0.5) -> IntArray:
    """Find the nearest of some times for each frame.

    Parameters
    ----------
    frame_us : (f,). times_us : (t,) ascending, at least one.
    within_steps : how far the nearest may be, in median steps of the times.

    Returns
    -------
    (f,) places in `times_us`; -1 where the nearest is too far.

    Examples
    --------
    >>> nearest_times(np.array([1, 21, 99]), np.array([0, 20, 40])).tolist()
    [0, 1, -1]
    """
    step_us = float(np.median(np.diff(times_us))) if len(times_us) > 1 else 0.0
    after = np.clip(np.searchsorted(times_us, frame_us), 0, len(times_us) - 1)
    before = np.clip(after - 1, 0, None)
    is_before = np.abs(frame_us - times_us[before]) <= np.abs(times_us[after] - frame_us)
    place = np.where(is_before, before, after)
    return np.where(np.abs(times_us[place] - frame_us) <= within_steps * step_us, place, -1).astype(np.int64)


def load_truth_table(folder: Path) -> TruthTable:
    """Read `truth.csv` of a scene; raises as `read_truth`."""
    t_us, words, values = read_truth(folder, ("id", "class"), NUMBERS)
    return TruthTable(t_us, words[:, 0], words[:, 1], values)


def read_truth(folder: Path, words: Sequence[str], numbers: Sequence[str]) -> tuple[IntArray, StrArray, FloatArray]:
    """Read some columns of `truth.csv` of a scene, ordered by time.

    Returns
    -------
    (n,) the column `t_us`, (n, words) and (n, numbers) the columns of these names.

    Raises
    ------
    TruthError
        If the file is missing, lacks a column or has a row that cannot be read.
    """
    path = folder / "truth.csv"
    if not path.is_file():
        raise TruthError(f"{folder}: expected a truth folder with {path.name}, got none there")
    columns = ("t_us", *words, *numbers)
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            times, texts, values = _read(path, csv.reader(file), columns, len(words))
    except UnicodeDecodeError as error:
        raise TruthError(f"{path}: expected UTF-8 text, got byte {error.object[error.start]:#04x}") from error
    except (OSError, csv.Error) as error:
        raise TruthError(f"{path}: expected a readable CSV file, got {error}") from error
    if not times:
        raise TruthError(f"{path}: expected at least one row, got none")
    order = np.argsort(times, kind="stable")
    return np.array(times, np.int64)[order], np.array(texts, np.str_)[order], np.array(values)[order]


def _read(
    path: Path, lines: Iterator[list[str]], columns: Sequence[str], words: int
) -> tuple[list[np.int64], list[list[str]], list[list[float]]]:
    """Read the columns: the time, so many words, and then numbers."""
    header = next(lines, [])
    missing = [name for name in columns if name not in header]
    if missing:
        raise TruthError(f"{path}:1: expected columns {', '.join(columns)}, got no {missing[0]!r}")
    places = [header.index(name) for name in columns]
    times, texts, values = [], [], []
    for number, fields in enumerate(lines, start=2):
        try:
            t_us, *rest = (fields[place] for place in places)
            times.append(np.int64(int(t_us)))
            texts.append(rest[:words])
            values.append([float(text) for text in rest[words:]])
            if not all(map(math.isfinite, values[-1])):
                raise ValueError("not finite")
        except (ValueError, IndexError, OverflowError) as error:
            expected = f"{', '.join(columns)} with a whole t_us and finite numbers"
            raise TruthError(f"{path}:{number}: expected {expected}, got {','.join(fields)!r}") from error
    return times, texts, values
