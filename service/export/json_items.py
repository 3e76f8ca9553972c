"""How are events written as the items of one JSON array, while they are read?"""

from collections.abc import Callable, Iterable, Iterator

import msgspec

from service.questions.events.queries import decode_event
from service.records.events import EventRecord


def json_items(pages: Iterable[Iterable[str]], make: Callable[[EventRecord], object]) -> Iterator[str]:
    """Write what is made of each event as items of a JSON array, some at once."""
    before = "\n"
    for page in filter(None, pages):
        yield before + ",\n".join(msgspec.json.encode(make(event)).decode() for event in map(decode_event, page))
        before = ",\n"
