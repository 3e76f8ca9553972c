"""What if an event turns out never to have happened, or is told long after its time?

Events may rest on hypotheses, such as the identity of a car. While one of them is open, what was recognised from its
events is tentative, and when it is refuted, recognition must be as if those events had never come: occurrences that
rested on them go, and others appear that only they had prevented. And while a car is hidden, events may still come of
the time since it was seen last: recognition must be as if they had come in time.

Two engines run: the live one takes every event at once; the settled one follows behind and takes only what nobody can
take back any more, up to the time from which on something may still come. Between them lies the journal. What falls and
what comes late costs a copy of the settled engine and a replay of the journal, once for all that is told together,
which is right for every kind of statement by construction. Rejected: removing instances, logs and histories event by
event (a missing absence can only be found by looking again).

Who wants final answers only needs no live engine: the settled one is the only one, and tells nothing that is taken
back.
"""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from operator import attrgetter
from typing import Any, Literal  # Any: states are plain nested data

from chronicles.compilation.network import UNBOUNDED_US
from chronicles.events import Event, Occurrence, OccurrenceKey, Status
from chronicles.execution.engine import Engine

DECIDED_KEPT = 10_000
"""How many decided hypotheses are known; an event that names an older one comes too late."""

Verdict = Literal["confirmed", "refuted", "undecided"]


