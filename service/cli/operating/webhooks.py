"""`dyknow webhooks`: how far are the webhooks of a log, and what did they give up?"""

from typing import Annotated

import typer

from service.cli.options import AsJson, LogName
from service.cli.printing import counted, format_table, show

TITLES = ("webhook", "state", "seq", "message")


def list_webhooks(log: LogName, as_json: AsJson = False) -> None:
    """List how far each webhook of a log is, and the events that it gave up."""
    from service.store.log import open_log
    from service.store.registers.deliveries import Deliveries

    with open_log(log) as opened:
        deliveries = Deliveries(opened)
        states, undelivered = deliveries.states(), deliveries.undelivered()
    rows = [[one.name, "delivered up to", str(one.seq), one.message] for one in states]
    rows += [[one.webhook, "due" if one.is_due else "given up", str(one.seq), one.message] for one in undelivered]
    show({"items": states, "undelivered": undelivered}, format_table(TITLES, sorted(rows)), as_json=as_json)


def retry_webhook(
    log: LogName,
    name: Annotated[str, typer.Argument(metavar="WEBHOOK", help="Its name in the file.")],
    as_json: AsJson = False,
) -> None:
    """Let what a webhook gave up be tried once more, by the server that delivers."""
    from service.store.log import open_log
    from service.store.registers.deliveries import Deliveries

    with open_log(log) as opened:
        count = Deliveries(opened).retry(name)
    show({"webhook": name, "due": count}, f"{counted(count, 'event')} of {name} will be tried again", as_json=as_json)
