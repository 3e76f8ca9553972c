"""What if an event turns out never to have happened, or is told long after its time?

Events may rest on hypotheses, such as the identity of a car. While one of them is open, what was recognised from its
events is tentative, and when it is refuted, recognition must be as if those events had never come: occurrences that
rested on them go, and others appear that only they had prevented. And while a car is hidden, events may still come of
the time since it was seen last: recognition must be as if they had come in time.

The live engine takes every event at once. Behind it lies the journal, of all that may still be taken back or preceded,
with states of the engine as it was at some of its places. What falls and what comes late changes the journal, and costs
a replay from the last state before that, once for all that is told together, which is right for every kind of statement
by construction. Rejected: removing instances, logs and histories event by event (a missing absence can only be found
by looking again), and a second engine that follows behind (it takes every event once more).

Who wants final answers only needs no such states: events wait in the journal until nothing can take them back, and
what the engine tells of them stands.
"""

from bisect import bisect_left, bisect_right
from collections import deque
from collections.abc import Iterable, Iterator, Sequence, Set
from dataclasses import replace
from operator import attrgetter, itemgetter
from typing import Any, Literal  # Any: states are plain nested data

from chronicles.compilation.network import UNBOUNDED_US
from chronicles.events import Event, Occurrence, OccurrenceKey, Status
from chronicles.execution.engine import Engine

DECIDED_KEPT = 10_000
"""How many decided hypotheses are known; an event that names an older one comes too late."""

Verdict = Literal["confirmed", "refuted", "undecided"]


_STATE_EVERY = 1000
"""Entries of the journal from one state that is kept to the next; giving one costs as much as some hundred events."""
_STATES_KEPT = 32


