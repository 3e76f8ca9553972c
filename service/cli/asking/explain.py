"""`dyknow explain` and `dyknow why-not`: why was this recognised, and why was that not?"""

from collections.abc import Sequence
from typing import Annotated

import typer

from service.cli.options import AsJson, ChronicleFiles, From, LogName, RunName, SiteOfRun, To, read_roles, read_window
from service.cli.printing import show


def explain(
    log: LogName,
    event_id: Annotated[str, typer.Argument(metavar="EVENT_ID", help="Identifier, as `dyknow events` shows it.")],
    as_json: AsJson = False,
) -> None:
    """Say why an event was recognised: its parts, the room each constraint left, and who the cars were."""
    from service.errors import NotInLogError
    from service.questions.recognition.explaining import Explainer
    from service.store.databases.location import shown
    from service.store.log import open_log

    with open_log(log) as opened:
        found = Explainer(opened).explain_event(event_id)
    if found is None:
        raise NotInLogError(f"log {shown(log)!r}: expected the id of one of its events, got {event_id!r}")
    show(found.as_record(), found.render(), as_json=as_json)


def why_not(
    log: LogName,
    chronicle: Annotated[str, typer.Argument(metavar="CHRONICLE", help="Name of the chronicle.")],
    roles: Annotated[
        list[str] | None, typer.Option("--role", metavar="NAME=ID", help="Object in this role; once for each role.")
    ] = None,
    start: From = None,
    end: To = None,
    limit: Annotated[int, typer.Option(min=1, max=50, help="At most so many near misses.")] = 5,
    run: RunName = None,
    chronicles: ChronicleFiles = None,
    site: SiteOfRun = None,
    as_json: AsJson = False,
) -> None:
    """Say why a chronicle was not recognised: the instances that came closest, and what would have been enough."""
    from chronicles.explanation.json_form import to_json
    from chronicles.explanation.rendering import render
    from service.questions.recognition.explaining import AbsenceQuestion, Explainer
    from service.store.log import open_log

    start_us, end_us = read_window(start, end)
    given = _one_each(roles or ())
    question = AbsenceQuestion(chronicle=chronicle, run=run, roles=given, start_us=start_us, end_us=end_us, limit=limit)
    with open_log(log) as opened:
        found = Explainer(opened).explain_absence(question, chronicles or (), site)
    show(to_json(found), render(found), as_json=as_json)


def _one_each(texts: Sequence[str]) -> dict[str, str]:
    roles = {}
    for name, actors in read_roles(texts):
        if len(actors) > 1:
            raise typer.BadParameter(f"expected {name} once, got {' and '.join(actors)}", param_hint="--role")
        roles[name] = actors[0]
    return roles
