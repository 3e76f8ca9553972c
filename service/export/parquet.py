"""How do rows become Parquet? In groups of rows with typed columns, each sent when it is full, so memory holds one.

The library is an extra: it is larger than what most logs need together.
"""

import io
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Any  # what is pyarrow's: it has no types, and may not be here

from service.errors import ExtraMissingError

GROUP = 10_000


def parquet(columns: Sequence[tuple[str, str]], rows: Iterable[Sequence[object]]) -> Iterator[bytes]:
    """Write rows as a Parquet file, some at once.

    Parameters
    ----------
    columns : names, and types in the words of pyarrow (``int64``, ``float64``, ``string``, ``bool``).
    rows : with a value for each column; None where there is none.

    Raises
    ------
    ExtraMissingError
        If the library is not installed, at once.
    """
    try:
        import pyarrow as pa
        from pyarrow.parquet import ParquetWriter
    except ModuleNotFoundError as error:
        wanted = "expected the extra 'parquet' (pip install 'dyknow[parquet]')"
        raise ExtraMissingError(f"Parquet: {wanted}, got {str(error)!r}") from error
    schema = pa.schema([(name, pa.type_for_alias(kind)) for name, kind in columns])

    def written() -> Iterator[bytes]:
        sink, waiting = _Sink(), iter(rows)
        with ParquetWriter(sink, schema, compression="zstd") as writer:
            while group := list(islice(waiting, GROUP)):
                writer.write_table(_table(pa, schema, group), row_group_size=GROUP)
                yield sink.taken()
        yield sink.taken()

    return written()


def _table(pa: Any, schema: Any, rows: Sequence[Sequence[object]]) -> Any:
    values = zip(*rows, strict=True)
    return pa.table([pa.array(one, field.type) for one, field in zip(values, schema, strict=True)], schema=schema)


class _Sink(io.RawIOBase):
    """A file of which what was written so far can be taken."""

    def __init__(self) -> None:
        self._blocks = list[bytes]()
        self._size = 0

    def writable(self) -> bool:
        return True

    def write(self, block: Any) -> int:
        self._blocks.append(bytes(block))
        self._size += len(self._blocks[-1])
        return len(self._blocks[-1])

    def tell(self) -> int:
        return self._size

    def taken(self) -> bytes:
        blocks, self._blocks = self._blocks, []
        return b"".join(blocks)
