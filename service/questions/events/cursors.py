"""How does a client ask for the next page? By a cursor: the key of the last row that it has, and what it asked for."""

import base64
import hashlib
import struct

import msgspec
from msgspec import Struct

from service.errors import CursorError

_CURSOR = struct.Struct(">qq8s")


def encode_cursor(key: tuple[int, int], wanted: Struct | None) -> str:
    """Make the cursor behind a key, for the same filters only; None where there are none."""
    return base64.urlsafe_b64encode(_CURSOR.pack(*key, _digest(wanted))).decode().rstrip("=")


def decode_cursor(cursor: str, wanted: Struct | None) -> tuple[int, int]:
    """Read the key of a cursor.

    Raises
    ------
    CursorError
        If it is none, or one of other filters.
    """
    try:
        raw = base64.b64decode(cursor + "=" * (-len(cursor) % 4), altchars=b"-_", validate=True)
        start_us, seq, digest = _CURSOR.unpack(raw)
    except (ValueError, struct.error) as error:
        raise CursorError(f"cursor: expected 'next_cursor' of a page, got {cursor!r}", parameter="cursor") from error
    if digest != _digest(wanted):
        message = f"cursor: expected the filters of the page it came from, got others with {cursor!r}"
        raise CursorError(message, parameter="cursor")
    return start_us, seq


def _digest(wanted: Struct | None) -> bytes:
    """Digest what is asked for, whatever the order in which alternatives were written."""
    fields = msgspec.structs.asdict(wanted) if wanted else {}
    plain = {name: sorted(value) if isinstance(value, tuple) else value for name, value in fields.items()}
    return hashlib.blake2b(msgspec.json.encode(plain, order="deterministic"), digest_size=8).digest()
