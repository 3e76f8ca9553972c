"""`dyknow monitor`: who breaks, or keeps, these rules in what is stored?"""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from dyknow.monitors.monitors import MonitorEvent
    from service.monitoring.stored_monitoring import Monitored


def monitor(
    log: Annotated[str, typer.Argument(metavar="LOG", help="Event log: sqlite:///PATH or PATH.db.")],
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Files of monitors.")],
    run: Annotated[str | None, typer.Option("--run", help="Run of the log, if it holds several.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Run monitors over the stored cars and relations of a log; show what was violated or satisfied, and when."""
    from service.monitoring.stored_monitoring import monitor_log

    found = monitor_log(log, files, run=run)
    if as_json:
        import msgspec

        print(msgspec.json.encode(monitored_record(found)).decode())
        return
    _print_table(found)


def monitored_record(found: "Monitored") -> dict[str, object]:
    """Write what monitors told as plain data, for JSON."""
    return {
        "run": found.run,
        "events": [_event_record(event) for event in found.events],
        "monitors": list(found.report),
    }


def _event_record(event: "MonitorEvent") -> dict[str, object]:
    return {
        "monitor": {"name": event.monitor, "version": event.version},
        "outcome": event.outcome,
        "roles": dict(event.roles),
        "since_us": event.since_us,
        "t_us": event.t_us,
    }


def _print_table(found: "Monitored") -> None:
    from service.cli.tables import format_table
    from service.times import format_media

    rows = [
        [
            format_media(event.t_us),
            event.monitor,
            event.outcome,
            " ".join(f"{role}={one}" for role, one in event.roles),
            format_media(event.since_us),
        ]
        for event in found.events
    ]
    print(format_table(["time", "monitor", "verdict", "roles", "since"], rows), end="")
    for one in found.report:
        counts = f"{one.violated} violated, {one.satisfied} satisfied, {one.undecided} undecided"
        print(f"{one.monitor}: {counts}", file=sys.stderr)