class Revision:
    """Keeps what may still be taken back; invariant: live engine = any state kept + the journal from its place on.

    While changes of the journal wait for a replay, the live engine waits as well.

    Parameters
    ----------
    engine : what has been told so far, nothing of which can be taken back.
    early : whether everything is told at once; else only what nothing can take back.
    patience_us : how long after a replay the next one waits, so that it serves many changes.

    Attributes
    ----------
    live : the engine that has seen every event; without early answers, every settled one.
    """

    def __init__(self, engine: Engine, *, early: bool, patience_us: int = 0) -> None:
        self.live = engine
        self._early = early
        self._patience_us = patience_us
        self._names = engine.names
        self._clock_us = self._settled_clock_us = engine.clock_us
        self._replayed_us = -UNBOUNDED_US
        self._is_changed = False  # whether the journal has changes that the live engine has not seen
        self._journal: list[Event | int] = []  # an int is a time that was told without an event
        self._clocks_us: list[int] = []  # the time that is told by each entry and all before it
        self._settled = 0  # so many entries cannot change any more
        self._states: list[tuple[int, Any]] = []  # of the engine, each with the number of entries seen; ascending
        # What the live engine found in the journal, as it was told last, with the number of the entry.
        self._found: list[tuple[int, Occurrence]] = []
        self._open: dict[str, int] = {}  # from when on events may come or go by it that are not in the journal
        self._first_us: dict[str, int] = {}  # the least time of the events that rest on it, for those open
        self._decided: dict[str, Verdict] = {}  # the latest, in the order in which they were decided

    @property
    def open_hypotheses(self) -> frozenset[str]:
        """The hypotheses that were opened, or that events rest on, and that are not decided."""
        return frozenset(self._open)

    @property
    def settled_us(self) -> int:
        """The time before which nothing can come any more."""
        return self._settled_clock_us - self.live.lateness_us

    def revise(
        self, opened: Iterable[tuple[str, int]], verdicts: Sequence[tuple[str, Verdict]], events: Iterable[Event]
    ) -> list[Occurrence]:
        """Take what became known together; events are not before `settled_us`."""
        for label, since_us in opened:
            if label not in self._decided:
                self._open[label] = min(since_us, self._open.get(label, since_us))
        fallen = {
            label: self._first_us[label] for label, one in verdicts if one == "refuted" and label in self._first_us
        }
        for label, verdict in verdicts:
            self._decide(label, verdict)
        watermark_us = self._clock_us - self.live.lateness_us
        entries = [self._entry(event) for event in sorted(events, key=attrgetter("t_us"))]
        late = [one for one in entries if isinstance(one, Event) and one.t_us < watermark_us]
        self._rewrite(fallen.keys(), min(fallen.values(), default=UNBOUNDED_US), late)
        told = [one for entry in entries if _time(entry) >= watermark_us for one in self._take(entry)]
        return self._concluded(has_verdicts=bool(verdicts)) + told

    def advance(self, t_us: int) -> list[Occurrence]:
        """Let time pass."""
        told = self._take(t_us) if t_us > self._clock_us else []
        return told + self._concluded()

    def _decide(self, label: str, verdict: Verdict) -> None:
        """Keep a verdict, if it is the first one on its hypothesis."""
        self._open.pop(label, None)
        self._first_us.pop(label, None)
        self._decided.setdefault(label, verdict)
        if len(self._decided) > DECIDED_KEPT:
            del self._decided[next(iter(self._decided))]

    def _entry(self, event: Event) -> Event | int:
        """Open the hypotheses of an event; one that rests on a refuted one, or fits nothing, only tells the time."""
        if event.name not in self._names or any(self._decided.get(one) == "refuted" for one in event.hypotheses):
            return event.t_us
        for label in event.hypotheses:
            if label not in self._decided:
                self._open.setdefault(label, UNBOUNDED_US)
                self._first_us[label] = min(event.t_us, self._first_us.get(label, event.t_us))
        return event

    def _take(self, entry: Event | int) -> list[Occurrence]:
        """Write down an event or a time that is not late, and give what it makes certain."""
        self._clock_us = max(self._clock_us, _time(entry))
        if self._early and not self._journal:
            if not self._open:  # nothing is ever to be taken back of it
                self._settled_clock_us = self._clock_us
                return [self._new(one) for one in _fed(self.live, entry)]
            self._states = [(0, self.live.state())]
        self._journal.append(entry)
        self._clocks_us.append(self._clock_us)
        if not self._early or self._is_changed:
            return []
        return [self._found_at(len(self._journal) - 1, self._new(one)) for one in self._follow(len(self._journal) - 1)]

    def _rewrite(self, fallen: Set[str], since_us: int, late: Iterable[Event]) -> None:
        """Leave out of the journal what falls, and put in what comes late where it would just not have been late.

        So what happened at one time stays in the order in which it came. Time that a refuted event told has passed all
        the same.
        """
        journal, clocks_us, changed = self._journal, self._clocks_us, []
        for place in range(bisect_left(clocks_us, since_us), len(journal)):
            entry = journal[place]
            if isinstance(entry, Event) and not fallen.isdisjoint(entry.hypotheses):
                journal[place] = entry.t_us
                changed.append(place)
        for event in late:
            place = bisect_right(clocks_us, event.t_us + self.live.lateness_us)
            journal.insert(place, event)
            clocks_us.insert(place, max(event.t_us, clocks_us[place - 1] if place else self._settled_clock_us))
            changed.append(place)
        if self._early and changed:
            self._is_changed = True
            while self._states[-1][0] > min(changed):
                self._states.pop()

    def _concluded(self, *, has_verdicts: bool = False) -> list[Occurrence]:
        """Give what is revised by now, and settle what can be."""
        told: list[Occurrence] = []
        if self._is_changed:
            if not self._open or self._clock_us >= self._replayed_us + self._patience_us:
                told = self._replayed()
        elif has_verdicts:
            told = self._reconsidered()
        return told + self._settle()

    def _replayed(self) -> list[Occurrence]:
        """Make the live engine anew; give the occurrences that fall, then that change, then that appear."""
        self._is_changed, self._replayed_us = False, self._clock_us
        place, state = self._states[-1]
        self.live.restore(state)
        at = bisect_left(self._found, place, key=itemgetter(0))
        before = _Occurrences(one for _, one in self._found[at:])
        del self._found[at:]
        changed, appeared = self._reconsidered(), []
        for number in range(place, len(self._journal)):
            for occurrence in self._follow(number):
                earlier = before.take(occurrence.key)
                if earlier is None:
                    appeared.append(self._found_at(number, self._new(occurrence)))
                elif self._found_at(number, new := self._still(earlier, occurrence)).status != earlier.status:
                    changed.append(new)
        return [replace(one, status="retracted") for one in before] + changed + appeared

    def _reconsidered(self) -> list[Occurrence]:
        """Give the occurrences that rest on no open hypothesis any more."""
        before = self._found
        self._found = [(number, self._still(one, one)) for number, one in before]
        pairs = zip(before, self._found, strict=True)
        return [new for (_, old), (_, new) in pairs if new.status != old.status]

    def _follow(self, number: int) -> Sequence[Occurrence]:
        """Give an entry of the journal to the live engine."""
        occurrences = list(_fed(self.live, self._journal[number]))
        if number + 1 >= self._states[-1][0] + _STATE_EVERY:
            self._states.append((number + 1, self.live.state()))
            if len(self._states) > _STATES_KEPT:
                del self._states[1::2]
        return occurrences

    def _found_at(self, number: int, occurrence: Occurrence) -> Occurrence:
        self._found.append((number, occurrence))
        return occurrence

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
        """Pass what nothing can take back any more; what was found of it stands for good."""
        until_us = min(self._open.values(), default=UNBOUNDED_US) + self.live.lateness_us
        found: list[Occurrence] = []
        while self._settled < len(self._journal):
            entry = self._journal[self._settled]
            if _time(entry) > until_us or (
                isinstance(entry, Event) and not self._open.keys().isdisjoint(entry.hypotheses)
            ):
                break
            self._settled_clock_us = self._clocks_us[self._settled]
            self._settled += 1
            if not self._early:
                found += _fed(self.live, entry)
        if not self._is_changed:
            self._forget()
        return [self._new(one) for one in found]

    def _forget(self) -> None:
        """Forget the part of the journal that no replay will start from."""
        gone = self._settled
        if self._early and gone < len(self._journal):
            at = bisect_left(self._states, gone + 1, key=itemgetter(0)) - 1
            gone = self._states[at][0]
            self._states = [(number - gone, state) for number, state in self._states[at:]]
        else:
            self._states = []
        if gone:
            del self._journal[:gone], self._clocks_us[:gone]
            self._settled -= gone
            self._found = [(number - gone, one) for number, one in self._found if number >= gone]

    # ---- checkpoints

    def state(self) -> Any:  # Any: plain nested data
        """Give everything that may still be taken back, as plain data, events and occurrences."""
        return {
            "engine": self._states[0][1] if self._states else self.live.state(),
            "clock_us": [self._clock_us, self._settled_clock_us, self._replayed_us],
            "is_changed": self._is_changed,
            "journal": [self._journal, self._clocks_us],
            "settled": self._settled,
            "found": self._found,
            "open": self._open,
            "first_us": self._first_us,
            "decided": self._decided,
        }

    def restore(self, state: Any) -> None:  # Any: see `state`
        """Take up where `state` was given; this revision is new."""
        self.live.restore(state["engine"])
        self._clock_us, self._settled_clock_us, self._replayed_us = state["clock_us"]
        self._is_changed, self._settled = state["is_changed"], state["settled"]
        self._journal, self._clocks_us = (list(one) for one in state["journal"])
        self._found, self._first_us = list(state["found"]), dict(state["first_us"])
        self._open, self._decided = dict(state["open"]), dict(state["decided"])
        if self._early and self._journal:
            self._states = [(0, state["engine"])]
            if not self._is_changed:
                for number in range(len(self._journal)):
                    self._follow(number)


def _time(entry: Event | int) -> int:
    return entry if isinstance(entry, int) else entry.t_us


def _fed(engine: Engine, entry: Event | int) -> Sequence[Occurrence]:
    return engine.advance(entry) if isinstance(entry, int) else engine.observe(entry)


class _Occurrences:
    """Occurrences in their order; several may be alike, when the same event was told twice."""

    def __init__(self, occurrences: Iterable[Occurrence]) -> None:
        self._by_key: dict[OccurrenceKey, deque[Occurrence]] = {}
        for one in occurrences:
            self._by_key.setdefault(one.key, deque()).append(one)

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
