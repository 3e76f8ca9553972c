"""What if trajectories come row by row? The rows of a recording, in the order of time while it still grows."""

import logging
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from io import RawIOBase
from itertools import chain
from pathlib import Path
from typing import ClassVar

from service.errors import InputError
from service.records.runs import InputKind
from service.runs.graph.pipeline import TRAJECTORIES, Feed
from service.runs.inputs.input_kind import Asked, Input
from service.runs.inputs.trajectories import RowReader, Rows, TrajectoryObjects
from service.texts.csv_table import ROW_SUFFIXES, read_line_by_line
from vision.video.recording import connections, is_recording, parts_so_far

WAIT_US = 1_000_000
"""How far a row may lie behind the newest one; by reason: sensors differ by less, and events come so much later."""
_MOST_TOLD = 20

_LOGGER = logging.getLogger(__name__)


class ArrivingRows:
    """Read the rows of a recording while it grows; those that are wrong or late are told, counted, and left out.

    Parameters
    ----------
    folder : of the recording; its first line is waited for.
    columns : our column names to those of the header, where they differ.

    Raises
    ------
    InputError
        If the header lacks a column.
    """

    def __init__(self, folder: Path, columns: Mapping[str, str] | None) -> None:
        self._name = folder.name
        lines = (line for _, stream in connections(folder) for line in _lines(stream))
        first = next(lines, "")
        self._table = read_line_by_line(self._name, first)
        self._lines = enumerate(chain([first], lines), start=1)
        self._reader = RowReader(self._name, self._table.header, columns or {})
        self._left_out = 0

    def __iter__(self) -> Iterator[TrajectoryObjects]:
        """Yield the objects of each time, in order, once no more of them are waited for; may be taken once."""
        held, newest_us = Rows(), 0
        for number, line in self._lines:
            if number < self._table.first or not line.strip():
                continue
            try:
                fields = self._table.fields(line, number)
                t_us = self._reader.add(held, f"{self._name}:{number}", fields, newest_us - WAIT_US)
            except InputError as error:
                self._left_out += 1
                if self._left_out <= _MOST_TOLD:
                    _LOGGER.warning("%s; the row is left out", error)
                continue
            if t_us > newest_us:
                newest_us = t_us
                yield from self._taken(held, newest_us - WAIT_US)
        yield from self._taken(held, newest_us + 1)

    def notes(self) -> tuple[str, ...]:
        """Say at the end what people should know."""
        left_out = f"{self._left_out} rows were left out, wrong or more than {WAIT_US / 1e6:g} s late"
        return (*self._reader.warnings, *([left_out] if self._left_out else []))

    def _taken(self, held: Rows, before_us: int) -> Iterable[TrajectoryObjects]:
        """Take the objects before a time out of those that are held."""
        ready = {key: held.pop(key) for key in list(held) if key[0] < before_us}
        return self._reader.gathered(ready) if ready else ()


def _lines(stream: RawIOBase) -> Iterator[str]:
    """Give whole lines; what a writer that was killed left of one is none."""
    rest = b""
    while data := stream.read(1 << 16):
        *lines, rest = (rest + data).split(b"\n")
        # A byte that is no UTF-8 is written out, so that it is told where it stands.
        yield from (line.decode("utf-8-sig", "backslashreplace") for line in lines)


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedRows(Input):
    """Read the rows of a recording; vision is skipped."""

    kind: ClassVar[InputKind] = "trajectory"
    rows: ArrivingRows

    @classmethod
    def fits(cls, asked: Asked) -> bool:
        """Take a recording of rows, unless a detector is to look at it."""
        is_one = asked.detector is None and is_recording(asked.path)
        return is_one and parts_so_far(asked.path)[0].file.endswith(ROW_SUFFIXES)

    @classmethod
    def open(cls, asked: Asked) -> "RecordedRows":
        """Read the header."""
        return cls(path=asked.path, rows=ArrivingRows(asked.path, asked.columns), network=asked.site.network)

    def feed(self, *, apart: bool = False) -> Feed:
        """Give the objects of each time; nothing needs to look at them."""
        return Feed(TRAJECTORIES, self.rows, notes=self.rows.notes)
