"""`dyknow process`: how does a video or a trajectory file become an event log?"""

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import options
from service.cli.making.jobs import add_jobs
from service.cli.making.many import QUEUE, expanded, logs_of, process_many, site_beside
from service.cli.printing import INVALID, SIGNALLED, print_json, tell
from service.records.times import format_utc, parse_utc_us
from service.runs.machine import cores
from service.store.databases.location import shown

if TYPE_CHECKING:
    from service.records.runs import RunRecord
    from service.runs.processing import Progress, RunSummary
    from service.runs.requests import RunRequest

REPORT_EVERY_S = 1.0


def process(
    *,
    inputs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="INPUT", help="Videos, or trajectories (.csv, .jsonl); folders of videos, patterns."),
    ] = None,
    log: Annotated[str | None, typer.Option(help="Event log: PATH.db, or a URL; made if missing.")] = None,
    logs: Annotated[Path | None, typer.Option(help="Folder of logs, one for each input; made if missing.")] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Of several inputs, so many at once. Default: a core each.")
    ] = None,
    site: options.SiteOfInput = None,
    chronicles: options.ChroniclesToRun = None,
    monitors: options.MonitorsToRun = None,
    kpl: options.KplFile = None,
    linkage: options.LinkageFile = None,
    columns: Annotated[str | None, typer.Option(help="Column map for rows: t_s=t,x_m=x,y_m=y,...")] = None,
    detector: Annotated[
        str | None, typer.Option(help="auto, motion, motion:thermal, motion:both, onnx:NAME, onnx:PATH or file:PATH.")
    ] = None,
    detections: Annotated[
        Path | None, typer.Option(help="File of detections (.txt, .csv), for a video or, without INPUT, alone.")
    ] = None,
    rate: options.Rate = None,
    start_utc: Annotated[str | None, typer.Option(help="When the input starts: 2026-05-01T08:00:00Z.")] = None,
    final: options.Final = False,
    min_confidence: options.MinConfidence = None,
    queue: Annotated[
        bool,
        typer.Option("--queue", help="Only add it, or several, to the jobs of the log, which workers process."),
    ] = False,
    again: Annotated[bool, typer.Option("--again", help="Process a run that is finished in the log again.")] = False,
    workers: options.VisionWorkers = "auto",
    as_json: Annotated[
        bool, typer.Option("--json", help="One JSON line a second on stdout, and one at the end.")
    ] = False,
) -> None:
    """Process videos, trajectory files or files of detections into an event log; with --logs, each into its own."""
    from service.runs.requests import RunRequest

    if (logs is None) == (log is None):
        raise typer.BadParameter(f"expected one of --log and --logs, got {'neither' if logs is None else 'both'}")
    given, looks = chosen_inputs(expanded(inputs or []), detector, detections)
    is_job = queue or logs is not None or len(given) > 1
    request = RunRequest(
        input=given[0],
        site=site,
        log_url="" if log is None or is_job else log,
        chronicle_files=tuple(chronicles or ()),
        columns=parse_columns(columns),
        monitor_files=tuple(monitors or ()),
        kpl_file=kpl,
        linkage_file=linkage,
        detector=looks,
        rate_hz=None if rate is None else parse_rate(rate),
        start_utc_us=None if start_utc is None else parse_utc_us(start_utc, parameter="--start-utc"),
        final=final,
        min_confidence=min_confidence,
        again=again,
        workers=None if workers == "auto" else int(workers),
    )
    if not is_job:
        _process_one(request, as_json=as_json)
        return
    requests = [replace(request, input=one, site=site or site_beside(one)) for one in given]
    if logs is not None:
        requests = [replace(one, log_url=own) for one, own in zip(requests, logs_of(given, logs), strict=True)]
        logs.mkdir(parents=True, exist_ok=True)
        log = str(logs / QUEUE)
    assert log is not None
    if queue:
        add_jobs(requests, log, "run", as_json=as_json)
    else:
        at_once = min(jobs or cores(), len(given))
        raise typer.Exit(process_many(requests, log, at_once=at_once, as_json=as_json))


