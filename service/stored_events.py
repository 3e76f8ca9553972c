"""What did the recogniser of a run see? The stored relation changes of the run, as events, to be looked at again.

Changes that rest on a refuted link are left out: what was recognised from them was retracted, and the run ended as if
they had never come.
"""

from collections.abc import Collection
from dataclasses import dataclass

from chronicles.chronicle_set import ChronicleSet
from chronicles.events import Event
from qsr.relations import RANK
from service.errors import LogError
from service.records import RunRecord
from service.store.log import EventLog


@dataclass(frozen=True, slots=True)
class StoredEvents:
    """Hold the events of a run, in the order in which they were decided.

    Attributes
    ----------
    until_us : the time up to which they are complete.
    """

    events: tuple[Event, ...]
    until_us: int


def stored_events(log: EventLog, run_id: str, *, believed: Collection[str] = ()) -> StoredEvents:
    """Read the events of a run.

    Parameters
    ----------
    believed : labels of refuted links whose changes are wanted all the same.
    """
    refuted = {one.label for one in log.hypotheses(run_id) if one.verdict == "refuted"}.difference(believed)
    events = tuple(
        Event(one.name, one.args, one.t_us, one.old, one.new)
        for one in log.relations(run_id)
        if refuted.isdisjoint(one.hypotheses)
    )
    return StoredEvents(events, log.last_us(run_id))


def check_watched(run: RunRecord, chronicles: ChronicleSet) -> None:
    """Refuse chronicles that look at relations which the run did not watch: their absence would say nothing.

    Raises
    ------
    LogError
        If there is such a relation.
    """
    consumed: frozenset[str] = frozenset().union(*(plan.consumes for plan in chronicles.plans))
    missing = sorted((consumed & RANK.keys()) - set(run.relations))
    if missing:
        raise LogError(
            f"run {run.id!r}: expected one that watched {', '.join(missing)}, got one that watched "
            f"{', '.join(run.relations) or 'none'}; process the input again with these chronicles"
        )
