"""`dyknow watch`: how does a camera become an event log that grows?"""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from service.cli import options
from service.cli.making.jobs import add_jobs, tell_line
from service.cli.making.process import parse_columns, parse_rate, print_summary, progress_bar
from service.errors import LogBackError
from service.store.databases.location import database_of, shown


def watch(
    source: Annotated[str, typer.Argument(help="rtsp://..., http://..., a device, a named pipe, or -.")],
    *,
    log: Annotated[str, typer.Option(help="Event log: PATH.db, or a URL; made if missing.")],
    recordings: Annotated[Path, typer.Option(help="Folder for what arrives; made if missing.")],
    rows: Annotated[bool, typer.Option("--rows", help="A pipe brings rows of trajectories (CSV, JSONL).")] = False,
    columns: Annotated[str | None, typer.Option(help="Column map for rows: t_s=t,x_m=x,y_m=y,...")] = None,
    hours: Annotated[float, typer.Option(min=0.01, help="A new recording, and run, begins after so long.")] = 6.0,
    keep_hours: Annotated[
        float, typer.Option(min=0.01, help="Processed recordings that are older are removed.")
    ] = 24.0,
    keep_gb: Annotated[
        float, typer.Option(min=0.01, help="Where there are more gigabytes of them, the oldest go.")
    ] = 50.0,
    site: options.SiteOfInput = None,
    chronicles: options.ChroniclesToRun = None,
    monitors: options.MonitorsToRun = None,
    kpl: options.KplFile = None,
    linkage: options.LinkageFile = None,
    detector: Annotated[str | None, typer.Option(help="auto, motion, onnx:NAME or onnx:PATH.")] = None,
    rate: options.Rate = None,
    final: options.Final = False,
    min_confidence: options.MinConfidence = None,
    workers: options.VisionWorkers = "auto",
    queue: Annotated[
        bool, typer.Option("--queue", help="Add it to the jobs of the log, for `dyknow worker --live`.")
    ] = False,
) -> None:
    """Record a live source and process it as it comes, until Ctrl-C; what was recorded can be processed again.

    A source that is cut is called again. Begun again after a kill, the run over what was left is repeated beside. Who
    must log in names a variable of the environment: rtsp://$CAMERA@camera.example/1.
    """
    from service.runs.live.live_source import kept_name, without_password
    from service.runs.live.watching import watch as watch_it
    from service.runs.requests import GIGABYTE, HOUR_US, LiveRequest, RunRequest

    run = RunRequest(
        input=recordings,  # each recording in it, in turn
        site=site,
        log_url="" if queue else log,
        chronicle_files=tuple(chronicles or ()),
        columns=parse_columns(columns),
        monitor_files=tuple(monitors or ()),
        kpl_file=kpl,
        linkage_file=linkage,
        detector=detector,
        rate_hz=None if rate is None else parse_rate(rate),
        final=final,
        min_confidence=min_confidence,
        again=True,
        workers=None if workers == "auto" else int(workers),
        is_live=True,
    )
    request = LiveRequest(
        source,
        run,
        recordings,
        longest_us=round(hours * HOUR_US),
        age_us=round(keep_hours * HOUR_US),
        size_bytes=round(keep_gb * GIGABYTE),
        is_rows=rows,
    )
    if queue:
        add_jobs([replace(request, input=kept_name(source))], log, "live", as_json=False)
        return
    database_of(log).check_writable()  # before anything is recorded
    # The source's name is shown, so without a password.
    with progress_bar(without_password(source)) as on_progress:
        told = partial(print_summary, log=log, as_json=False)
        while True:
            try:
                watch_it(request, tell=tell_line, on_progress=on_progress, on_summary=told)
            except LogBackError:
                tell_line(f"log {shown(log)!r} is back")
            else:
                break
