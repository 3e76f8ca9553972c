"""How do thousands of rows become few bytes? Column by column, as differences from row to row, compressed together.

Numbers that are no whole ones are kept as whole parts: places, sizes and speeds in hundredths, all else in thousandths.
What is no number (names, truth values, tuples) is kept once, and each row has its place among those. A chunk says
itself which columns it has, so a later version may have more. Differences are those of Gorilla (Pelkonen and others,
VLDB 2015), the order of their bytes that of the shuffle filter of HDF5.
"""

import zlib
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any  # a value is of any type that JSON has

import msgspec
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
LongArray = NDArray[np.int64]

WORDS, WHOLE = 0, 1
_PARTS = dict.fromkeys(("x_m", "y_m", "along_m", "length_m", "width_m", "speed_mps"), 100)
_USUAL_PARTS = 1000
_EVEN = ("x_m", "y_m", "along_m")  # who moves on evenly has small differences of differences
_NONE = np.iinfo(np.int64).min
_EXACT = 2.0**53  # below it every whole number is a float
_HEAD_BYTES = 4


class DamagedChunkError(ValueError):
    """Bytes are not those that were written."""


class _Head(msgspec.Struct, frozen=True):
    name: str
    parts: int
    steps: int  # differences of how many-th order
    size: int
    words: tuple[Any, ...] = ()


@dataclass(frozen=True, slots=True)
class Column:
    """Hold one column of a chunk; entry k of `codes` belongs to row k.

    Attributes
    ----------
    parts : into how many a unit is divided; `WHOLE` where the values are whole numbers, `WORDS` where they are none.
    codes : (n,) whole numbers: the parts, or places among the words.
    words : the different values, in the order in which they came first; none of numbers.
    """

    parts: int
    codes: LongArray
    words: tuple[Any, ...] = ()

    def numbers(self, rows: LongArray) -> FloatArray:
        """Give the values of some rows, which are numbers or truth values, as floats; nan for None."""
        codes = self.codes[rows]
        if self.parts == WORDS:
            return np.array(self.words, np.float64)[codes]
        return np.where(codes == _NONE, np.nan, codes / self.parts)

    def values(self, rows: LongArray) -> list[Any]:
        """Give the values of some rows."""
        codes = self.codes[rows]
        if self.parts == WORDS:
            return [self.words[code] for code in codes.tolist()]
        if self.parts == WHOLE:
            return list(codes.tolist())
        values: list[float | None] = (codes / self.parts).tolist()
        for row in (codes == _NONE).nonzero()[0].tolist():
            values[row] = None
        return values


def pack(columns: Mapping[str, Sequence[Any]]) -> bytes:
    """Write columns of equal length as one chunk.

    Parameters
    ----------
    columns : by name, at least one; each of whole numbers below 2^63, of numbers, or of other values that JSON has.
        None may stand among numbers that are no whole ones, and among other values. A name may say
        in how many parts its numbers are kept.

    Examples
    --------
    >>> chunk = pack({"t_us": [0, 80_000], "car": ["car7", "car7"], "x_m": [1.004, None]})
    >>> {name: column.values(np.arange(2)) for name, column in unpack(chunk).items()}
    {'t_us': [0, 80000], 'car': ['car7', 'car7'], 'x_m': [1.0, None]}
    """
    heads, parts = [], []
    for name, values in columns.items():
        column = _coded(values, _PARTS.get(name, _USUAL_PARTS))
        steps = 2 if name in _EVEN else 1
        planes = _planes(column.codes, steps)
        heads.append(_Head(name, column.parts, steps, len(planes), column.words))
        parts.append(planes.tobytes())
    head = msgspec.json.encode(heads)
    return zlib.compress(b"".join([len(head).to_bytes(_HEAD_BYTES, "little"), head, *parts]), zlib.Z_BEST_COMPRESSION)


def unpack(chunk: bytes) -> dict[str, Column]:
    """Read what `pack` wrote.

    Raises
    ------
    DamagedChunkError
        If a byte is missing or another one; zlib's checksum tells.
    """
    try:
        plain = zlib.decompress(chunk)
        at = _HEAD_BYTES + int.from_bytes(plain[:_HEAD_BYTES], "little")
        heads = msgspec.json.decode(plain[_HEAD_BYTES:at], type=list[_Head])
    except (zlib.error, msgspec.MsgspecError) as error:
        raise DamagedChunkError(f"damaged: expected the bytes that were written, got {str(error)!r}") from None
    count = (len(plain) - at) // sum(head.size for head in heads)
    columns = {}
    for head in heads:
        planes = np.frombuffer(plain, np.uint8, head.size * count, at).reshape(head.size, count)
        at += planes.size
        # JSON has no tuples.
        words = tuple([tuple(word) if isinstance(word, list) else word for word in head.words])
        columns[head.name] = Column(head.parts, _codes(planes, head.steps), words)
    return columns


def _coded(values: Sequence[Any], parts: int) -> Column:
    types = set(map(type, values))
    if types == {int}:
        return Column(WHOLE, np.array(values, np.int64))
    if float in types and types <= {int, float, type(None)}:
        scaled = np.array(values, np.float64) * parts  # None is nan
        is_none = np.isnan(scaled)
        scaled[is_none] = 0.0
        if np.abs(scaled).max() < _EXACT:
            codes = np.rint(scaled).astype(np.int64)
            codes[is_none] = _NONE
            return Column(parts, codes)
    places: dict[Hashable, int] = {}
    codes = np.array([places.setdefault(value, len(places)) for value in values], np.int64)
    return Column(WORDS, codes, tuple(places))


def _planes(codes: LongArray, steps: int) -> NDArray[np.uint8]:
    """Give the bytes of the differences from row to row, (size, n): all lowest ones, then all second ones.

    Small ones of either sign have few bytes: 0, -1, 1, -2 are 0, 1, 2, 3. What overflows comes back the same way.
    """
    for _ in range(steps):
        codes = np.diff(codes, prepend=np.int64(0))
    folded = ((codes << 1) ^ (codes >> 63)).astype("<i8").view(np.uint64)
    size = max(1, (int(folded.max()).bit_length() + 7) // 8)
    return np.ascontiguousarray(folded.view(np.uint8).reshape(-1, 8)[:, :size].T)


def _codes(planes: NDArray[np.uint8], steps: int) -> LongArray:
    size, count = planes.shape
    whole = np.zeros((count, 8), np.uint8)
    whole[:, :size] = planes.T
    folded = whole.reshape(-1).view("<i8").astype(np.int64)
    codes = (folded.view(np.uint64) >> np.uint64(1)).view(np.int64) ^ -(folded & 1)
    for _ in range(steps):
        codes = np.cumsum(codes)
    return codes
