"""What happens when a user says *process*? One input through the pipeline into an event log.

Everything that the user gave is checked before anything is written. A video that breaks half way, or a user who
interrupts, leaves the events up to that moment in the log, with the reason.
"""

import hashlib
import signal
import time
from collections import deque
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from chronicles.execution.unfit_events import UnfitCounter
from dyknow.node import Node
from dyknow.streams.stream_report import StreamReport
from service.records.runs import InputFile, RunRecord, RunStatus, SiteRecord, SourceText, StartFrom, software_version
from service.records.times import utc_us
from service.runs.activation import Activation, FollowedTexts, Text, load_with_stored
from service.runs.graph.pipeline import EngineSettings, Pipeline, declared_pipeline, watched_relations
from service.runs.graph.recording import Recorder, recorded_streams
from service.runs.graph.relations import changed_settings
from service.runs.graph.stored_streams import stream_record
from service.runs.inputs.input_kind import Asked, Input, content_digest
from service.runs.inputs.opening import open_input
from service.runs.inputs.sites.site import NO_SITE, Site, load_site
from service.runs.machine import Interrupts, cores
from service.runs.requests import RunRequest
from service.store.log import open_log
from service.texts.chronicle_files import LoadedChronicles, load_chronicle_texts, read_text
from service.texts.idle_chronicles import idle_in_stream, idle_without_roads, unfit_told
from service.texts.linkage_files import load_linkage_file
from service.texts.monitor_files import LoadedMonitors, load_monitor_files
from vision.errors import VideoBroken
from vision.video.frames import VideoSource
from vision.video.recording import is_recording

WORTH_A_PROCESS_US = 15_000_000  # beginning one takes a second
HISTORY_US = 330_000_000  # longer than any interval of the library's chronicles


@dataclass(frozen=True, slots=True)
class Progress:
    """Say how far a run has come.

    Attributes
    ----------
    frames, frame_count : looked at, and in all by the container (None if it does not say).
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
    def found(self) -> str:
        """Say what was found; that nothing was is not known of what a text of streams does not record."""
        counts = (("cars", self.cars), ("events", self.events))
        return ", ".join(f"{name} not recorded" if count is None else f"{count} {name}" for name, count in counts)

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
    record : of the run, as it was begun.
    status : ``finished``, ``broken`` (the input could not be read to its end) or ``interrupted``.
    reason : where and why it stopped early; when finished, how much of the input could not be read, or empty.
    streams : what each stream carried and what its process cost.
    was_finished : the log had the run, finished, so nothing was done.
    is_kept : False if it repeated a run that came further, which stays in its place.
    stopped_by : the signal that interrupted it; as Ctrl-C where there was none.
    """

    record: RunRecord
    status: RunStatus
    reason: str
    warnings: tuple[str, ...]
    progress: Progress
    streams: tuple[StreamReport, ...]
    was_finished: bool = False
    is_kept: bool = True
    stopped_by: signal.Signals = signal.SIGINT

    @property
    def run(self) -> str:
        """Return the identifier of the run."""
        return self.record.id


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
    request = replace(request, is_live=request.is_live or is_recording(request.input))
    chronicles, monitors, site = load_texts(request)
    source = open_input(Asked(request.input, site, request.columns, request.detector, request.rate_hz))
    monitors.check_roads(str(request.site or request.input), has_roads=source.network is not None)
    kpl = None if request.kpl_file is None else SourceText(str(request.kpl_file), read_text(request.kpl_file))
    linkage, linkage_text = load_linkage_file(request.linkage_file, site.anchoring)
    settings = EngineSettings(
        site.anchoring,
        site.relations,
        linkage,
        limits=site.limits,
        early_events=not request.final,
        watches_all=request.is_live,
    )
    feed = source.feed(apart=_looks_apart(request.workers, source.video))
    pipeline = declared_pipeline(
        feed,
        source.network,
        chronicles.merged,
        monitors,
        kpl=kpl,
        settings=settings,
        clock=time.perf_counter_ns,
    )
    recorded = recorded_streams(pipeline)
    describe = partial(_run_record, request, source, site, monitors, pipeline=pipeline, linkage=linkage_text)
    record = describe(chronicles)
    with open_log(request.log_url, "w") as log:
        if not request.again and log.has_finished(record.id):
            return RunSummary(record, "finished", "", (), Progress(0, None, 0, 0.0, None, None), (), was_finished=True)
        with Interrupts() as interrupts:
            writer = log.begin_run(record)
            recorder = Recorder(
                writer,
                source.network,
                UnfitCounter(chronicles.merged),
                history_us=HISTORY_US,
                min_confidence=request.min_confidence,
                video=source.video,
                camera=source.camera,
            )
            recorder.attach(recorded)
            texts = None
            if request.is_live and not writer.is_repeat:  # else what the run has seen is not in the log
                texts = FollowedTexts(log, request.chronicle_files, lambda: load_texts(request)[0])
            activation = Activation(
                log, writer, pipeline, recorder, chronicles, record, monitors.events, describe, texts
            )
            done = _run(source, activation, on_progress, interrupts)
    return replace(done, warnings=(*done.warnings, *(f"{source.path.name}: {note}" for note in feed.notes())))