def _process_one(request: "RunRequest", *, as_json: bool) -> None:
    """Process one input, tell how far it is and what came of it, and leave if it was stopped."""
    from service.runs.processing import process as run

    if as_json:
        told = _every(REPORT_EVERY_S, lambda now: print_json({"type": "progress", **_progress_record(now)}))
        summary = run(request, on_progress=told)
    else:
        with progress_bar(request.input.name) as on_progress:
            summary = run(request, on_progress=on_progress)
    print_summary(summary, request.log_url, as_json=as_json)
    leave_if_cut(summary)


def leave_if_cut(summary: "RunSummary") -> None:
    """Leave with an error if a run did not come to the end of its input."""
    if summary.status != "finished":
        raise typer.Exit(SIGNALLED + summary.stopped_by if summary.status == "interrupted" else INVALID)


def chosen_inputs(inputs: list[Path], detector: str | None, detections: Path | None) -> tuple[list[Path], str | None]:
    """Tell what to process and with which detector.

    Raises
    ------
    typer.BadParameter
        If there is nothing to process, two detectors, or a file of detections for more than one thing.

    Examples
    --------
    >>> chosen_inputs([], None, Path("found.csv"))
    ([PosixPath('found.csv')], 'file:found.csv')
    """
    if detections is not None and detector is not None:
        raise typer.BadParameter(f"expected one of --detector and --detections, got {detector!r} and {detections!s}")
    if detections is not None and len(inputs) > 1:
        raise typer.BadParameter(f"--detections: expected one input to go with a file of boxes, got {len(inputs)}")
    if detections is None:
        if not inputs:
            raise typer.BadParameter("expected INPUT, or --detections alone; got neither")
        return inputs, detector
    return inputs or [detections], f"file:{detections}"


def parse_rate(text: str) -> float:
    """Read how many frames are looked at in a second; infinite for all.

    Raises
    ------
    typer.BadParameter
        If it is neither a number above 0 nor ``full``.

    Examples
    --------
    >>> parse_rate("12.5"), parse_rate("full")
    (12.5, inf)
    """
    try:
        rate_hz = math.inf if text == "full" else float(text)
    except ValueError:
        rate_hz = math.nan
    if not rate_hz > 0:
        raise typer.BadParameter(f"--rate: expected frames a second, above 0, or full; got {text!r}")
    return rate_hz


def parse_columns(text: str | None) -> dict[str, str] | None:
    """Read a column map as given on the command line.

    Raises
    ------
    typer.BadParameter
        If a part is not ``ours=theirs``.

    Examples
    --------
    >>> parse_columns("t_s=t, x_m=x")
    {'t_s': 't', 'x_m': 'x'}
    """
    if text is None:
        return None
    pairs = [part.strip().partition("=") for part in text.split(",")]
    for ours, equals, theirs in pairs:
        if not (ours and equals and theirs):
            raise typer.BadParameter(f"--columns: expected NAME=COLUMN parts, got {ours + equals + theirs!r}")
    return {ours.strip(): theirs.strip() for ours, _, theirs in pairs}


@contextmanager
def progress_bar(title: str) -> "Iterator[Callable[[Progress], None]]":
    """Show a run's progress on a terminal, or a line a second elsewhere; yields the callback for the run."""
    if not sys.stderr.isatty():
        yield _every(REPORT_EVERY_S, _print_line)
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as RichProgress

    percentage, rates = TextColumn("{task.percentage:>3.0f} %"), TextColumn("{task.fields[rates]}")
    columns = TextColumn("{task.description}"), BarColumn(), percentage, rates, TimeRemainingColumn()
    with RichProgress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task(title, total=None, rates="")
        yield _every(
            REPORT_EVERY_S / 5,
            lambda now: bar.update(task, completed=now.frames, total=now.frame_count, rates=_rates(now)),
        )


