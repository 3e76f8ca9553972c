"""How do rows go into chunks, and come out again? One that is damaged or was pruned is told of, the others are read."""

import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from operator import attrgetter
from types import MappingProxyType
from typing import Any  # a value of a column is of any type

import numpy as np
from msgspec.structs import fields

from service.errors import LogError
from service.records.times import format_media
from service.store.chunks.columns import WORDS, Column, DamagedChunkError, FloatArray, LongArray, pack, unpack
from service.store.chunks.kinds import RELATIONS, SPAN_US, Chunk, ChunkKind, Record, Where

PRUNED = "pruned"

_LOGGER = logging.getLogger(__name__)


def packed(kind: ChunkKind[Record], records: Iterable[Record]) -> Iterator[Chunk]:
    """Put rows of a kind into chunks, a span after the other.

    Raises
    ------
    LogError
        If one thing has two rows of one moment.
    """
    time_of = attrgetter(kind.spans_by)

    def span(record: Record) -> int:
        return int(time_of(record)) // SPAN_US * SPAN_US

    for span_us, group in groupby(sorted(records, key=span), span):
        rows = list(group)
        if kind.of:
            _put_together(kind, rows)
        columns = {name: list(map(attrgetter(name), rows)) for name in kind.record.__struct_fields__}
        times_us = columns["t_us"]
        yield Chunk(span_us, min(times_us), max(times_us), len(rows), pack(columns))


def _put_together(kind: ChunkKind[Record], rows: list[Record]) -> None:
    key = attrgetter(kind.of, "t_us")
    rows.sort(key=key)
    for one, other in pairwise(map(key, rows)):
        if one == other:
            raise LogError(f"{kind.name}: expected one row of {one[0]!r} at {one[1]} us, got two")


def unpacked(
    kind: ChunkKind[Record],
    chunks: Iterable[Chunk],
    *,
    from_us: int | None = None,
    to_us: int | None = None,
    where: Where = MappingProxyType({}),
    log: str = "",
) -> Iterator[Record]:
    """Read rows out of chunks that come in the order of their spans, and of writing within each.

    Parameters
    ----------
    from_us, to_us : only rows with `from_us <= t_us < to_us`; None for all.
    where : conditions on the values of columns that are no numbers.
    log : names the log where it is told which chunks are missing.

    Yields
    ------
    Rows by time, those of a moment by name (car2 before car10); relation changes as they were decided.
    """
    for _, parts in _spans(kind, chunks, log, from_us=from_us, to_us=to_us, where=where):
        rows = [row for part in parts for row in part.records(kind)]
        yield from rows if kind is RELATIONS else [rows[place] for place in _by_time(kind, parts)]


def numbers(
    kind: ChunkKind[Any], chunks: Iterable[Chunk], names: Sequence[str], *, log: str = ""
) -> Iterator[tuple[int, list[str], FloatArray]]:
    """Read columns of numbers, or of truth values, out of chunks without making rows.

    Parameters
    ----------
    kind : of rows that are somebody's.
    chunks, log : as in `unpacked`.
    names : of the columns.

    Yields
    ------
    Of each span where it begins, whose each row is, and (names, rows) what it says, nan where it says nothing; in the
    order of `unpacked`.
    """
    for span_us, parts in _spans(kind, chunks, log):
        order = _by_time(kind, parts)
        owners = [owner for part in parts for owner in part.columns[kind.of].values(part.chosen)]
        table = np.hstack([np.zeros((len(names), 0)), *(part.numbers(names) for part in parts)])
        yield span_us, [owners[place] for place in order], table[:, order]


def _spans(
    kind: ChunkKind[Any],
    chunks: Iterable[Chunk],
    log: str,
    *,
    from_us: int | None = None,
    to_us: int | None = None,
    where: Where = MappingProxyType({}),
) -> Iterator[tuple[int, Sequence["_Part"]]]:
    """Open the chunks of one span after the other; at the end, tell which are missing."""
    missing: list[tuple[int, str]] = []
    try:
        for span_us, group in groupby(chunks, attrgetter("span_us")):
            parts = []
            for chunk in group:
                try:
                    columns = _with_defaults(kind, opened(chunk))
                except DamagedChunkError as error:
                    missing.append((span_us, str(error)))
                else:
                    parts.append(_Part(columns, _chosen(columns, from_us, to_us, where)))
            yield span_us, parts
    finally:
        for line in said_of_missing(kind.name, missing):
            _LOGGER.warning("log %r: %s; the rest is read", log, line)


