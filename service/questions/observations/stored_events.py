"""What did the recogniser of a run see? Stored relation changes and events of monitors, to be looked at again.

Changes that rest on a refuted link are left out: what was recognised from them was retracted, and the run ended as if
they had never come.
"""

import heapq
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from operator import attrgetter, itemgetter
from pathlib import Path
from typing import NamedTuple

from chronicles.chronicle_set import ChronicleSet, load_texts
from chronicles.events import Event
from qsr.relations import RANK
from service.errors import LogError
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.records.runs import RunRecord
from service.records.seen import RelationRecord
from service.records.times import TimePoint
from service.store.log import EventLog

_DECIDED_US = attrgetter("decided_us")
_OF_THE_MAP = ("turn",)
"""Relations that are told once, with the first frame, and hold for ever."""


@dataclass(frozen=True, slots=True)
class StoredEvents:
    """Hold the events of a run, in the order in which they were decided.

    Attributes
    ----------
    until_us : the time up to which they are complete.
    """

    events: tuple[Event, ...]
    until_us: int


@dataclass(frozen=True, slots=True)
class Part:
    """Say which events of a run are wanted: of some relations, in some time, and of some things in a longer one.

    Attributes
    ----------
    names : of the relations.
    from_us, to_us : all within [from_us, to_us).
    about : the things of which more is wanted.
    first_us, last_us : of those things, all within [first_us, last_us).
    """

    names: Collection[str]
    from_us: int
    to_us: int
    about: Collection[str]
    first_us: int
    last_us: int


def stored_events(
    log: EventLog,
    run_id: str,
    *,
    believed: Collection[str] = (),
    part: Part | None = None,
    computed: Iterable[RelationRecord] = (),
) -> StoredEvents:
    """Read the events of a run.

    Parameters
    ----------
    believed : labels of refuted links whose changes are wanted all the same.
    part : which events are wanted, besides what the map told at the start; None for all.
    computed : changes of relations that the run did not watch, in the order in which they would be decided.
    """
    recorded = log.relations(run_id) if part is None else _changes(log, run_id, part)
    labels = None if part is None else {label for one in recorded for label in one.hypotheses}
    refuted = refuted_labels(log, run_id, labels) - set(believed)
    decided = _decided(_messages(log, run_id, part), heapq.merge(recorded, computed, key=_DECIDED_US), refuted)
    return StoredEvents(tuple(event for _, event in decided), log.last_us(run_id))


def streamed_events(
    log: EventLog,
    run_id: str,
    names: Collection[str],
    unwatched: "Unwatched",
    *,
    in_time: bool,
    undecided: Collection[str] = (),
) -> Iterator[Event]:
    """Stream the events of a run; in memory stand those of less than a minute.

    Parameters
    ----------
    names : of relations; all messages of monitors come too.
    unwatched : what the run did not watch of them.
    in_time : in the order in which they happened, those of one time as they were decided; else as they were decided.
    undecided : labels of links; events that rest on them say so.
    """
    recorded = log.relations(run_id, names=names)
    changes = heapq.merge(recorded, unwatched.changes, key=_DECIDED_US)
    decided = _decided(_messages(log, run_id, None), changes, refuted_labels(log, run_id), undecided)
    late_us = max(log.late_us(run_id), unwatched.late_us) if in_time else 0
    waiting: list[tuple[int, int, Event]] = []
    for number, (decided_us, event) in enumerate(decided):
        heapq.heappush(waiting, (event.t_us if in_time else decided_us, number, event))
        while waiting[0][0] < decided_us - late_us:
            yield heapq.heappop(waiting)[2]
    yield from (event for _, _, event in sorted(waiting, key=itemgetter(0, 1)))


def refuted_labels(log: EventLog, run_id: str, labels: Collection[str] | None = None) -> set[str]:
    """Name the links of a run, all or some of them, that were refuted."""
    return {one.label for one in log.hypotheses(run_id, labels=labels) if one.verdict == "refuted"}


def _decided(
    messages: Iterator[tuple[int, Event]],
    changes: Iterable[RelationRecord],
    refuted: set[str],
    undecided: Collection[str] = (),
) -> Iterator[tuple[int, Event]]:
    """Give messages and changes, but for those that rest on something refuted, as they were decided, and when."""
    believed = (
        (one.decided_us, Event(one.name, one.args, one.t_us, one.old, one.new, doubts, one.confidence))
        for one in changes
        if refuted.isdisjoint(one.hypotheses)
        for doubts in [tuple(label for label in one.hypotheses if label in undecided)]
    )
    # At equal times merge gives the first first: verdicts came before what was decided at the same frame.
    return heapq.merge(messages, believed, key=itemgetter(0))


