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
what the engine tells of them stands. What was told together stands, waits and is fed together: of the labels of its
events only their union is looked at.
"""

from bisect import bisect_left, bisect_right, insort
from collections import deque
from collections.abc import Collection, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from operator import attrgetter, itemgetter
from typing import Any, Literal  # Any: states are plain nested data

from chronicles.compilation.times.network import UNBOUNDED_US
from chronicles.events import Event, Occurrence, OccurrenceKey, Status, by_time
from chronicles.execution.engine import Engine

DECIDED_KEPT = 10_000
"""How many decided hypotheses are known; an event that names an older one comes too late."""

Verdict = Literal["confirmed", "refuted", "undecided"]

_clock = attrgetter("clock_us")

_STATE_EVERY = 1000
"""Events of the journal from one state that is kept to the next; giving one costs as much as some hundred events."""
_STATES_KEPT = 32


@dataclass(slots=True)
class _Entry:
    """What was told together: the time told by it and all before it, its events in order of time, and their labels."""

    clock_us: int
    events: list[Event]
    labels: set[str]


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
        self._journal: list[_Entry] = []
        self._settled = 0  # so many entries cannot change any more
        self._states: list[tuple[int, Any]] = []  # of the engine, each with the number of entries seen; ascending
        self._fed_since = 0  # events and entries that the live engine has seen since the last of them
        # What the live engine found in the journal, as it was told last, with the number of the entry.
        self._found: list[tuple[int, Occurrence]] = []
        self._open: dict[str, int] = {}  # from when on events may come or go by it that are not in the journal
        self._decided: dict[str, Verdict] = {}  # the latest, in the order in which they were decided

    @property
    def open_hypotheses(self) -> dict[str, int]:
        """The hypotheses that were opened, or that events rest on, and that are not decided, and since when."""
        return dict(self._open)

    @property
    def settled_us(self) -> int:
        """The time before which nothing can come any more."""
        return self._settled_clock_us - self.live.lateness_us

    def revise(
        self, opened: Iterable[tuple[str, int]], verdicts: Mapping[Verdict, Collection[str]], events: Sequence[Event]
    ) -> list[Occurrence]:
        """Take what became known together; events are not before `settled_us`."""
        for label, since_us in opened:
            if label not in self._decided:
                self._open[label] = min(since_us, self._open.get(label, since_us))
        fallen = self._open.keys() & verdicts["refuted"]
        for verdict, labels in verdicts.items():
            for label in labels:
                self._decide(label, verdict)
        standing = self._standing(events)
        late = bisect_left(standing, self._clock_us - self.live.lateness_us, key=by_time)
        self._rewrite(fallen, standing[:late])
        clock_us = max([event.t_us for event in events], default=self._clock_us)
        told = self._take(standing[late:], clock_us) if standing[late:] or clock_us > self._clock_us else []
        return self._concluded(has_verdicts=any(verdicts.values())) + told

    def advance(self, t_us: int) -> list[Occurrence]:
        """Let time pass."""
        told = self._take([], t_us) if t_us > self._clock_us else []
        return told + self._concluded()

    def _decide(self, label: str, verdict: Verdict) -> None:
        """Keep a verdict, if it is the first one on its hypothesis."""
        self._open.pop(label, None)
        self._decided.setdefault(label, verdict)
        if len(self._decided) > DECIDED_KEPT:
            del self._decided[next(iter(self._decided))]

    def _standing(self, events: Iterable[Event]) -> list[Event]:
        """Sort events by time, open their hypotheses, and leave out what fits nothing or rests on a refuted one."""
        standing = sorted([event for event in events if event.name in self._names], key=by_time)
        labels = _labels(standing)
        refuted = {label for label in labels & self._decided.keys() if self._decided[label] == "refuted"}
        if refuted:
            standing = [event for event in standing if refuted.isdisjoint(event.hypotheses)]
            labels = _labels(standing)
        for label in labels - self._decided.keys():
            self._open.setdefault(label, UNBOUNDED_US)
        return standing

    def _take(self, events: list[Event], t_us: int) -> list[Occurrence]:
        """Write down events that are not late and the time that is told with them; give what they make certain."""
        self._clock_us = max(self._clock_us, t_us)
        entry = _Entry(self._clock_us, events, _labels(events))
        if self._early and not self._journal:
            if not self._open:  # nothing is ever to be taken back of it
                self._settled_clock_us = self._clock_us
                return [self._new(one, one.recognised_us) for one in _fed(self.live, entry)]
            self._states = [(0, self.live.state())]
            self._fed_since = 0
        self._journal.append(entry)
        if not self._early or self._is_changed:
            return []
        number = len(self._journal) - 1
        return [self._found_at(number, self._new(one, one.recognised_us)) for one in self._follow(number)]

    def _rewrite(self, fallen: Set[str], late: Iterable[Event]) -> None:
        """Leave out of the journal what falls, and put in what comes late, into the last entry where it is not late.

        So what happened at one time stays in the order in which it came. Time that a refuted event told has passed all
        the same.
        """
        changed = []
        for number, entry in enumerate(self._journal) if fallen else ():
            if not fallen.isdisjoint(entry.labels):
                entry.events = [event for event in entry.events if fallen.isdisjoint(event.hypotheses)]
                changed.append(number)
        for event in late:
            number = bisect_right(self._journal, event.t_us + self.live.lateness_us, key=_clock)
            insort(self._journal[number].events, event, key=by_time)
            self._journal[number].labels.update(event.hypotheses)
            changed.append(number)
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
        self._is_changed, self._replayed_us, self._fed_since = False, self._clock_us, 0
        place, state = self._states[-1]
        self.live.restore(state)
        at = bisect_left(self._found, place, key=itemgetter(0))
        before: dict[OccurrenceKey, deque[Occurrence]] = {}  # several are alike when the same event was told twice
        for _, one in self._found[at:]:
            before.setdefault(one.key, deque()).append(one)
        del self._found[at:]
        changed, appeared = self._reconsidered(), []
        for number in range(place, len(self._journal)):
            for occurrence in self._follow(number):
                alike = before.get(occurrence.key)
                if not alike:
                    appeared.append(self._found_at(number, self._new(occurrence, self._clock_us)))
                    continue
                earlier = alike.popleft()
                if self._found_at(number, new := self._still(earlier, occurrence)).status != earlier.status:
                    changed.append(new)
        fallen = [replace(one, status="retracted") for alike in before.values() for one in alike]
        return fallen + changed + appeared

    def _reconsidered(self) -> list[Occurrence]:
        """Give the occurrences that rest on no open hypothesis any more."""
        before = self._found
        self._found = [(number, self._still(one, one)) for number, one in before]
        pairs = zip(before, self._found, strict=True)
        return [new for (_, old), (_, new) in pairs if new.status != old.status]

    def _follow(self, number: int) -> Sequence[Occurrence]:
        """Give an entry of the journal to the live engine."""
        entry = self._journal[number]
        occurrences = _fed(self.live, entry)
        self._fed_since += 1 + len(entry.events)
        if self._fed_since >= _STATE_EVERY:
            self._fed_since = 0
            self._states.append((number + 1, self.live.state()))
            if len(self._states) > _STATES_KEPT:
                del self._states[1::2]
        return occurrences

    def _found_at(self, number: int, occurrence: Occurrence) -> Occurrence:
        self._found.append((number, occurrence))
        return occurrence

    def _new(self, occurrence: Occurrence, recognised_us: int) -> Occurrence:
        return replace(occurrence, status=self._status(occurrence), recognised_us=recognised_us)

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
            if entry.clock_us > until_us or not self._open.keys().isdisjoint(entry.labels):
                break
            self._settled_clock_us = entry.clock_us
            self._settled += 1
            if not self._early:
                found += _fed(self.live, entry)
        if not self._is_changed:
            self._forget()
        return [self._new(one, self._clock_us) for one in found]

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
            del self._journal[:gone]
            self._settled -= gone
            self._found = [(number - gone, one) for number, one in self._found if number >= gone]

    # ---- checkpoints

    def state(self) -> Any:  # Any: plain nested data
        """Give everything that may still be taken back, as plain data, events and occurrences."""
        return {
            "engine": self._states[0][1] if self._states else self.live.state(),
            "clock_us": [self._clock_us, self._settled_clock_us, self._replayed_us],
            "is_changed": self._is_changed,
            "journal": [(entry.clock_us, entry.events) for entry in self._journal],
            "settled": self._settled,
            "found": self._found,
            "open": self._open,
            "decided": self._decided,
        }

    def restore(self, state: Any) -> None:  # Any: see `state`
        """Take up where `state` was given; this revision is new."""
        self.live.restore(state["engine"])
        self._clock_us, self._settled_clock_us, self._replayed_us = state["clock_us"]
        self._is_changed, self._settled = state["is_changed"], state["settled"]
        self._journal = [_Entry(clock_us, events, _labels(events)) for clock_us, events in state["journal"]]
        self._found, self._open, self._decided = list(state["found"]), dict(state["open"]), dict(state["decided"])
        if self._early and self._journal:
            self._states = [(0, state["engine"])]
            if not self._is_changed:
                for number in range(len(self._journal)):
                    self._follow(number)


def _labels(events: Iterable[Event]) -> set[str]:
    return set().union(*[event.hypotheses for event in events])


def _fed(engine: Engine, entry: _Entry) -> list[Occurrence]:
    found = [one for event in entry.events for one in engine.observe(event)]
    found += engine.advance(entry.clock_us)
    return found