def opened(chunk: Chunk) -> dict[str, Column]:
    """Read the columns of a chunk.

    Raises
    ------
    DamagedChunkError
        If it is damaged, or was pruned.
    """
    if chunk.data is None:
        raise DamagedChunkError(PRUNED)
    return unpack(chunk.data)


def said_of_missing(name: str, missing: Iterable[tuple[int, str]]) -> Iterator[str]:
    """Say which chunks of a kind are missing and why, those of one stretch of time in one line.

    Parameters
    ----------
    missing : where the span of each begins, in order, and why.

    Examples
    --------
    >>> list(said_of_missing("frames", [(0, "pruned"), (10_000_000, "pruned"), (90_000_000, "pruned")]))
    ['frames of 00:00.000 to 00:20.000 are pruned', 'frames of 01:30.000 to 01:40.000 are pruned']
    """
    stretch: list[tuple[int, str]] = []
    for span_us, why in [*missing, (-1, "")]:
        if stretch and (why != stretch[0][1] or span_us > stretch[-1][0] + SPAN_US or span_us < 0):
            (first_us, said), (last_us, _) = stretch[0], stretch[-1]
            yield f"{name} of {format_media(first_us)} to {format_media(last_us + SPAN_US)} are {said}"
            stretch = []
        stretch.append((span_us, why))


@dataclass(frozen=True, slots=True)
class _Part:
    """Hold the rows of a chunk that are wanted."""

    columns: Mapping[str, Column]
    chosen: LongArray

    def records(self, kind: ChunkKind[Record]) -> Iterator[Record]:
        """Make the rows."""
        return map(kind.record, *(self.columns[name].values(self.chosen) for name in kind.record.__struct_fields__))

    def numbers(self, names: Sequence[str]) -> FloatArray:
        """Give columns of numbers, (names, rows)."""
        return np.array([self.columns[name].numbers(self.chosen) for name in names])

    def codes(self, name: str) -> LongArray:
        return self.columns[name].codes[self.chosen]


def _with_defaults(kind: ChunkKind[Any], columns: Mapping[str, Column]) -> dict[str, Column]:
    """Give a field that a chunk does not know yet its default in all rows."""
    first = np.zeros(len(columns["t_us"].codes), np.int64)
    unknown = [one for one in fields(kind.record) if one.name not in columns]
    return {**columns, **{one.name: Column(WORDS, first, (one.default,)) for one in unknown}}


def _chosen(columns: Mapping[str, Column], from_us: int | None, to_us: int | None, where: Where) -> LongArray:
    t_us = columns["t_us"].codes
    is_chosen = np.ones(len(t_us), np.bool_)
    if from_us is not None:
        is_chosen &= t_us >= from_us
    if to_us is not None:
        is_chosen &= t_us < to_us
    for name, holds in where.items():
        is_chosen &= np.array([holds(word) for word in columns[name].words], np.bool_)[columns[name].codes]
    return is_chosen.nonzero()[0]


def _by_time(kind: ChunkKind[Any], parts: Sequence[_Part]) -> list[int]:
    """Give the order of the rows of some parts, one after the other."""
    if not parts:
        return []
    times_us = np.concatenate([part.codes("t_us") for part in parts])
    if not kind.of:
        return list(np.argsort(times_us, kind="stable").tolist())
    names = {word for part in parts for word in part.columns[kind.of].words}
    place_of = {name: place for place, name in enumerate(sorted(names, key=lambda name: (len(name), name)))}
    places = [np.array([place_of[word] for word in part.columns[kind.of].words])[part.codes(kind.of)] for part in parts]
    return list(np.lexsort((np.concatenate(places), times_us)).tolist())
