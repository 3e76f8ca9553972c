"""How are the items of one JSON array or object written, while they are made?"""

from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Any  # JSON

import msgspec

Json = dict[str, Any]
_AT_ONCE = 1_000


def json_items(items: Iterable[str]) -> Iterator[str]:
    """Write JSON texts as items of an array, or members of an object, some at once."""
    left, before = iter(items), "\n"
    while some := ",\n".join(islice(left, _AT_ONCE)):
        yield before + some
        before = ",\n"


def as_json(item: object) -> str:
    """Write plain data as JSON text."""
    return msgspec.json.encode(item).decode()
