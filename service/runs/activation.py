"""How do other chronicles take the place of some while a run goes on? By looking again at what the run has seen.

Which ones a live run looks for is said by its files and by the texts of its log, which are looked at as they change.

Invariant: once revisions are folded, a run holds at each moment what it would hold if it had begun with the chronicles
of now. So what was told of chronicles that end is taken back, and those that begin are recognised from the beginning,
in the relation changes that the log has, up to the frame that the run has come to. From there on a recogniser of their
own goes on with them. Those that stay are not touched.
"""

import logging
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from operator import attrgetter, itemgetter
from pathlib import Path

from chronicles.chronicle_set import ChronicleSet
from chronicles.errors import ChronicleError
from chronicles.events import Occurrence
from chronicles.execution.unfit_events import UnfitCounter
from chronicles.recogniser import Recogniser
from dyknow.errors import DyKnowError
from service.errors import InputError, ServiceError
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.questions.observations.stored_events import Unwatched, relations_of, streamed_events
from service.questions.recognition.recognised_events import stored_places
from service.records.events import EventStatus
from service.records.runs import RunRecord
from service.runs.graph.pipeline import Pipeline
from service.runs.graph.recording import Recorder
from service.store.databases.location import database_of
from service.store.entries import ChronicleText
from service.store.log import EventLog, open_log
from service.store.registers.chronicle_texts import ChronicleTexts
from service.store.versions import read_version
from service.store.writer import RunWriter
from service.texts.chronicle_files import LoadedChronicles
from service.texts.monitor_files import LoadedMonitors

LOOKED_EVERY_S = 1.0
WRONG = (ServiceError, ChronicleError, DyKnowError)
"""What texts raise that are wrong."""

Text = tuple[str, str]
"""Its name, and what it says."""

_LOGGER = logging.getLogger(__name__)
_STANDING: tuple[EventStatus, ...] = ("recognised", "tentative", "confirmed", "doubtful")


class FollowedTexts:
    """Look every second whether the chronicles of a run were changed.

    Parameters
    ----------
    log, files : where they stand.
    load : reads and checks all of them.
    """

    def __init__(self, log: EventLog, files: tuple[Path, ...], load: Callable[[], LoadedChronicles]) -> None:
        self._files, self._load = files, load
        self._stored = ChronicleTexts(log)
        self._seen: list[tuple[str, int, int]] | None = None  # what changed since the run read them is not missed
        self._due_s = time.monotonic() + LOOKED_EVERY_S

    def changed(self) -> LoadedChronicles | None:
        """Read them, at first and if they were changed since; else None. What is wrong is told, and changes nothing."""
        if time.monotonic() < self._due_s:
            return None
        self._due_s = time.monotonic() + LOOKED_EVERY_S
        try:
            state = self._state()
            if state != self._seen:
                self._seen = state
                return self._load()
        except WRONG as error:
            tell_unchanged(error)
        return None

    def _state(self) -> list[tuple[str, int, int]]:
        """Tell texts from others, without reading them."""
        state = [(one.name, one.version, 0) for one in self._stored.current()]
        for file in self._files:
            with suppress(OSError):  # missing while an editor writes it, or for good, which is told when it is read
                found = file.stat()
                state.append((str(file), found.st_mtime_ns, found.st_size))
        return state


def tell_unchanged(why: Exception) -> None:
    """Tell that chronicles that were changed are not taken."""
    _LOGGER.warning("the chronicles stay as they are: %s", why)


def load_with_stored(
    load: Callable[[Sequence[Text]], tuple[LoadedChronicles, LoadedMonitors]], log_url: str
) -> tuple[LoadedChronicles, LoadedMonitors]:
    """Load chronicles with the texts of a log, without those that do not go with what was there before them.

    What somebody stores, each right by itself, must not end what is watched.

    Parameters
    ----------
    load : reads and checks chronicles, with some texts besides.

    Raises
    ------
    LogError
        If the log is there and cannot be read; besides, what `load` raises without any text.
    """
    texts = [(one.name, one.text or "") for one in sorted(stored_texts(log_url), key=attrgetter("made_us"))]
    with suppress(*WRONG):
        return load(texts)
    chronicles, monitors = load(())
    fitting, left_out = list[Text](), list[str]()
    for text in texts:
        try:
            chronicles, monitors = load([*fitting, text])
        except WRONG as error:
            why = str(error).splitlines()[0]
            left_out.append(f"chronicle text {text[0]!r} of the log: expected one that goes with the others, got {why}")
        else:
            fitting.append(text)
    return replace(chronicles, doubts=(*chronicles.doubts, *left_out)), monitors


def stored_texts(log_url: str) -> list[ChronicleText]:
    """List the chronicle texts of a log; none where there is no log yet.

    Raises
    ------
    LogError
        If it is there and cannot be read.
    """
    database = database_of(log_url)
    if not database.exists() or read_version(database) is None:
        return []
    with open_log(log_url) as log:
        return ChronicleTexts(log).current()


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
