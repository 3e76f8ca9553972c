"""`dyknow log`: what is in a log, who wrote into it, is it readable, where is a copy, and what of it may go?"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.options import AsJson, LogName, open_log, read_age_us
from service.cli.printing import INVALID, format_table, show, tell
from service.records.times import format_media, format_utc, parse_utc_us
from service.store.databases.location import database_of, shown

if TYPE_CHECKING:
    from service.records.runs import RunRecord
    from service.store.upkeep import Holding

TITLES = ("kind", "rows", "pruned", "bytes", "from", "to")


def info(log: LogName, as_json: AsJson = False) -> None:
    """Say what a log holds: its runs, and of each kind how many rows, of how many bytes, from when to when."""
    from service.questions.events.notes import covered
    from service.store.upkeep import holdings

    with open_log(log) as opened:
        size_bytes = opened.place.size_bytes()
        runs = [(run, covered(opened, run), holdings(opened, run.id)) for run in opened.runs()]
    texts = [_about(run, time, held) for run, time, held in runs]
    records = [
        {"run": run.id, "source": run.source, "status": run.status, "covered": time, "holds": held}
        for run, time, held in runs
    ]
    text = "\n".join([f"{opened.place.name}: {size_bytes:,} bytes", *texts])
    show({"log": opened.place.name, "bytes": size_bytes, "runs": records}, text, as_json=as_json)


def _about(run: "RunRecord", time: str, held: "list[Holding]") -> str:
    rows = [
        [
            *(one.kind, str(one.rows), str(one.pruned or ""), str(one.size_bytes)),
            *("" if us is None else format_media(us) for us in (one.first_us, one.last_us)),
        ]
        for one in held
    ]
    return f"run {run.id} of {run.source}, {run.status}: {time}\n{format_table(TITLES, rows)}"


def verify(log: LogName, as_json: AsJson = False) -> None:
    """Read all of a log and say what is damaged; exit with 3 if anything is."""
    from service.store.upkeep import damage

    with open_log(log) as opened:
        found = list(damage(opened))
    if as_json or not found:
        show({"log": shown(log), "damage": found}, f"{shown(log)}: all of it can be read", as_json=as_json)
    tell("error", [] if as_json else found)
    if found:
        raise typer.Exit(INVALID)


def backup(
    log: LogName,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The copy; must not be there yet.")],
    as_json: AsJson = False,
) -> None:
    """Copy a log into a file, as it is at one moment, also while a run is written into it; read the copy."""
    _copy(log, f"sqlite:///{file}", as_json=as_json)


def restore(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A copy that `dyknow log backup` made.")],
    log: LogName,
    as_json: AsJson = False,
) -> None:
    """Make a log of a backup; a log that is there stays as it is."""
    _copy(f"sqlite:///{file}", log, as_json=as_json)


def _copy(source: str, target: str, *, as_json: bool) -> None:
    from service.store.upkeep import back_up

    found = back_up(copied := database_of(source), copy := database_of(target))
    record = {"from": copied.name, "to": copy.name, "bytes": copy.size_bytes(), "damage": found}
    show(record, f"{copy.name}: {copy.size_bytes():,} bytes, copied of {copied.name} and read", as_json=as_json)
    tell("error", (f"{copied.name}: {line}, as it is in the copy" for line in found))
    if found:
        raise typer.Exit(INVALID)


def prune(
    log: LogName,
    keep: Annotated[
        list[str],
        typer.Option(metavar="KIND=AGE", help="How long rows of a kind are kept: car_states=7d, events=365d."),
    ],
    now: Annotated[str | None, typer.Option(help="UTC time from which ages count back. Default: now.")] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would go.")] = False,
    as_json: AsJson = False,
) -> None:
    """Remove rows that are older than they are to be kept, kind by kind; kinds that are not named stay."""
    import time

    from service.store.upkeep import prune as remove

    keep_us = dict(map(_kept, keep))
    now_us = time.time_ns() // 1000 if now is None else parse_utc_us(now, parameter="--now")
    with open_log(log, "w") as opened:
        undated = [run for run in opened.runs() if run.start_from == "unknown"]
        removed = remove(opened, keep_us, now_us, dry_run=dry_run)
    rows = [[one.kind, str(one.rows), str(one.size_bytes)] for one in removed]
    table = format_table(("kind", "would go" if dry_run else "rows gone", "bytes"), rows)
    show({"log": log, "dry_run": dry_run, "removed": removed}, table, as_json=as_json)
    tell("note", (f"run {run.id!r} of {run.source} stays whole: nobody says when it was" for run in undated))


def _kept(text: str) -> tuple[str, int]:
    kind, _, age = text.partition("=")
    expected = "expected KIND=AGE such as car_states=7d, relations=36h or views=90min"
    return kind, read_age_us(age, f"--keep: {expected}, got {text!r}")


def audit(
    log: LogName,
    limit: Annotated[int, typer.Option(min=1, help="Rows at most.")] = 100,
    as_json: AsJson = False,
) -> None:
    """Say who changed something over HTTP, or tried to, the newest first."""
    from msgspec.structs import astuple

    from service.store.registers.access import list_written

    with open_log(log) as opened:
        written = list_written(opened, limit=limit)
    titles = ("at", "token", "method", "path", "status", "request")
    rows = [[format_utc(one.at_us), *map(str, astuple(one)[1:])] for one in written]
    show({"items": written}, format_table(titles, rows), as_json=as_json)