def _changes(log: EventLog, run_id: str, part: Part) -> list[RelationRecord]:
    first_us, _ = log.covered_us(run_id) or (0, 0)
    changes = chain(
        log.relations(run_id, names=_OF_THE_MAP, from_us=first_us, to_us=min(first_us + 1, part.from_us)),
        log.relations(run_id, names=part.names, about=part.about, from_us=part.first_us, to_us=part.from_us),
        log.relations(run_id, names=part.names, from_us=part.from_us, to_us=part.to_us),
        log.relations(run_id, names=part.names, about=part.about, from_us=part.to_us, to_us=part.last_us),
    )
    return sorted(changes, key=_DECIDED_US)


def _messages(log: EventLog, run_id: str, part: Part | None) -> Iterator[tuple[int, Event]]:
    """Give the events of the run's monitors as the messages they were to its chronicles, and when their states came."""
    run = log.run(run_id)
    monitors = {(one.name, one.version) for one in run.monitors}
    if not monitors:
        return
    from service.runs.graph.relations import stored_settings  # with all engines, which few questions need

    lag_us = stored_settings(run).backdate_us
    asked = EventFilter(runs=(run_id,))
    if part is not None:
        first, last = TimePoint(part.first_us, "media"), TimePoint(part.last_us, "media")
        asked = EventFilter(runs=(run_id,), from_=first, to=last)
    for event in map(decode_event, iterate_events(log, asked)):
        if (event.chronicle.name, event.chronicle.version) in monitors:
            message = Event(event.type, tuple(event.roles.values()), event.start_us)
            yield event.start_us + lag_us, message


class Unwatched(NamedTuple):
    """Hold changes that a run did not watch, in the order of decision, to be looked at once.

    They are decided at most `late_us` after they happened.
    """

    changes: Iterable[RelationRecord] = ()
    late_us: int = 0


def unwatched_relations(
    log: EventLog,
    run: RunRecord,
    asked: Collection[str],
    site_file: Path | None = None,
    window_us: tuple[int | None, int | None] = (None, None),
) -> Unwatched:
    """Compute those of some relations that a run did not watch; none if it watched all.

    Parameters
    ----------
    asked : names of relations.
    site_file : where the site file of the run is now; None for where it was.
    window_us : of the frames that are looked at, [from, to); None is open.

    Raises
    ------
    LogError
        If the log does not have all cars.
    InputError
        If the site of the run is not known any more, is another one, or cannot be used.
    """
    names = sorted(set(asked).difference(run.relations))
    if not names:
        return Unwatched()
    if run.kpl:
        watched = ", ".join(run.relations) or "none"
        raise LogError(
            f"run {run.id!r}: expected one that watched {', '.join(names)}, got one that watched {watched} and whose "
            "streams a text of its own declares, so that cars may be missing; process the input again"
        )
    # What only this needs, the anchoring and relations of the pipeline, takes most of a second to load.
    from service.questions.observations.computed_relations import computed_relations
    from service.questions.observations.run_sites import ground_of

    ground = ground_of(run, f"to compute {', '.join(names)} from the cars", site_file)
    # A car may be lost, or have had no name yet.
    late_us = ground.anchoring.survive_us + ground.anchoring.name_back_us + ground.relations.backdate_us
    return Unwatched(computed_relations(log, run, names, ground, window_us), late_us)


def chronicles_of(run: RunRecord) -> ChronicleSet:
    """Compile the chronicles of a run again, from the texts that the log holds."""
    return load_texts([(one.name, one.text) for one in run.texts])


def relations_of(chronicles: ChronicleSet) -> frozenset[str]:
    """Name the relations that chronicles look at."""
    return frozenset[str]().union(*(plan.consumes for plan in chronicles.plans)) & RANK.keys()


def refuse_thinned(run: RunRecord) -> None:
    """Refuse a run that recorded only some of the changes: what is absent would say nothing.

    Raises
    ------
    LogError
        If it did.
    """
    if run.kpl and not _records_relations(run.kpl):
        raise LogError(f"run {run.id!r}: expected all relation changes in the log, got a text in KPL that thins them")


def _records_relations(kpl: str) -> bool:
    """Say whether a text hands all relation changes to the log."""
    from dyknow.kpl.model import StreamDeclaration
    from dyknow.kpl.parser import parse_kpl

    streams = [one for one in parse_kpl(kpl).statements if isinstance(one, StreamDeclaration)]
    return any(one.name.text == "recorded_relations" and not one.term.constraints for one in streams)
