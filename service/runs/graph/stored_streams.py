"""What ran in a run, and what did each stream carry? The report of the pipeline's node, kept with the run."""

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from msgspec import Struct
from msgspec.structs import asdict

from dyknow.streams.stream_report import StreamReport
from service.errors import NotInLogError
from service.records.runs import ProcessRecord, RunRecord, StreamInput, StreamRecord
from service.store.log import EventLog

if TYPE_CHECKING:  # what only asks for reports needs none of the engines
    from service.runs.graph.pipeline import Pipeline


class RanStream(StreamRecord, frozen=True, kw_only=True):
    """What one process and its stream did in a run, and what that cost.

    Attributes
    ----------
    busy_us : time spent in the code of the process, by a clock; None in logs from before it was kept.
    """

    busy_us: int | None = None


class StoredStreams(Struct, frozen=True):
    """The report of a run, inputs before what reads them."""

    run: str
    streams: tuple[RanStream, ...]


# What the report of a node and the log's record of it say in the same words.
_SAME = tuple({one.name for one in fields(StreamReport)} & set(StreamRecord.__struct_fields__) - {"inputs"})


def stream_record(report: StreamReport, pipeline: "Pipeline") -> StreamRecord:
    """Describe a process of a pipeline, for the log."""
    said: dict[str, Any] = {name: getattr(report, name) for name in _SAME}  # Any: fields of several types
    said["dropped"] = dict(sorted(report.dropped.items()))
    return StreamRecord(
        **said,
        made_of=pipeline.deployment.made_of.get(report.label, ""),  # none if a configuration has created it
        type=pipeline.type_of(report.label),
        inputs=tuple(map(StreamInput, report.inputs, report.policies)),
    )


def streams_of(log: EventLog, run: RunRecord) -> StoredStreams:
    """Read the report of a run.

    Raises
    ------
    NotInLogError
        If the log holds no report of it.
    """
    streams, costs = log.streams(run.id), log.costs(run.id)
    if not streams:
        raise NotInLogError(
            f"run {run.id!r}: expected a report of its streams, got none with status {run.status!r}; "
            "it is written when a run ends, so process the input again"
        )
    return StoredStreams(run.id, tuple(RanStream(**asdict(one), busy_us=costs.get(one.label)) for one in streams))


def as_report(process: ProcessRecord) -> StreamReport:
    """Give a process the form that `dyknow.streams.graph` draws; one that was only declared has carried nothing."""
    stream = RanStream(**asdict(process))
    said: dict[str, Any] = {name: getattr(stream, name) for name in _SAME}  # Any: as above
    return StreamReport(
        **said,
        inputs=tuple(one.label for one in stream.inputs),
        policies=tuple(one.policy for one in stream.inputs),
        busy_ns=1_000 * (stream.busy_us or 0),
    )
