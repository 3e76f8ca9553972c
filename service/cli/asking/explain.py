"""`dyknow explain` and `dyknow why-not`: why was this recognised, and why was that not?"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Sequence

LogName = Annotated[str, typer.Argument(metavar="LOG", help="Event log: sqlite:///PATH or PATH.db.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]


def explain(
    log: LogName,
    event_id: Annotated[str, typer.Argument(metavar="EVENT_ID", help="Identifier, as `dyknow events` shows it.")],
    as_json: AsJson = False,
) -> None:
    """Say why an event was recognised: its parts, the room each constraint left, and who the cars were."""
    from service.errors import NotInLogError
    from service.questions.explaining import Explainer
    from service.store.log import open_log

    with open_log(log) as opened:
        found = Explainer(opened).explain_event(event_id)
    if found is None:
        raise NotInLogError(f"log {log!r}: expected the id of one of its events, got {event_id!r}")
    if as_json:
        _print_json(found.as_record())
    else:
        print(found.render(), end="")


def why_not(
    log: LogName,
    chronicle: Annotated[str, typer.Argument(metavar="CHRONICLE", help="Name of the chronicle.")],
    roles: Annotated[
        list[str] | None, typer.Option("--role", metavar="NAME=ID", help="Object in this role; once for each role.")
    ] = None,
    start: Annotated[str | None, typer.Option("--from", help="Start of the window: 12.5s, 01:23, 12500000.")] = None,
    end: Annotated[str | None, typer.Option("--to", help="End of the window, excluded.")] = None,
    limit: Annotated[int, typer.Option(min=1, max=50, help="At most so many near misses.")] = 5,
    run: Annotated[str | None, typer.Option("--run", help="Run of the log, if it holds several.")] = None,
    chronicles: Annotated[
        list[Path] | None, typer.Option("--chronicles", help="Chronicle file; default: the chronicles of the run.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Say why a chronicle was not recognised: the instances that came closest, and what would have been enough."""
    from chronicles.explanation.json_form import to_json
    from chronicles.explanation.rendering import render
    from service.questions.explaining import AbsenceQuestion, Explainer
    from service.store.log import open_log
    from service.times import parse_media_us

    question = AbsenceQuestion(
        chronicle=chronicle,
        run=run,
        roles=_one_each(roles or ()),
        start_us=None if start is None else parse_media_us(start, parameter="--from"),
        end_us=None if end is None else parse_media_us(end, parameter="--to"),
        limit=limit,
    )
    with open_log(log) as opened:
        found = Explainer(opened).explain_absence(question, chronicles or ())
    if as_json:
        _print_json(to_json(found))
    else:
        print(render(found), end="")


def _one_each(texts: "Sequence[str]") -> dict[str, str]:
    from service.cli.asking.events import read_roles

    roles = {}
    for name, actors in read_roles(texts):
        if len(actors) > 1:
            raise typer.BadParameter(f"expected {name} once, got {' and '.join(actors)}", param_hint="--role")
        roles[name] = actors[0]
    return roles


def _print_json(record: dict[str, object]) -> None:
    import msgspec

    print(msgspec.json.encode(record).decode())
