"""What happens when a user says *process*? One input through the pipeline into an event log.

Everything that the user gave is checked before anything is written. A video that breaks half way, or a user who
interrupts, leaves the events up to that moment in the log, with the reason.
"""

import hashlib
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from dyknow.node import StreamReport
from service.monitoring.monitor_files import LoadedMonitors, load_monitor_files
from service.records import RunRecord, RunStatus
from service.runs.inputs.inputs import Input, TrajectoryInput, content_digest, open_input
from service.runs.inputs.site import Site, load_site
from service.runs.interrupts import Interrupts
from service.runs.pipeline import Feed, KplText, Pipeline, watched_relations
from service.runs.recording import RecordedStreams, Recorder
from service.runs.stored_streams import stream_costs, stream_records
from service.store.log import EventLog, open_log
from service.texts.chronicle_files import LoadedChronicles, load_chronicle_files, read_text
from service.texts.idle_chronicles import idle_in_stream, idle_without_roads
from service.times import utc_us
from vision.errors import VideoBroken

HISTORY_US = 330_000_000  # longer than any interval of the library's chronicles


@dataclass(frozen=True, slots=True)
class RunRequest:
    """Say what to process.

    Attributes
    ----------
    input : a video file, or a trajectory file (``.csv``).
    site : the site file; None for trajectories without roads.
    log_url : where the event log is, or is to be created.
    chronicle_files : chronicle texts; empty means the whole shipped library.
    columns : our trajectory column names to the file's.
    monitor_files : texts of monitors to run besides.
    kpl_file : declares the streams instead of the shipped text.
    detector : in the words of `service.runs.inputs.detectors`; None for that of the site file.
    """

    input: Path
    site: Path | None
    log_url: str
    chronicle_files: tuple[Path, ...] = ()
    columns: Mapping[str, str] | None = None
    monitor_files: tuple[Path, ...] = ()
    kpl_file: Path | None = None
    detector: str | None = None


@dataclass(frozen=True, slots=True)
class Progress:
    """Say how far a run has come.

    Attributes
    ----------
    frames, frame_count : done, and in all by the container (None if it does not say).
    media_us : time of the newest frame since the first one.
    elapsed_s : wall time since the run began.
    cars, events : seen and recognised so far; None where the streams do not record them.
    """

    frames: int
    frame_count: int | None
    media_us: int
    elapsed_s: float
    cars: int | None
    events: int | None

    @property
    def frames_per_s(self) -> float:
        """Return the mean processing rate."""
        return self.frames / self.elapsed_s if self.elapsed_s > 0 else 0.0

    @property
    def real_time_factor(self) -> float:
        """Return seconds of input processed in one second."""
        return self.media_us / 1e6 / self.elapsed_s if self.elapsed_s > 0 else 0.0

    @property
    def seconds_left(self) -> float | None:
        """Return the expected wall time to the end; None when the length is not known."""
        if self.frame_count is None or self.frames == 0:
            return None
        return max(0, self.frame_count - self.frames) / self.frames * self.elapsed_s


@dataclass(frozen=True, slots=True)
class RunSummary:
    """Say what a run did.

    Attributes
    ----------
    status : ``finished``, ``broken`` (the input could not be read to its end) or ``interrupted``.
    reason : where and why it stopped early; empty when finished.
    streams : what each stream carried and what its process cost.
    """

    run: str
    status: RunStatus
    reason: str
    warnings: tuple[str, ...]
    progress: Progress
    streams: tuple[StreamReport, ...]


def process(request: RunRequest, *, on_progress: Callable[[Progress], None] = lambda _: None) -> RunSummary:
    """Process one input into an event log.

    Parameters
    ----------
    on_progress : called after every frame; keep it cheap.

    Raises
    ------
    ServiceError, VisionError, ChronicleError, DyKnowError
        If any part of the request is wrong; nothing has been written then.
    """
    monitors = load_monitor_files(request.monitor_files)
    chronicles = load_chronicle_files(request.chronicle_files, messages=monitors.messages)
    monitors.check_names(chronicles.merged)
    site = load_site(request.site) if request.site else None
    source = open_input(request.input, site, request.columns, detector=request.detector)
    monitors.check_roads(str(request.site or request.input), has_roads=source.network is not None)
    kpl = None if request.kpl_file is None else KplText(str(request.kpl_file), read_text(request.kpl_file))
    feed = source.feed(chronicles.merged, monitors, kpl=kpl, clock=time.perf_counter_ns)
    recorded = RecordedStreams.of(feed.pipeline)
    record = _run_record(source, site, chronicles, monitors, pipeline=feed.pipeline, columns=request.columns or {})
    with open_log(request.log_url, "w") as log:
        return _run(source, feed, recorded, record, log=log, on_progress=on_progress)


