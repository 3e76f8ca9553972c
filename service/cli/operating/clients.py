"""`dyknow token` and `dyknow webhooks`: who may ask a log over HTTP, and how far are those who are told?"""

import time
from typing import Annotated, Literal

import typer

from service.cli.options import AsJson, LogName, open_log, read_age_us
from service.cli.printing import counted, format_table, show
from service.records.times import format_utc

TokenName = Annotated[str, typer.Argument(metavar="NAME", help="Its name, for lists and for the audit.")]
TITLES = ("webhook", "state", "seq", "message")


def make(
    log: LogName,
    name: TokenName,
    scope: Annotated[
        Literal["read", "write", "admin"],
        typer.Option(help="What it allows; each one also what those before it do."),
    ] = "read",
    expires: Annotated[
        str | None, typer.Option(metavar="AGE", help="When it ends: 90d, 12h, 30min. Default: never.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Make a token and print it; it cannot be shown again."""
    from service.store.registers.access import make_token

    now_us, expires_us = time.time_ns() // 1000, None
    if expires is not None:
        refusal = f"--expires: expected an age such as 90d, 12h or 30min, got {expires!r}"
        expires_us = now_us + read_age_us(expires, refusal)
    with open_log(log) as opened:
        secret = make_token(opened, name, scope, now_us=now_us, expires_us=expires_us)
    show({"name": name, "scope": scope, "expires_us": expires_us, "token": secret}, secret, as_json=as_json)


def list_all(log: LogName, as_json: AsJson = False) -> None:
    """List the tokens of a log; a token itself is not kept."""
    from service.store.registers.access import list_tokens

    with open_log(log) as opened:
        tokens = list_tokens(opened)
    rows = [
        [one.name, one.scope, format_utc(one.made_us), format_utc(one.expires_us) if one.expires_us else "never"]
        for one in tokens
    ]
    records = [{name: getattr(one, name) for name in ("name", "scope", "made_us", "expires_us")} for one in tokens]
    show({"items": records}, format_table(("name", "scope", "made", "ends"), rows), as_json=as_json)


def revoke(log: LogName, name: TokenName, as_json: AsJson = False) -> None:
    """Let a token end now."""
    from service.store.registers.access import revoke_token

    with open_log(log) as opened:
        revoke_token(opened, name)
    show({"revoked": name}, f"token {name} is revoked", as_json=as_json)


def list_webhooks(log: LogName, as_json: AsJson = False) -> None:
    """List how far each webhook of a log is, and the events that it gave up."""
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
    from service.store.registers.deliveries import Deliveries

    with open_log(log) as opened:
        count = Deliveries(opened).retry(name)
    show({"webhook": name, "due": count}, f"{counted(count, 'event')} of {name} will be tried again", as_json=as_json)