def load_texts(request: RunRequest) -> tuple[LoadedChronicles, LoadedMonitors, Site]:
    """Read the chronicles, the monitors and the site of a request, before its input is opened.

    Raises
    ------
    ServiceError, ChronicleError, DyKnowError
        If one of them is wrong.
    """
    draft = load_monitor_files(request.monitor_files, None)
    own = [(str(path), read_text(path)) for path in request.chronicle_files]
    own += [(one.name, one.text) for one in request.chronicle_texts]

    def load(stored: Sequence[Text]) -> tuple[LoadedChronicles, LoadedMonitors]:
        """Read both, with some texts of the log besides."""
        texts = [*own, *stored]
        found = load_chronicle_texts(texts, messages=draft.messages, monitored=draft.events, with_library=not own)
        monitors = load_monitor_files(request.monitor_files, found.merged.given)
        monitors.check_names(found.merged)
        return found, monitors

    chronicles, monitors = load_with_stored(load, request.log_url) if request.is_live else load(())
    return chronicles, monitors, load_site(request.site) if request.site else NO_SITE


def _looks_apart(workers: int | None, video: VideoSource | None) -> bool:
    """Tell whether vision gets a process of its own: if asked for, or if a core is free and the video not soon over."""
    if workers is None:
        # What does not say how long it is, as a live source, is rarely short.
        return cores() > 1 and video is not None and (video.duration_us or WORTH_A_PROCESS_US) >= WORTH_A_PROCESS_US
    return workers > 0