def _print_line(progress: "Progress") -> None:
    left = progress.seconds_left
    rest = f", {left:.0f} s left" if left is not None else ""
    print(f"{progress.frames} frames, {_rates(progress)}{rest}", file=sys.stderr, flush=True)


def _every(period_s: float, report: "Callable[[Progress], None]") -> "Callable[[Progress], None]":
    """Return a function that passes on what it is told once a period."""
    due_s = time.monotonic() + period_s

    def report_when_due(progress: "Progress") -> None:
        """Pass it on if a period has passed since the last time."""
        nonlocal due_s
        now_s = time.monotonic()
        if now_s >= due_s:
            due_s = now_s + period_s
            report(progress)

    return report_when_due


def _rates(progress: "Progress") -> str:
    if progress.frames == 0:  # vision holds the first frames until it knows the road
        return "learning the road"
    return f"{progress.frames_per_s:.0f} frames/s, {progress.real_time_factor:.1f}x real time, {progress.found}"


def _progress_record(progress: "Progress") -> dict[str, object]:
    left = progress.seconds_left
    return {
        "frames": progress.frames,
        "frame_count": progress.frame_count,
        "media_us": progress.media_us,
        "elapsed_s": round(progress.elapsed_s, 3),
        "frames_per_s": round(progress.frames_per_s, 1),
        "real_time_factor": round(progress.real_time_factor, 2),
        "seconds_left": None if left is None else round(left, 1),
        "cars": progress.cars,
        "events": progress.events,
    }


def _summary_record(summary: "RunSummary") -> dict[str, object]:
    return {
        "type": "summary",
        "run": summary.run,
        "status": summary.status,
        "was_finished": summary.was_finished,
        "start_utc": format_utc(summary.record.start_utc_us),
        "start_from": summary.record.start_from,
        "reason": summary.reason,
        "warnings": summary.warnings,
        **_progress_record(summary.progress),
        "streams": [
            {"label": one.label, "published": one.published, "dropped": one.dropped, "busy_ms": one.busy_ns / 1e6}
            for one in summary.streams
        ],
    }


def print_summary(summary: "RunSummary", log: str, *, as_json: bool) -> None:
    """Print what a run did, and why it stopped early if it did."""
    if as_json:
        print_json(_summary_record(summary))
    else:
        _print_facts(summary, log)
    tell_if_cut(summary)


def tell_if_cut(summary: "RunSummary") -> None:
    """Say why a run did not come to the end of its input."""
    if summary.status != "finished":
        kept = "the events up to there are kept" if summary.is_kept else "the run in the log came further and stays"
        tell("error", [f"{summary.reason}; {kept}"])


def _print_facts(summary: "RunSummary", log: str) -> None:
    """Print what a run did and what to ask next."""
    if summary.was_finished:
        print(f"run {summary.run} is finished in {shown(log)}, so nothing was done; --again processes it once more")
        return
    progress = summary.progress
    tell("warning", summary.warnings)
    print(
        f"{progress.frames} frames, {progress.media_us / 1e6:.1f} s of input in {progress.elapsed_s:.1f} s "
        f"({progress.real_time_factor:.1f}x real time): {progress.found}"
    )
    print(f"media time 0:   {_start(summary.record)}")
    if progress.frames:
        costs = (f"{one.label} {one.busy_ns / 1e6 / progress.frames:.2f} ms" for one in summary.streams if one.updates)
        print(f"cost per frame: {', '.join(costs)}")
    print(f"ask for them:   dyknow events {shown(log)}")


def _start(record: "RunRecord") -> str:
    who = {"option": "by --start-utc", "site": "by the site file", "video": "by the video's creation time"}
    return f"{format_utc(record.start_utc_us)}, {who.get(record.start_from, 'since nobody says when it was')}"
