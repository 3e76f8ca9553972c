"""Which rows are kept in chunks? Those of which there are thousands in a minute, ten seconds of one kind in each.

A chunk holds what one flush of the writer brought of a kind and of a span of ten seconds. Rows of earlier times that
come late make another chunk of their span, so a window of time is read from the chunks of its spans alone, and no
chunk is ever changed. How rows go in and come out again: `service.store.chunks.packing`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar  # a value of a column is of any type

from msgspec import Struct

from service.records.seen import CarState, FrameRecord, LeftOutFrame, RelationRecord, SeenObject, ViewRecord

SPAN_US = 10_000_000

Record = TypeVar("Record", bound=Struct)
Where = Mapping[str, Callable[[Any], bool]]
"""Conditions on the words of columns; all must hold."""


@dataclass(frozen=True, slots=True)
class ChunkKind(Generic[Record]):
    """Say how rows of a kind are kept.

    Attributes
    ----------
    name : in the table `chunks`.
    record : what a row is.
    spans_by : the time that says in which span a row is; never earlier than `t_us`.
    of : whose rows are kept together, since they are alike, and come once a moment: a column of names, or "".
    """

    name: str
    record: type[Record]
    spans_by: str = "t_us"
    of: str = ""


CAR_STATES = ChunkKind("car_states", CarState, of="car")
SEEN_OBJECTS = ChunkKind("seen_objects", SeenObject, of="vision_id")
VIEWS = ChunkKind("views", ViewRecord)
FRAMES = ChunkKind("frames", FrameRecord)
LEFT_OUT = ChunkKind("left_out_frames", LeftOutFrame)
# In the order of decision, whatever the times at which they crossed.
RELATIONS = ChunkKind("relations", RelationRecord, spans_by="decided_us")

CHUNK_KINDS: Mapping[str, ChunkKind[Any]] = {
    kind.name: kind for kind in (CAR_STATES, SEEN_OBJECTS, VIEWS, FRAMES, LEFT_OUT, RELATIONS)
}


class Chunk(NamedTuple):
    """Hold one row of the table `chunks`, without its run, kind and number.

    Attributes
    ----------
    span_us : where its ten seconds begin.
    first_us, last_us : the earliest and the latest `t_us` of its rows.
    data : what `columns.pack` wrote; None of one that was pruned.
    """

    span_us: int
    first_us: int
    last_us: int
    rows: int
    data: bytes | None