def _run(
    source: Input, activation: Activation, on_progress: Callable[[Progress], None], interrupts: Interrupts
) -> RunSummary:
    pipeline, recorder, writer = activation.pipeline, activation.recorder, activation.writer
    meter = _Meter(source.frame_count, recorder, pipeline.node, on_progress, interrupts)
    try:
        status, reason = _feed(source, activation, meter)
    except Exception as error:
        writer.finish("broken", f"input at {meter.last_us} us: expected to go on to its end, got {error!r}")
        raise
    if status == "finished":
        recorder.record_left_out()
    reports = pipeline.node.report()
    writer.append_streams(stream_record(one, pipeline) for one in reports)
    writer.append_costs({one.label: one.busy_ns // 1_000 for one in reports})
    is_kept = writer.finish(status, reason)
    record, chronicles = activation.record, activation.chronicles.merged
    lost = (_lost_view(source, *times) for times in recorder.lost_views)
    unfit = unfit_told(source.path.name, chronicles, recorder.unfit.found, is_traffic=True)
    damage = (f"{source.path.name}: {reason}",) if status == "finished" and reason else ()
    return RunSummary(
        record=record,
        status=status,
        reason=reason,
        warnings=(*record.warnings, *lost, *unfit, *damage),
        progress=meter.read(),
        streams=reports,
        is_kept=is_kept,
        stopped_by=interrupts.came or signal.SIGINT,
    )


def _lost_view(source: Input, from_us: int, to_us: int | None, why: str) -> str:
    until = "its end" if to_us is None else f"{to_us / 1e6:.2f} s"
    return (
        f"{source.path.name}: the camera's view was lost from {from_us / 1e6:.2f} s to {until}; "
        f"nothing is said about this time{': ' + why if why else ''}"
    )


def _feed(source: Input, activation: Activation, meter: "_Meter") -> tuple[RunStatus, str]:
    """Push the whole input through the pipeline; return how it ended and why."""
    node = activation.pipeline.node
    status: RunStatus = "finished"
    reason = ""
    try:
        try:
            meter.watch(_publish(activation, meter))
        except VideoBroken as error:
            status, reason = "broken", str(error)
        node.advance(meter.last_us)
        meter.watch(node.finish_in_steps())
    except KeyboardInterrupt:
        signalled = meter.interrupts.came
        came = "an interrupt" if signalled in (None, signal.SIGINT) else signalled.name
        status, reason = "interrupted", f"input at {meter.last_us} us: expected to go on to its end, got {came}"
    except BrokenPipeError:
        status, reason = "interrupted", f"input at {meter.last_us} us: expected a reader of progress, got a closed pipe"
    if status == "interrupted":
        node.forgive()  # frames that are held would take their time
        node.advance(meter.last_us)
        node.finish()
    elif status == "finished" and meter.read().frames == 0:
        status, reason = "broken", f"{source.path}: expected at least one frame, got none"
    elif status == "finished" and source.video:
        reason = source.video.damage
    return status, reason


def _publish(activation: Activation, meter: "_Meter") -> Generator[None, None, None]:
    """Publish every sample of the input; stop after each, and wherever one sample has many answers."""
    pipeline = activation.pipeline
    for sample in pipeline.feed.samples:
        activation.look()
        yield from pipeline.publish_in_steps(sample)
        meter.count(sample.valid_us)
        yield


def _run_record(
    request: RunRequest,
    source: Input,
    site: Site,
    monitors: LoadedMonitors,
    chronicles: LoadedChronicles,
    *,
    pipeline: Pipeline,
    linkage: str,
) -> RunRecord:
    """Describe a run; its identifier is a digest of all that its rows depend on."""
    software = f"dyknow {software_version()}"
    file = _input_file(source)
    start_utc_us, start_from = _start(request, site, source.video)
    parts = (
        software,
        source.path.name,
        file.digest,
        repr(sorted((request.columns or {}).items())),
        content_digest(*site.files) if site.files else "no site",
        source.detector,
        content_digest(*source.detector_files),
        *(() if request.is_live else (f"{chronicle.name} {chronicle.version}" for chronicle in chronicles.records)),
        *(f"monitor {monitor.name} {monitor.version}" for monitor in monitors.records),
        pipeline.kpl.text,
        *((linkage,) if linkage else ()),
        *((f"start {start_utc_us}",) if start_from == "option" else ()),
        *(() if request.rate_hz is None else (f"rate {request.rate_hz:g}",)),
        *(("final",) if request.final else ()),
        *(() if request.min_confidence is None else (f"min_confidence {request.min_confidence!r}",)),
    )
    return RunRecord(
        id=hashlib.blake2b("\n".join(parts).encode(), digest_size=8).hexdigest(),
        source=source.path.name,
        start_utc_us=start_utc_us,
        start_from=start_from,
        file=file,
        input_kind=source.kind,
        input=source.path.name,
        site=site.name,
        site_file=_site_record(site) if site.files else None,
        detector=source.detector,
        camera=source.camera,
        chronicles=chronicles.records,
        texts=chronicles.texts,
        relations=watched_relations(chronicles.merged, monitors, watches_all=request.is_live),
        monitors=monitors.records,
        kpl="" if pipeline.is_shipped else pipeline.kpl.text,
        linkage=linkage,
        settings=_settings(request) | changed_settings(site.relations),
        warnings=(
            *source.warnings,
            *chronicles.doubts,
            *idle_in_stream(source.path.name, chronicles.merged, monitors.messages),
            *(() if source.network is not None else idle_without_roads(source.path.name, chronicles.merged)),
            *(warning.render() for warning in pipeline.deployment.warnings),
        ),
        software=software,
    )


def _site_record(site: Site) -> SiteRecord:
    origin_deg = (site.frame.origin_lat_deg, site.frame.origin_lon_deg) if site.frame else None
    return SiteRecord(str(site.files[0].absolute()), content_digest(*site.files), origin_deg)


def _settings(request: RunRequest) -> dict[str, str]:
    """Tell in words what differs from the defaults."""
    settings = {"events": "final"} if request.final else {}
    if request.rate_hz is not None:
        settings["rate_hz"] = f"{request.rate_hz:g}"
    if request.min_confidence is not None:
        settings["min_confidence"] = f"{request.min_confidence:g}"
    return settings


def _input_file(source: Input) -> InputFile:
    path, video, (size_bytes, digest) = source.path, source.video, source.contents
    facts = () if video is None else ("first_pts_us", "codec", "width_px", "height_px")
    return InputFile(
        path=str(path.absolute() if path.exists() else path),
        size_bytes=size_bytes,
        digest=digest,
        **{name: getattr(video, name) for name in facts},
    )


def _start(request: RunRequest, site: Site, video: VideoSource | None) -> tuple[int, StartFrom]:
    """Tell when media time zero was, and who says so."""
    if request.start_utc_us is not None:
        return request.start_utc_us, "option"
    if video and video.created_utc and is_recording(Path(video.path)):  # a site may be older than what it sees now
        return utc_us(video.created_utc), "video"
    if site.start_utc:
        return utc_us(site.start_utc), "site"
    if video and video.created_utc:
        return utc_us(video.created_utc), "video"
    return 0, "unknown"


@dataclass(slots=True)
class _Meter:
    """Count frames and measure the time they take; a frame that a unit still owes an answer to is not done.

    Attributes
    ----------
    frames, last_us : how many were done when last read, and the time of the newest.
    on_progress, interrupts : who is told after each step, and what may have asked to stop.
    """

    frame_count: int | None
    recorder: Recorder
    node: Node
    on_progress: Callable[[Progress], None]
    interrupts: Interrupts
    last_us: int = 0
    frames: int = 0
    _first_us: int | None = None
    _published_us: deque[int] = field(default_factory=deque)  # and not known to be done
    _started_s: float = field(default_factory=time.perf_counter)

    def watch(self, steps: Generator[None, None, None]) -> None:
        """Take the steps; tell the progress after each, and look whether to go on."""
        with closing(steps):
            for _ in steps:
                self.on_progress(self.read())
                if self.interrupts.came:
                    raise KeyboardInterrupt

    def count(self, t_us: int) -> None:
        """Count the frame of a media time."""
        self._published_us.append(t_us)

    def read(self) -> Progress:
        """Read how far the run has come, and how long that took."""
        owed_us = self.node.owes_from_us
        while self._published_us and (owed_us is None or self._published_us[0] < owed_us):
            self.last_us = self._published_us.popleft()
            self._first_us = self.last_us if self._first_us is None else self._first_us
            self.frames += 1
        return Progress(
            frames=self.frames,
            frame_count=self.frame_count,
            media_us=self.last_us - (self._first_us or 0),
            elapsed_s=time.perf_counter() - self._started_s,
            cars=self.recorder.cars if self.recorder.records_cars else None,
            events=self.recorder.events if self.recorder.records_events else None,
        )
