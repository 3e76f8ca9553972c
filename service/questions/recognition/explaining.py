"""Why is this event in the log, and why is another one not? Answers from what the log holds, by looking again.

The relation changes of the run are read back and handed to `chronicles.explanation`. What the chronicles cannot know
is added here: by which links each car was taken for the one it is.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any  # Any: JSON values

from msgspec.structs import asdict

from chronicles.chronicle_set import ChronicleSet
from chronicles.errors import ChronicleError
from chronicles.events import Occurrence
from chronicles.explanation.case import is_about_roles, looked_at, reach_us
from chronicles.explanation.explanations import Explanation, WhyNot
from chronicles.explanation.json_form import to_json
from chronicles.explanation.rendering import render
from chronicles.explanation.sentences import of_event, seconds
from chronicles.explanation.why import why
from dyknow.language.diagnostics import hinted
from service.errors import FilterError, NotInLogError
from service.questions.events.notes import covered
from service.questions.events.queries import MAX_LIMIT, decode_event, find_event
from service.questions.observations.identity import IdentityLink, chain_of, links_below
from service.questions.observations.stored_events import (
    Part,
    StoredEvents,
    chronicles_of,
    refuse_thinned,
    relations_of,
    stored_events,
    unwatched_relations,
)
from service.questions.recognition.awaited import AwaitedList, awaited_instances
from service.questions.recognition.trials import Difference, Trial, difference
from service.records.events import EventRecord
from service.records.runs import RunRecord, SourceText
from service.records.times import format_media
from service.store.log import EventLog

if TYPE_CHECKING:
    from service.texts.chronicle_files import LoadedChronicles

Json = dict[str, Any]  # Any: a JSON object

MAX_NEAR_MISSES = 50

_AROUND_US = 2_000_000
"""Beyond an event, and beyond the lives of its cars: windows of chronicles reach by seconds beyond their events."""
_LONG_US = 600_000_000
"""Who is there for longer beyond a window than this is parked, or stands at a light that does not change."""


@dataclass(frozen=True, slots=True)
class EventExplanation:
    """Hold why an event was recognised.

    Attributes
    ----------
    identities : for each role that a car fills, the links below that car up to the end of the event, oldest first.
    """

    event: EventRecord
    explanation: Explanation
    identities: Mapping[str, Sequence[IdentityLink]]

    def as_record(self) -> Json:
        """Return it as plain data, for JSON."""
        return {
            "event": self.event.id,
            "confidence": self.event.confidence,
            "weakest": self.weakest,
            "explanation": to_json(self.explanation),
            "identities": {role: [asdict(one) for one in links] for role, links in self.identities.items()},
        }

    @property
    def weakest(self) -> str:
        """Name the event that is least sure, and how sure it is by itself; empty if all are sure."""
        one = min(self.explanation.events, key=lambda matched: matched.event.confidence).event
        sure = f", sure to {one.confidence:.2f}"
        return "" if one.confidence == 1 else f"{of_event(one)} at {seconds(one.t_us)}{sure} by itself"

    def render(self) -> str:
        """Write it for people, every line ended by a newline."""
        weakest = f"; weakest: {self.weakest}" if self.weakest else ""
        lines = ["", f"sure to {self.event.confidence:.2f}{weakest}", "", "identities"]
        for role, links in self.identities.items():
            lines.append(f"  {role} {self.event.roles[role]}")
            lines += [f"    {_link_line(one)}" for one in links]
        return render(self.explanation) + "".join(f"{line}\n" for line in lines)


@dataclass(frozen=True, slots=True, kw_only=True)
class AbsenceQuestion:
    """Ask why a chronicle was not recognised.

    Attributes
    ----------
    run : which run; None for the only one of the log.
    roles : values of some roles, to ask about these things only.
    start_us, end_us : asks for the instances that overlap [start_us, end_us); None is open.
    limit : how many near misses are wanted at most, from 1 to `MAX_NEAR_MISSES`, as who reads it has checked.
    """

    chronicle: str
    run: str | None = None
    roles: Mapping[str, str]
    start_us: int | None = None
    end_us: int | None = None
    limit: int = 5


class Explainer:
    """Answer questions about one log; the chronicles of a run are compiled once.

    Parameters
    ----------
    log : open while questions are asked.
    """

    def __init__(self, log: EventLog) -> None:
        self._log = log
        self._compiled: dict[tuple[SourceText, ...], ChronicleSet] = {}

    def explain_event(self, event_id: str) -> EventExplanation | None:
        """Explain an event; None if the log has no such event.

        Raises
        ------
        ChronicleError
            If the stored relation changes do not hold what the event was recognised from.
        """
        text = find_event(self._log, event_id)
        if text is None:
            return None
        event = decode_event(text)
        run = self._log.run(event.run)
        if event.chronicle.name in (one.name for one in run.monitors):
            came = f"one of the monitor {event.chronicle.name!r}"
            raise NotInLogError(f"event {event_id!r}: expected one of a chronicle, got {came}")
        return EventExplanation(event, self._why(event, run), _identities(self._log, event))

    def _why(self, event: EventRecord, run: RunRecord) -> Explanation:
        """Look again at the lives of the cars that take part, or at the whole run if that is not enough."""
        chronicles, occurrence = self._chronicles(run), _occurrence(event)
        from_us, to_us = event.start_us - _AROUND_US, event.recognised_us + _AROUND_US
        cars = tuple(event.roles.values())
        first_us, last_us = self._log.life_us(run.id, cars) or (event.start_us, event.end_us)
        part = Part(
            names=looked_at(chronicles, occurrence.chronicle),
            from_us=from_us,
            to_us=to_us,
            about=cars,
            first_us=min(first_us - _AROUND_US, from_us),
            last_us=max(last_us + _AROUND_US, to_us),
        )
        # An event that was taken back rests on refuted links: it is explained by what was believed then.
        read = partial(stored_events, self._log, run.id, believed=event.hypotheses)
        if is_about_roles(chronicles, occurrence.chronicle):
            with suppress(ChronicleError):  # it rests on events of others, whose things take no part in this one
                return why(chronicles, occurrence, read(part=part).events)
        return why(chronicles, occurrence, read().events)

    def explain_absence(
        self, question: AbsenceQuestion, chronicle_files: Sequence[Path] = (), site_file: Path | None = None
    ) -> WhyNot:
        """Say why a chronicle was not recognised in a run.

        Parameters
        ----------
        chronicle_files : texts with the chronicle; none means those of the run.
        site_file : of the run, for relations that it did not watch; None for where the site file was.

        Raises
        ------
        FilterError
            If there is no such role, or the window is empty.
        NotInLogError
            If there is no such run or chronicle.
        LogError, InputError, ChronicleError
            If what the chronicle looks at was not watched and cannot be computed, or a text cannot be used.
        """
        # What reads files takes a while to load; who asks why needs none of it.
        from service.texts.chronicle_files import load_chronicle_files

        run = self._log.run(question.run)
        chronicles = load_chronicle_files(chronicle_files).merged if chronicle_files else self._chronicles(run)
        name = _asked_chronicle(question.chronicle, run, chronicles)
        stored = self._looked_at(question, run, chronicles, [name], site_file)
        self._check_occur(question, run, stored, is_part=None not in (question.start_us, question.end_us))
        return self._why_not(question, run, chronicles, name, stored)

    def try_text(self, question: AbsenceQuestion, text: str) -> Trial:
        """Say what a text would recognise in a run, and how near it came to more.

        Parameters
        ----------
        question : about no chronicle and no roles: its window, and how many near misses of each chronicle are wanted.

        Raises
        ------
        FilterError, NotInLogError, LogError, InputError, ChronicleError
            As `explain_absence`.
        """
        run = self._log.run(question.run)
        loaded, names, stored, events = self._recognised(question, run, text)
        missed = {name: to_json(self._why_not(question, run, loaded.merged, name, stored)) for name in names}
        return Trial(run.id, len(events), events[:MAX_LIMIT], missed, loaded.doubts)

    def compare_texts(self, question: AbsenceQuestion, before: str, after: str) -> Difference:
        """Say what two texts recognise differently in a run; parameters and errors as those of `try_text`."""
        run = self._log.run(question.run)
        return difference(run.id, *(self._recognised(question, run, text)[-1] for text in (before, after)))

    def _recognised(
        self, question: AbsenceQuestion, run: RunRecord, text: str
    ) -> tuple["LoadedChronicles", tuple[str, ...], StoredEvents, list[EventRecord]]:
        """Recognise the chronicles that a text declares in the window of a question."""
        from chronicles.recogniser import recognise
        from service.questions.recognition.recognised_events import recognised_events
        from service.texts.chronicle_files import chronicle_names, load_chronicle_texts
        from service.texts.monitor_messages import messages_of_run

        loaded = load_chronicle_texts([("text", text)], messages=messages_of_run(run))
        names = chronicle_names("text", text) or ()
        stored = self._looked_at(question, run, loaded.merged, names)
        found = recognise(loaded.merged.feeding(names), stored.events, until_us=stored.until_us)
        within = [one for one in found if one.chronicle in names and _is_within(question, one)]
        return loaded, names, stored, [one.event for one in recognised_events(within, run, self._log)]

    def _looked_at(
        self,
        question: AbsenceQuestion,
        run: RunRecord,
        chronicles: ChronicleSet,
        names: Sequence[str],
        site_file: Path | None = None,
    ) -> StoredEvents:
        """Read what a question about some chronicles looks at, once it is found to be one."""
        for name in names:
            _check(question, run, chronicles, name)
        part = self._part(question, chronicles, names, run)
        window_us = (None, None) if part is None else (part.from_us, part.to_us)
        computed = unwatched_relations(self._log, run, relations_of(chronicles), site_file, window_us).changes
        stored = stored_events(self._log, run.id, part=part, computed=computed)
        self._check_covered(question, run)
        return stored

    def _why_not(
        self, question: AbsenceQuestion, run: RunRecord, chronicles: ChronicleSet, name: str, stored: StoredEvents
    ) -> WhyNot:
        # What searches, and measures cars again, loads a third of a second.
        from chronicles.explanation.why_not import why_not
        from service.questions.recognition.thresholds import with_settings

        found = why_not(
            chronicles,
            name,
            stored.events,
            roles=question.roles,
            start_us=question.start_us,
            end_us=question.end_us,
            until_us=stored.until_us,
            limit=question.limit,
            floor=float(run.settings["min_confidence"]) if "min_confidence" in run.settings else None,
        )
        return with_settings(self._log, run, found)

    def awaited(self, question: AbsenceQuestion) -> AwaitedList:
        """Say which instances of a chronicle a run was waiting for at `end_us`, or its end, and what became of others.

        Those that ended are told from `start_us` on; without it, none. Raises as `explain_absence`.
        """
        run = self._log.run(question.run)
        chronicles = self._chronicles(run)
        name = _asked_chronicle(question.chronicle, run, chronicles)
        at_us = self._log.last_us(run.id) if question.end_us is None else question.end_us
        since_us = at_us if question.start_us is None else question.start_us
        window = replace(question, start_us=since_us, end_us=at_us + 1)
        _check(window, run, chronicles, name)
        self._check_covered(window, run)
        stored = stored_events(self._log, run.id, part=self._part(window, chronicles, [name], run))
        self._check_occur(window, run, stored, is_part=True)
        found = awaited_instances(chronicles, name, stored.events, since_us=since_us, at_us=at_us)
        asked = question.roles.items()  # who fills a role may not be known yet
        wanted = [one for one in found if all(one.roles.get(role, value) == value for role, value in asked)]
        return AwaitedList(run.id, name, since_us, at_us, len(wanted), wanted[: question.limit])

    def _part(
        self, question: AbsenceQuestion, chronicles: ChronicleSet, names: Sequence[str], run: RunRecord
    ) -> Part | None:
        """Bound what a question about a window looks at: the lives of all cars that instances in it may be about."""
        if question.start_us is None or question.end_us is None:
            return None
        span_us = max((reach_us(chronicles, name) for name in names), default=0) + _AROUND_US
        start_us, end_us = question.start_us - span_us, question.end_us + span_us
        alive = [one for one in self._log.cars(run.id) if one.first_us < end_us and one.last_us >= start_us]
        first_us, last_us = start_us - _LONG_US, end_us + _LONG_US
        # Of who is there for long, such as who is parked, only its own changes are read for all of that time.
        long = [one for one in alive if one.first_us < first_us or one.last_us > last_us]
        rest = [one for one in alive if first_us <= one.first_us and one.last_us <= last_us]
        from_us = min([start_us, *(one.first_us for one in rest)])
        to_us = max([end_us, *(one.last_us + _AROUND_US for one in rest)])
        return Part(
            names=frozenset().union(*(looked_at(chronicles, name) for name in names)),
            from_us=from_us,
            to_us=to_us,
            about=[one.car for one in long],
            first_us=min([from_us, *(one.first_us for one in long)]),
            last_us=max([to_us, *(one.last_us + _AROUND_US for one in long)]),
        )

    def _check_covered(self, question: AbsenceQuestion, run: RunRecord) -> None:
        """Refuse a window in which nothing was filmed: that explains all that is absent."""
        first_us, last_us = self._log.covered_us(run.id) or (None, None)
        start_us, end_us = question.start_us, question.end_us
        is_after = start_us is not None and (last_us is None or start_us > last_us)
        is_before = end_us is not None and (first_us is None or end_us <= first_us)
        if is_after or is_before:
            came = f"{'the start' if start_us is None else format_media(start_us)} to "
            came += "the end" if end_us is None else format_media(end_us)
            expected = f"expected a window in the time that it covers ({covered(self._log, run)})"
            raise NotInLogError(f"run {run.id!r}: {expected}, got {came}: nothing was filmed then")

    def _check_occur(self, question: AbsenceQuestion, run: RunRecord, stored: StoredEvents, *, is_part: bool) -> None:
        """Refuse things that the run has never heard of: why nothing happened to them is no question."""
        known = {one.car for one in self._log.cars(run.id)} | _things(stored)
        if is_part and not known.issuperset(question.roles.values()):
            known |= _things(stored_events(self._log, run.id))
        for role, value in question.roles.items():
            if value not in known:
                expected = f"run {run.id!r}: expected something that occurs in it as role {role!r}, got {value!r}"
                raise NotInLogError(f"{expected}{hinted(value, known)}")

    def _chronicles(self, run: RunRecord) -> ChronicleSet:
        if run.texts not in self._compiled:  # those of a live run may change
            self._compiled[run.texts] = chronicles_of(run)
        return self._compiled[run.texts]


def _is_within(question: AbsenceQuestion, one: Occurrence) -> bool:
    """Tell whether an occurrence overlaps the window; one without duration lies in it at its start."""
    is_before = question.start_us is not None and max(one.end_us, one.start_us + 1) <= question.start_us
    return not is_before and (question.end_us is None or one.start_us < question.end_us)


def _things(stored: StoredEvents) -> set[str]:
    """Name all that events are about, and the values that they give."""
    return {thing for event in stored.events for thing in (*event.args, event.old or "", event.new or "")}


def _asked_chronicle(name: str, run: RunRecord, chronicles: ChronicleSet) -> str:
    """Find the chronicle of a name; the name of an event that one chronicle alone emits will do."""
    if name in chronicles.names:
        return name
    emitters = [plan.name for plan in chronicles.plans if name in plan.produces]
    if len(emitters) == 1:
        return emitters[0]
    if emitters:
        wanted = f"{', '.join(emitters)}, which emit {name!r}"
        raise NotInLogError(f"run {run.id!r}: expected one of {wanted}, got {name!r}")
    raise NotInLogError(f"run {run.id!r}: expected one of its chronicles, got {name!r}{hinted(name, chronicles.names)}")


def _check(question: AbsenceQuestion, run: RunRecord, chronicles: ChronicleSet, name: str) -> None:
    refuse_thinned(run)
    roles = [role for role, _ in chronicles.plan(name).roles]
    for role in question.roles:
        if role not in roles:
            message = f"role: expected one of {', '.join(roles)}, got {role!r}"
            raise FilterError(message, parameter=f"role.{role}")
    start_us, end_us = question.start_us, question.end_us
    if start_us is not None and end_us is not None and start_us >= end_us:
        raise FilterError(f"from: expected a time before 'to' ({end_us} us), got {start_us} us", parameter="from")


def _occurrence(event: EventRecord) -> Occurrence:
    """Turn an event of the log back into what the recogniser gave, as far as an explanation needs it."""
    return Occurrence(
        chronicle=event.chronicle.name,
        version=event.chronicle.version,
        roles=event.roles,
        start_us=event.start_us,
        end_us=event.end_us,
        sub_events=tuple((part.label, part.t_us) for part in event.sub_events),
        events=(),
        emitted=(),
        reports=(),
        recognised_us=event.recognised_us,
        hypotheses=event.hypotheses,
        status="recognised" if event.status == "doubtful" else event.status,
    )


def _identities(log: EventLog, event: EventRecord) -> dict[str, list[IdentityLink]]:
    below = links_below(log, event.run, event.roles.values())
    chains = {role: chain_of(below, symbol, until_us=event.end_us) for role, symbol in event.roles.items()}
    return {role: links for role, links in chains.items() if links}


def _link_line(link: IdentityLink) -> str:
    end = "the end" if link.end_us is None else format_media(link.end_us)
    reason = f", {link.reason}" if link.reason else ""
    return f"{link.lower} -> {link.upper}  {format_media(link.start_us)} to {end}{reason}"
