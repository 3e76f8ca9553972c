"""What would a chronicle text recognise in a run, and what does a change of it change? Nothing of it is written."""

from collections.abc import Iterable
from typing import Any  # JSON values

from msgspec import Struct

from service.records.events import EventRecord


class Trial(Struct, frozen=True):
    """What a text recognises in a run that it was tried on.

    Attributes
    ----------
    count : of the events in the window, the first of which are `items`.
    near_misses : by chronicle, an `Explanation` of kind `why-not`.
    warnings : what is doubtful in the text.
    """

    run: str
    count: int
    items: list[EventRecord]
    near_misses: dict[str, dict[str, Any]]
    warnings: tuple[str, ...]


class MovedEvent(Struct, frozen=True):
    """An event of the same type and roles at another time."""

    before: EventRecord
    after: EventRecord


class Difference(Struct, frozen=True):
    """What two texts recognise differently in a run; `same` counts what both do."""

    run: str
    same: int
    gained: list[EventRecord]
    lost: list[EventRecord]
    moved: list[MovedEvent]


def difference(run: str, before: Iterable[EventRecord], after: Iterable[EventRecord]) -> Difference:
    """Compare events, each in the order of time.

    Those of one type and of the same roles belong together: where their times are equal they are the same, and of the
    rest the first before and the first after are one that moved, and so on.
    """
    pairs: dict[object, tuple[list[EventRecord], list[EventRecord]]] = {}
    for side, events in enumerate((before, after)):
        for one in events:
            pairs.setdefault((one.type, *sorted(one.roles.items())), ([], []))[side].append(one)
    same, gained, lost, moved = 0, list[EventRecord](), list[EventRecord](), list[MovedEvent]()
    for old, new in pairs.values():
        left, came = _apart(old, new), _apart(new, old)
        same += len(old) - len(left)
        moved += map(MovedEvent, left, came)
        lost += left[len(came) :]
        gained += came[len(left) :]
    return Difference(run, same, gained, lost, moved)


def _apart(events: list[EventRecord], others: list[EventRecord]) -> list[EventRecord]:
    times_us = {(one.start_us, one.end_us) for one in others}
    return [one for one in events if (one.start_us, one.end_us) not in times_us]