class Revision:
    """Keeps what may still be taken back; invariant: live engine = settled engine + journal.

    Parameters
    ----------
    engine : what has been told so far, nothing of which can be taken back.
    early : whether everything is told at once, by a live engine; else only what is settled.

    Attributes
    ----------
    live : the engine that has seen every event; the settled one, if there are no early answers.
    """

    def __init__(self, engine: Engine, *, early: bool) -> None:
        self.live = engine.copy() if early else engine
        self._settled = engine
        self._early = early
        self._names = engine.names
        self._clock_us = engine.clock_us
        self._journal: deque[Event | int] = deque()  # an int is a time that was told without an event
        self._open: dict[str, int] = {}  # from when on events may come or go by it that are not in the journal
        self._decided: dict[str, Verdict] = {}  # the latest, in the order in which they were decided
        # What the live engine has found and the settled one has not, as it was told last.
        self._standing = _Occurrences()

    @property
    def open_hypotheses(self) -> frozenset[str]:
        """The hypotheses that were opened, or that events rest on, and that are not decided."""
        return frozenset(self._open)

    @property
    def settled_us(self) -> int:
        """The time before which nothing can come any more."""
        return self._settled.watermark_us

    def revise(
        self, opened: Iterable[tuple[str, int]], verdicts: Iterable[tuple[str, Verdict]], events: Iterable[Event]
    ) -> list[Occurrence]:
        """Take what became known together; events are not before `settled_us`."""
        for label, since_us in opened:
            if label not in self._decided:
                self._open[label] = min(since_us, self._open.get(label, since_us))
        fallen, is_decided = set(), False
        for label, verdict in verdicts:
            is_decided = True
            if self._decide(label, verdict) and verdict == "refuted":
                fallen.add(label)
        watermark_us = self._clock_us - self.live.lateness_us
        entries = [self._entry(event) for event in sorted(events, key=attrgetter("t_us"))]
        late = [one for one in entries if isinstance(one, Event) and one.t_us < watermark_us]
        told: list[Occurrence] = []
        if late or any(isinstance(one, Event) and not fallen.isdisjoint(one.hypotheses) for one in self._journal):
            self._rewrite(fallen, late)
            told = self._replayed() if self._early else []
        elif is_decided:
            told = self._reconsidered()
        for entry in entries:
            if _time(entry) >= watermark_us:
                told += self._take(entry)
        return told + self._settle()

    def advance(self, t_us: int) -> list[Occurrence]:
        """Let time pass."""
        return self._take(t_us) + self._settle()

    def _decide(self, label: str, verdict: Verdict) -> bool:
        """Keep a verdict, if it is the first one on its hypothesis."""
        self._open.pop(label, None)
        if label in self._decided:
            return False
        self._decided[label] = verdict
        if len(self._decided) > DECIDED_KEPT:
            del self._decided[next(iter(self._decided))]
        return True

    def _entry(self, event: Event) -> Event | int:
        """Open the hypotheses of an event; one that rests on a refuted one, or fits nothing, only tells the time."""
        if event.name not in self._names or any(self._decided.get(one) == "refuted" for one in event.hypotheses):
            return event.t_us
        for label in event.hypotheses:
            if label not in self._decided:
                self._open.setdefault(label, UNBOUNDED_US)
        return event

    def _take(self, entry: Event | int) -> list[Occurrence]:
        """Write down an event or a time that is not late, and give what it makes certain."""
        self._clock_us = max(self._clock_us, _time(entry))
        self._note(entry)
        return self._told(_fed(self.live, entry)) if self._early else []

    def _note(self, entry: Event | int) -> None:
        if isinstance(entry, int) and self._journal and isinstance(self._journal[-1], int):
            self._journal[-1] = max(self._journal[-1], entry)
        else:
            self._journal.append(entry)

    def _rewrite(self, fallen: set[str], late: Iterable[Event]) -> None:
        """Leave out of the journal what falls, and put in what comes late where it would just not have been late.

        So what happened at one time stays in the order in which it came. Time that a refuted event told has passed all
        the same.
        """
        entries, self._journal, waiting = self._journal, deque[Event | int](), deque(late)
        for entry in entries:
            t_us = _time(entry)
            while waiting and waiting[0].t_us < t_us - self._settled.lateness_us:
                self._note(waiting.popleft())
            falls = isinstance(entry, Event) and not fallen.isdisjoint(entry.hypotheses)
            self._note(t_us if falls else entry)
        assert not waiting, waiting

    def _replayed(self) -> list[Occurrence]:
        """Make the live engine anew; give the occurrences that fall, then that change, then that appear."""
        self.live = self._settled.copy()
        before, self._standing = self._standing, _Occurrences()
        changed, appeared = [], []
        for occurrence in (one for entry in self._journal for one in _fed(self.live, entry)):
            earlier = before.take(occurrence.key)
            if earlier is None:
                new = self._new(occurrence)
                appeared.append(new)
            else:
                new = self._still(earlier, occurrence)
                if new.status != earlier.status:
                    changed.append(new)
            self._standing.add(new)
        return [replace(one, status="retracted") for one in before] + changed + appeared

    def _reconsidered(self) -> list[Occurrence]:
        """Give the occurrences that rest on no open hypothesis any more."""
        changed, standing = [], _Occurrences()
        for occurrence in self._standing:
            still = self._still(occurrence, occurrence)
            standing.add(still)
            if still.status != occurrence.status:
                changed.append(still)
        self._standing = standing
        return changed

    def _told(self, occurrences: Iterable[Occurrence]) -> list[Occurrence]:
        found = [self._new(one) for one in occurrences]
        for one in found:
            self._standing.add(one)
        return found

    def _new(self, occurrence: Occurrence) -> Occurrence:
        return replace(occurrence, status=self._status(occurrence), recognised_us=self._clock_us)

    def _status(self, occurrence: Occurrence) -> Status:
        """Say whether all that it rests on is confirmed; what rests on something undecided stays tentative."""
        doubts = (one in self._open or self._decided.get(one) == "undecided" for one in occurrence.hypotheses)
        return "tentative" if any(doubts) else "recognised"

    def _still(self, earlier: Occurrence, occurrence: Occurrence) -> Occurrence:
        """Describe what stands before and after a replay, which may rest on other evidence now."""
        status = earlier.status
        if status == "tentative" and self._status(occurrence) == "recognised":
            status = "confirmed"
        return replace(occurrence, status=status, recognised_us=earlier.recognised_us)

    def _settle(self) -> list[Occurrence]:
        """Give the settled engine what nothing can take back; what it finds stands for good."""
        journal = self._journal
        until_us = min(self._open.values(), default=UNBOUNDED_US) + self._settled.lateness_us
        found: list[Occurrence] = []
        while journal:
            entry = journal[0]
            if _time(entry) > until_us or (
                isinstance(entry, Event) and not self._open.keys().isdisjoint(entry.hypotheses)
            ):
                break
            found += _fed(self._settled, journal.popleft())
        if not self._early:
            return [self._new(one) for one in found]
        for one in found:
            self._standing.take(one.key)
        return []

    # ---- checkpoints

    def state(self) -> Any:  # Any: plain nested data
        """Give everything that may still be taken back, as plain data, events and occurrences."""
        return {
            "settled": self._settled.state(),
            "live": self.live.state() if self._early else None,
            "clock_us": self._clock_us,
            "journal": list(self._journal),
            "open": list(self._open.items()),
            "decided": list(self._decided.items()),
            "standing": list(self._standing),
        }

    def restore(self, state: Any) -> None:  # Any: see `state`
        """Take up where `state` was given; this revision is new."""
        self._settled.restore(state["settled"])
        if self._early:
            self.live.restore(state["live"])
        self._clock_us = state["clock_us"]
        self._journal = deque(state["journal"])
        self._open, self._decided = dict(state["open"]), dict(state["decided"])
        self._standing = _Occurrences()
        for occurrence in state["standing"]:
            self._standing.add(occurrence)


def _time(entry: Event | int) -> int:
    return entry if isinstance(entry, int) else entry.t_us


def _fed(engine: Engine, entry: Event | int) -> Sequence[Occurrence]:
    return engine.advance(entry) if isinstance(entry, int) else engine.observe(entry)


class _Occurrences:
    """Occurrences in the order of adding; several may be alike, when the same event was told twice."""

    def __init__(self) -> None:
        self._by_key: dict[OccurrenceKey, deque[Occurrence]] = {}

    def add(self, occurrence: Occurrence) -> None:
        """Put one in."""
        self._by_key.setdefault(occurrence.key, deque()).append(occurrence)

    def take(self, key: OccurrenceKey) -> Occurrence | None:
        """Remove and give the first one with this key, None if there is none."""
        alike = self._by_key.get(key)
        if alike is None:
            return None
        first = alike.popleft()
        if not alike:
            del self._by_key[key]
        return first

    def __iter__(self) -> Iterator[Occurrence]:
        for alike in self._by_key.values():
            yield from alike
