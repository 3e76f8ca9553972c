"""`dyknow objects`: which cars are in a log, and by what links is each the one that it is?"""

from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.options import AsJson, LogName, RunName
from service.cli.printing import format_table, show, tell

if TYPE_CHECKING:
    from service.questions.observations.identity import CarIdentity, IdentityLink

CAR_TITLES = ("car", "class", "first", "last", "vision objects", "hidden s", "undecided", "refuted", "open")
LINK_TITLES = ("start", "end", "link", "verdict", "score", "margin", "next best", "hidden s", "why", "ended by")


def objects(
    log: LogName,
    car: Annotated[str | None, typer.Argument(help="A car symbol: shows the links by which it is that car.")] = None,
    run: RunName = None,
    as_json: AsJson = False,
) -> None:
    """List the cars of a log, or the identity chain of one of them."""
    from service.questions.events.notes import run_notes
    from service.questions.events.queries import EventFilter
    from service.questions.observations.identity import identities, links_of
    from service.store.log import open_log

    with open_log(log) as opened:
        record = opened.run(run)
        if car is not None:
            links = links_of(opened, record, car)
            table = format_table(LINK_TITLES, [_link_row(one) for one in links])
            show({"run": record.id, "car": car, "links": links}, table, as_json=as_json)
            return
        cars = identities(opened, record.id)
        table = format_table(CAR_TITLES, [_car_row(one) for one in cars])
        show({"run": record.id, "cars": cars}, table, as_json=as_json)
        tell("note", run_notes([opened], EventFilter(runs=(record.id,))))
        tell("note", [] if cars else [f"run {record.id!r} of {record.source} has no cars"])


def _car_row(one: "CarIdentity") -> list[str]:
    from service.records.times import format_media

    times = [format_media(one.first_us), format_media(one.last_us)]
    counts = [str(count) if count else "" for count in (one.undecided, one.refuted, one.open)]
    return [one.car, one.car_class, *times, " ".join(one.vision_ids), _seconds(one.hidden_us), *counts]


def _link_row(one: "IdentityLink") -> list[str]:
    from service.records.times import format_media

    end = "" if one.end_us is None else format_media(one.end_us)
    hidden = _seconds(0 if one.hidden_us is None else one.start_us - one.hidden_us)
    weighed = ["" if value is None else f"{value:.1f}" for value in (one.score_nats, one.margin_nats)]
    name = f"{one.lower} -> {one.upper}"
    return [format_media(one.start_us), end, name, one.verdict, *weighed, one.runner_up, hidden, one.how, one.reason]


def _seconds(us: int) -> str:
    return f"{us * 1e-6:.2f}" if us else ""
