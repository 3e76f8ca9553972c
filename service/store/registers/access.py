"""Who may ask a log over HTTP, and who changed something? Tokens by their digests, and a row for each change.

A token is 256 random bits, so its plain SHA-256 is enough: nobody can try them all, which slow digests are against.
"""

import hashlib
import re
import secrets

from msgspec.structs import asdict
from sqlalchemy import delete, insert, select

from service.errors import NotInLogError, QueryError
from service.store import schema
from service.store.entries import Scope, Token, Written
from service.store.log import EventLog

_PREFIX = "dyknow_"  # by which who looks for secrets that got away finds one
_NAME = re.compile(r"[A-Za-z0-9._-]{1,64}", re.ASCII)


def digest_of(secret: str) -> str:
    """Give what the log keeps of a token."""
    return hashlib.sha256(secret.encode()).hexdigest()


def make_token(log: EventLog, name: str, scope: Scope, *, now_us: int, expires_us: int | None = None) -> str:
    """Make a token and give it; nobody can see it again.

    Raises
    ------
    QueryError
        If the name is none, or taken.
    """
    if not _NAME.fullmatch(name):
        raise QueryError(f"token: expected a name of 1 to 64 letters, digits, '.', '_' or '-', got {name!r}")
    secret = _PREFIX + secrets.token_urlsafe(32)
    if name in [one.name for one in list_tokens(log)]:
        raise QueryError(f"token: expected a name that is free, got {name!r}")
    with log.change() as connection:
        token = Token(name, digest_of(secret), scope, now_us, expires_us)
        connection.execute(insert(schema.tokens).values(asdict(token)))
    return secret


def list_tokens(log: EventLog) -> list[Token]:
    """List the tokens of a log by name, also those that have ended."""
    return log.rows(Token, select(schema.tokens).order_by(schema.tokens.c.name))


def revoke_token(log: EventLog, name: str) -> None:
    """Let a token end now; servers that are running know within a second.

    Raises
    ------
    NotInLogError
        If there is none of that name.
    """
    with log.change() as connection:
        count = connection.execute(delete(schema.tokens).where(schema.tokens.c.name == name)).rowcount
    if not count:
        names = [one.name for one in list_tokens(log)]
        raise NotInLogError(f"log {log.place.name!r}: expected one of its tokens, {names}, got {name!r}")


def note_written(log: EventLog, one: Written) -> None:
    """Add a row at the end."""
    with log.change() as connection:
        connection.execute(insert(schema.audit).values(asdict(one)))


def list_written(log: EventLog, *, limit: int) -> list[Written]:
    """List the newest rows, the newest first."""
    table = schema.audit
    columns = [table.c[name] for name in Written.__struct_fields__]
    return log.rows(Written, select(*columns).order_by(table.c.number.desc()).limit(limit))
