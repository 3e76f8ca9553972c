"""How do other chronicles take the place of some while a run goes on? By looking again at what the run has seen.

Invariant: once revisions are folded, a run holds at each moment what it would hold if it had begun with the chronicles
of now. So what was told of chronicles that end is taken back, and those that begin are recognised from the beginning,
in the relation changes that the log has, up to the frame that the run has come to. From there on a recogniser of their
own goes on with them. Those that stay are not touched.
"""

from collections.abc import Callable
from dataclasses import dataclass
from operator import itemgetter

from chronicles.chronicle_set import ChronicleSet
from chronicles.events import Occurrence
from chronicles.execution.unfit_events import UnfitCounter
from chronicles.recogniser import Recogniser
from service.errors import InputError
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.questions.observations.stored_events import Unwatched, relations_of, streamed_events
from service.questions.recognition.recognised_events import stored_places
from service.records.events import EventStatus
from service.records.runs import RunRecord
from service.runs.followed_texts import FollowedTexts, tell_unchanged
from service.runs.graph.pipeline import Pipeline
from service.runs.graph.recording import Recorder
from service.store.log import EventLog
from service.store.writer import RunWriter
from service.texts.chronicle_files import LoadedChronicles

_STANDING: tuple[EventStatus, ...] = ("recognised", "tentative", "confirmed", "doubtful")


@dataclass(slots=True)
class Activation:
    """Hold what a run looks for, and change it.

    Attributes
    ----------
    log, writer, pipeline, recorder : of the run, which watches all relations.
    chronicles, record : as they are now.
    monitored : events that monitors look at.
    describe : makes the record of the run with other chronicles.
    texts : tell when chronicles are changed; None where they stay.
    """

    log: EventLog
    writer: RunWriter
    pipeline: Pipeline
    recorder: Recorder
    chronicles: LoadedChronicles
    record: RunRecord
    monitored: frozenset[str]
    describe: Callable[[LoadedChronicles], RunRecord]
    texts: FollowedTexts | None

    def look(self) -> None:
        """Look for other chronicles if they were changed; those that cannot be taken are told, and change nothing."""
        chronicles = self.texts.changed() if self.texts else None
        if chronicles is not None:
            try:
                self.take(chronicles)
            except InputError as error:
                tell_unchanged(error)

    def take(self, chronicles: LoadedChronicles) -> None:
        """Look for these chronicles from now on, between two frames.

        Raises
        ------
        InputError
            If monitors look at events of what would change, or the run has streams of its own; nothing is changed.
        LogError
            If the database refuses.
        """
        before, after = self.chronicles.merged, chronicles.merged
        ended, begun = changed(before, after)
        self._refuse(ended | begun)
        self.chronicles, self.record = chronicles, self.describe(chronicles)
        self.writer.describe(self.record)
        if ended | begun:
            self._replace(before, ended, begun)

    def _replace(self, before: ChronicleSet, ended: frozenset[str], begun: frozenset[str]) -> None:
        self.writer.flush()
        (unit,) = self.pipeline.recognition
        types = tuple(name for plan in before.plans if plan.name in ended for name, _, _ in plan.given)
        asked = EventFilter(runs=(self.record.id,), types=types, statuses=_STANDING)
        told = [decode_event(one) for one in iterate_events(self.log, asked)] if types else []
        self.recorder.retract(ended, (one for one in told if one.chronicle.name in ended), unit.now_us)
        recogniser, found = self._recognised(begun, unit.open_hypotheses, unit.now_us)
        found = [one for one in found if one.chronicle in begun]
        for one, place in zip(found, stored_places(self.log, self.record.id, found), strict=True):
            self.recorder.record_occurrence(one, place, unit.now_us)
        unit.replace(ended, recogniser, begun)
        self.writer.flush()

    def _refuse(self, names: frozenset[str]) -> None:
        fixed = {plan.name for plan in self.chronicles.merged.feeding(self.monitored).plans} & names
        if self.monitored and fixed:
            raise InputError(
                f"chronicle {min(fixed)}: expected one whose events no monitor looks at, got another; "
                "what monitors look at is changed when the next run begins"
            )
        if not self.pipeline.is_shipped:
            raise InputError(
                f"{self.pipeline.kpl.name}: expected the shipped streams where chronicles change, got others"
            )

    def _recognised(
        self, names: frozenset[str], undecided: dict[str, int], now_us: int
    ) -> tuple[Recogniser, list[Occurrence]]:
        """Let a recogniser see what the run has seen so far; what rests on open hypotheses is as open to it."""
        chronicles = self.chronicles.merged
        recogniser = self.pipeline.make_recogniser(chronicles.feeding(names))
        self.recorder.unfit = UnfitCounter(chronicles)
        opened = sorted(undecided.items(), key=itemgetter(1))
        found: list[Occurrence] = []
        asked = relations_of(chronicles)
        for event in streamed_events(self.log, self.record.id, asked, Unwatched(), in_time=True, undecided=undecided):
            while opened and opened[0][1] <= event.t_us:  # held back are only those from then on
                recogniser.open(*opened.pop(0))
            self.recorder.unfit.count(event)
            found += recogniser.observe(event)
        for label, since_us in opened:
            recogniser.open(label, since_us)
        found += recogniser.advance(now_us)
        return recogniser, found


def changed(before: ChronicleSet, after: ChronicleSet) -> tuple[frozenset[str], frozenset[str]]:
    """Name the chronicles that end, and those that begin; one that looks at events of others changes with these.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> one = "message a[] message one[] chronicle one[](t1) { event(a[], t1) }"
    >>> two = " chronicle two[](t1) { event(one[], t1) }"
    >>> other = one.replace("(t1)", "(t1, t2)").replace("}", "event(a[], t2) t2 - t1 in ]0s, 1s] }")
    >>> ended, begun = changed(load(one), load(one + two))
    >>> sorted(ended), sorted(begun)
    ([], ['two'])
    >>> ended, begun = changed(load(one + two), load(other + two))
    >>> sorted(ended), sorted(begun)
    (['one', 'two'], ['one', 'two'])
    """
    versions_before, versions_after = _versions(before), _versions(after)
    same = {name for name in versions_before.keys() & versions_after if versions_before[name] == versions_after[name]}
    return frozenset(versions_before.keys() - same), frozenset(versions_after.keys() - same)


def _versions(chronicles: ChronicleSet) -> dict[str, tuple[tuple[str, str], ...]]:
    """Give each chronicle's version, with those of the chronicles that feed it."""
    return {
        name: tuple((plan.name, plan.version) for plan in chronicles.feeding({name}).plans) for name in chronicles.names
    }