def _run(
    source: Input,
    feed: Feed,
    recorded: RecordedStreams,
    record: RunRecord,
    *,
    log: EventLog,
    on_progress: Callable[[Progress], None],
) -> RunSummary:
    with Interrupts() as interrupts:
        writer = log.begin_run(record)
        recorder = Recorder(writer, source.network, history_us=HISTORY_US)
        recorder.attach(recorded)
        meter = _Meter(source.frame_count, recorder)
        try:
            status, reason = _feed(source, feed, meter, on_progress=on_progress, interrupts=interrupts)
        except Exception as error:
            recorder.finish("broken", f"input at {meter.last_us} us: expected to go on to its end, got {error!r}")
            raise
        writer.append_streams(stream_records(feed.pipeline))
        writer.append_costs(stream_costs(feed.pipeline))
        recorder.finish(status, reason)
    warnings = (*record.warnings, *(_lost_view(source, *lost) for lost in recorder.lost_views))
    return RunSummary(record.id, status, reason, warnings, meter.read(), feed.pipeline.node.report())


def _lost_view(source: Input, from_us: int, to_us: int | None) -> str:
    until = "its end" if to_us is None else f"{to_us / 1e6:.2f} s"
    return (
        f"{source.path.name}: the camera's view was lost from {from_us / 1e6:.2f} s to {until}; "
        "nothing is said about this time"
    )


def _feed(
    source: Input,
    feed: Feed,
    meter: "_Meter",
    *,
    on_progress: Callable[[Progress], None],
    interrupts: Interrupts,
) -> tuple[RunStatus, str]:
    """Push the whole input through the pipeline; return how it ended and why."""
    status: RunStatus = "finished"
    reason = ""
    try:
        for sample in feed.samples:
            if sample is not None:
                feed.pipeline.publish(sample)
                meter.count(sample.valid_us)
            on_progress(meter.read())
            if interrupts.came:
                raise KeyboardInterrupt
    except VideoBroken as error:
        status, reason = "broken", str(error)
    except KeyboardInterrupt:
        status, reason = "interrupted", f"input at {meter.last_us} us: expected to go on to its end, got an interrupt"
    except BrokenPipeError:
        status, reason = "interrupted", f"input at {meter.last_us} us: expected a reader of progress, got a closed pipe"
    if status == "finished" and meter.frames == 0:
        status, reason = "broken", f"{source.path}: expected at least one frame, got none"
    feed.pipeline.node.advance(meter.last_us)
    feed.pipeline.node.finish()
    return status, reason


def _run_record(
    source: Input,
    site: Site | None,
    chronicles: LoadedChronicles,
    monitors: LoadedMonitors,
    *,
    pipeline: Pipeline,
    columns: Mapping[str, str],
) -> RunRecord:
    """Describe a run; its identifier is a digest of all that its rows depend on."""
    software = f"dyknow {version('dyknow')}"
    parts = (
        software,
        source.path.name,
        source.trajectories.digest if isinstance(source, TrajectoryInput) else content_digest(source.path),
        repr(sorted(columns.items())),
        content_digest(*site.files) if site else "no site",
        source.detector,
        content_digest(*source.detector_files),
        *(f"{chronicle.name} {chronicle.version}" for chronicle in chronicles.records),
        *(f"monitor {monitor.name} {monitor.version}" for monitor in monitors.records),
        pipeline.kpl.text,
    )
    return RunRecord(
        id=hashlib.blake2b("\n".join(parts).encode(), digest_size=8).hexdigest(),
        source=source.path.name,
        start_utc_us=utc_us(site.start_utc) if site else 0,
        input_kind=source.kind,
        input=source.path.name,
        site=site.name if site else "",
        detector=source.detector,
        camera=source.camera,
        chronicles=chronicles.records,
        texts=chronicles.texts,
        relations=watched_relations(chronicles.merged, monitors),
        monitors=monitors.records,
        kpl="" if pipeline.is_shipped else pipeline.kpl.text,
        warnings=(
            *source.warnings,
            *chronicles.doubts,
            *idle_in_stream(source.path.name, chronicles.merged, monitors.messages),
            *(() if source.network is not None else idle_without_roads(source.path.name, chronicles.merged)),
            *(warning.render() for warning in pipeline.deployment.warnings),
        ),
        software=software,
    )


class _Meter:
    """Count frames and measure the time they take.

    Attributes
    ----------
    frames, last_us : how many so far, and the time of the newest.
    """

    def __init__(self, frame_count: int | None, recorder: Recorder) -> None:
        self.last_us = 0
        self.frames = 0
        self._first_us: int | None = None
        self._frame_count = frame_count
        self._recorder = recorder
        self._started_s = time.perf_counter()

    def count(self, t_us: int) -> None:
        """Count the frame of a media time."""
        if self._first_us is None:
            self._first_us = t_us
        self.last_us = t_us
        self.frames += 1

    def read(self) -> Progress:
        """Read how far the run has come, and how long that took."""
        return Progress(
            frames=self.frames,
            frame_count=self._frame_count,
            media_us=self.last_us - (self._first_us or 0),
            elapsed_s=time.perf_counter() - self._started_s,
            cars=len(self._recorder.cars) if self._recorder.records_cars else None,
            events=self._recorder.events if self._recorder.records_events else None,
        )
