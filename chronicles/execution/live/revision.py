"""What if an event turns out never to have happened?

Events may rest on hypotheses, such as the identity of a car. While one of them is open, what was recognised from its
events is tentative, and when it is refuted, recognition must be as if those events had never come: occurrences that
rested on them go, and others appear that only they had prevented.

Two engines run: the live one takes every event at once; the settled one follows behind and takes only what nobody can
take back any more. Between them lies the journal. A refuted hypothesis costs a copy of the settled engine and a replay
of the journal without its events, which is right for every kind of statement by construction. Rejected: removing
instances, logs and histories event by event (a missing absence can only be found by looking again).
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any  # states are plain nested data

from chronicles.events import Event, Occurrence, OccurrenceKey, Status
from chronicles.execution.engine import Engine

DECIDED_KEPT = 10_000
"""How many confirmed and how many refuted hypotheses are known; an event that names an older one comes too late."""


class Revision:
    """Keeps what may still be taken back; invariant: live engine = settled engine + journal.

    Attributes
    ----------
    live : the engine that has seen every event.
    """

    def __init__(self, live: Engine, make_engine: Callable[[], Engine]) -> None:
        self.live = live
        self._make_engine = make_engine
        self._settled = self._copy(live)
        self._journal: deque[Event | int] = deque()  # an int is a time that was told without an event
        self._open: set[str] = set()
        self._confirmed: dict[str, None] = {}  # the latest, in the order in which they were decided
        self._refuted: dict[str, None] = {}
        # What the live engine has found and the settled one has not, as it was told last.
        self._standing = _Occurrences()

    @property
    def open_hypotheses(self) -> frozenset[str]:
        """The hypotheses of events seen so far that are neither confirmed nor refuted."""
        return frozenset(self._open)

    def observe(self, event: Event) -> list[Occurrence]:
        """Take an event; one that rests on a refuted hypothesis only tells the time."""
        if any(label in self._refuted for label in event.hypotheses):
            return self.advance(event.t_us)
        self._open.update(label for label in event.hypotheses if label not in self._confirmed)
        self._journal.append(event)
        return self._told(self.live.observe(event))

    def advance(self, t_us: int) -> list[Occurrence]:
        """Let time pass."""
        self._note_time(t_us)
        return self._told(self.live.advance(t_us))

    def confirm(self, hypothesis: str) -> list[Occurrence]:
        """Take a hypothesis for true; give the occurrences that rest on no open one any more."""
        self._decide(hypothesis, self._confirmed)
        found, standing = [], _Occurrences()
        for occurrence in self._standing:
            still = self._still(occurrence, occurrence)
            standing.add(still)
            if still.status != occurrence.status:
                found.append(still)
        self._standing = standing
        self._settle()
        return found

    def retract(self, hypothesis: str) -> list[Occurrence]:
        """Take a hypothesis for false; give the occurrences that fall, then that change, then that appear."""
        self._decide(hypothesis, self._refuted)
        if not any(isinstance(entry, Event) and hypothesis in entry.hypotheses for entry in self._journal):
            return []
        before, self._standing = self._standing, _Occurrences()
        changed, appeared = [], []
        for occurrence in self._replay_without(hypothesis):
            earlier = before.take(occurrence.key)
            if earlier is None:
                new = replace(occurrence, status=self._status(occurrence), recognised_us=self.live.clock_us)
                appeared.append(new)
            else:
                new = self._still(earlier, occurrence)
                if new.status != earlier.status:
                    changed.append(new)
            self._standing.add(new)
        self._settle()
        return [replace(one, status="retracted") for one in before] + changed + appeared

    def _decide(self, hypothesis: str, decided: dict[str, None]) -> None:
        self._open.discard(hypothesis)
        decided[hypothesis] = None
        if len(decided) > DECIDED_KEPT:
            del decided[next(iter(decided))]

    def _told(self, occurrences: Iterable[Occurrence]) -> list[Occurrence]:
        found = []
        for occurrence in occurrences:
            told = replace(occurrence, status=self._status(occurrence))
            self._standing.add(told)
            found.append(told)
        self._settle()
        return found

    def _status(self, occurrence: Occurrence) -> Status:
        return "recognised" if self._open.isdisjoint(occurrence.hypotheses) else "tentative"

    def _still(self, earlier: Occurrence, occurrence: Occurrence) -> Occurrence:
        """Describe what stands before and after a replay, which may rest on other evidence now."""
        status = earlier.status
        if status == "tentative" and self._open.isdisjoint(occurrence.hypotheses):
            status = "confirmed"
        return replace(occurrence, status=status, recognised_us=earlier.recognised_us)

    def _replay_without(self, hypothesis: str) -> list[Occurrence]:
        """Make the live engine anew from the settled one; time that a refuted event told has passed all the same."""
        self.live = self._copy(self._settled)
        entries, self._journal = self._journal, deque()
        found: list[Occurrence] = []
        for entry in entries:
            if isinstance(entry, Event) and hypothesis not in entry.hypotheses:
                self._journal.append(entry)
                found += self.live.observe(entry)
            else:
                t_us = entry.t_us if isinstance(entry, Event) else entry
                self._note_time(t_us)
                found += self.live.advance(t_us)
        return found

    def _note_time(self, t_us: int) -> None:
        if self._journal and isinstance(self._journal[-1], int):
            self._journal[-1] = max(self._journal[-1], t_us)
        else:
            self._journal.append(t_us)

    def _settle(self) -> None:
        """Give the settled engine what nothing can take back; what it finds stands for good."""
        journal, settled = self._journal, self._settled
        while journal:
            entry = journal[0]
            if isinstance(entry, int):
                found = settled.advance(entry)
            elif self._open.isdisjoint(entry.hypotheses):
                found = settled.observe(entry)
            else:
                return
            journal.popleft()
            for occurrence in found:
                self._standing.take(occurrence.key)

    def _copy(self, engine: Engine) -> Engine:
        copy = self._make_engine()
        copy.restore(engine.state())
        return copy

    # ---- checkpoints

    def state(self) -> Any:  # Any: plain nested data
        """Give everything that may still be taken back, as plain data, events and occurrences; not the live engine."""
        return {
            "settled": self._settled.state(),
            "journal": list(self._journal),
            "open": sorted(self._open),
            "confirmed": list(self._confirmed),
            "refuted": list(self._refuted),
            "standing": list(self._standing),
        }

    def restore(self, state: Any) -> None:  # Any: see `state`
        """Take up where `state` was given; the live engine is restored already."""
        self._settled.restore(state["settled"])
        self._journal = deque(state["journal"])
        self._open = set(state["open"])
        self._confirmed = dict.fromkeys(state["confirmed"])
        self._refuted = dict.fromkeys(state["refuted"])
        self._standing = _Occurrences()
        for occurrence in state["standing"]:
            self._standing.add(occurrence)


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
