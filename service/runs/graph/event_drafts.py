"""How does an occurrence look as events, the rows of a log?"""

from collections.abc import Sequence
from itertools import zip_longest

from chronicles.events import Occurrence
from service.records.events import ChronicleRef, EventDraft, EventStatus, Place, SubEvent

STALE_US = 500_000
"""So long a car is where it was: where cars were while they were hidden is known for some frames only."""


def event_drafts(
    occurrence: Occurrence,
    place: Place | None,
    *,
    least: float | None = None,
    told: Sequence[str] = (),
    now_us: int = 0,
) -> list[EventDraft]:
    """Make the events of an occurrence: one for each message that it emits, or one of its own name.

    Parameters
    ----------
    place : where it began.
    least : how sure it must be, or it is doubtful; None for what its chronicle asks for.
    told : identifiers of the events that were made of it before; each is revised by the one in the same place, which is
        decided at `now_us`.
    """
    names = [event.name for event in occurrence.given]
    is_doubtful = occurrence.confidence < (occurrence.floor if least is None else least)
    status: EventStatus = "doubtful" if is_doubtful and occurrence.status != "retracted" else occurrence.status
    return [
        EventDraft(
            type=name,
            chronicle=ChronicleRef(occurrence.chronicle, occurrence.version),
            start_us=occurrence.start_us,
            end_us=occurrence.end_us,
            roles=dict(occurrence.roles),
            recognised_us=occurrence.recognised_us if revised is None else now_us,
            status=status,
            confidence=round(occurrence.confidence, 3),
            revises=revised,
            hypotheses=tuple(occurrence.hypotheses),
            sub_events=tuple(SubEvent(label, t_us) for label, t_us in occurrence.sub_events),
            place=place,
        )
        for name, revised in zip_longest(names, told)
    ]
