"""What is an instance, and how is an event in it kept?

A complete instance is a plain list, because many are made:
``[deadline_us, time of each position..., value of each slot..., record of each position...]`` with None where nothing
is known. A record is ``(t_us, sequence number, event)``.

Partial instances must fit into memory by the million, and most of what an event says follows from the pattern that it
fits and from the values that the instance has anyway. So a held event is only its sequence number, or, where the
pattern leaves something open or the event rests on hypotheses or is not sure,
``(sequence number, args, old, new, hypotheses, confidence)``. It is built again when its instance is complete, unless
it is one of the latest: those are still at hand in a list, at their sequence number modulo its length.
"""

from collections.abc import Callable
from typing import Any  # an instance is a heterogeneous list

from chronicles.compilation.plan import EventTest, Plan
from chronicles.events import Event

Instance = list[Any]
Record = tuple[int, int, Event]
Held = int | tuple[int, tuple[str, ...], str | None, str | None, tuple[str, ...], float]


class Layout:
    """Where the parts of an instance stand in its list."""

    def __init__(self, plan: Plan) -> None:
        self.event_slots = plan.event_slot_count
        self.slots = 1 + len(plan.positions)
        self.records = self.slots + self.event_slots


def no_records(count: int) -> list[Record]:
    """Make the list of the latest records, with none in it."""
    return [(0, -1, Event("", (), 0))] * count


def says_everything(test: EventTest) -> bool:
    """Say whether an event's arguments and values follow from the constants and variables of a pattern it fits.

    Examples
    --------
    >>> says_everything(EventTest("behind", 2, is_change=False, constants=((1, "b"),), variables=((0, 5),)))
    True
    >>> says_everything(EventTest("behind", 2, is_change=False, variables=((0, 5),)))
    False
    """
    fields = {field for field, _ in (*test.constants, *test.variables)}
    return len(fields) == test.arity + 2 * test.is_change


def record_builder(test: EventTest, recent: list[Record]) -> Callable[..., Record]:
    """Make the function that gives the record of an event that fits a pattern.

    Returns
    -------
    A function of the time, the held event, and the values of the pattern's variables in their order.
    """
    count, arity, name = len(recent), test.arity, test.name

    def record(t_us: int, held: Held, *values: str) -> Record:
        """Give the record itself if it is recent, else build it."""
        sequence = held if isinstance(held, int) else held[0]
        latest = recent[sequence % count]
        if latest[1] == sequence:
            return latest
        if not isinstance(held, int):
            return t_us, sequence, Event(name, held[1], t_us, *held[2:])
        fields = dict(test.constants)
        fields |= {field: value for (field, _), value in zip(test.variables, values, strict=True)}
        texts = tuple(fields[field] for field in range(len(fields)))
        if test.is_change:
            return t_us, sequence, Event(name, texts[:arity], t_us, texts[arity], texts[arity + 1])
        return t_us, sequence, Event(name, texts, t_us)

    return record
