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
        sink, waiting = io.BytesIO(), iter(rows)
        with ParquetWriter(sink, schema, compression="zstd") as writer:
            while group := list(islice(waiting, GROUP)):
                writer.write_table(_table(pa, schema, group), row_group_size=GROUP)
                yield _taken(sink)
        yield _taken(sink)

    return written()


def _table(pa: Any, schema: Any, rows: Sequence[Sequence[object]]) -> Any:
    values = zip(*rows, strict=True)
    return pa.table([pa.array(one, field.type) for one, field in zip(values, schema, strict=True)], schema=schema)


def _taken(sink: io.BytesIO) -> bytes:
    """Take what was written; pyarrow counts by itself at which byte of the file it is."""
    block = sink.getvalue()
    sink.seek(0)
    sink.truncate()
    return block
