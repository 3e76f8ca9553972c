"""Which chronicles occur in a stream of events, or in events that are all at hand?

Two executors find the same occurrences in the same order. The live one, eager, keeps every partial instance, so answers
come at once; the stored one, backfill, joins whole columns of events.

`Recogniser` takes events as they come, up to `lateness_us` out of order. Its watermark is the latest time it was told,
by an event or by `advance`, minus the lateness: an event before the watermark is late and only counted, and everything
before the watermark is known, so absences up to it can be concluded. Nothing here reads a clock.

Events may rest on hypotheses that are confirmed or refuted later, and while a hypothesis is open, events may come that
are older than the watermark; see `execution/live/revision.py`.
"""

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from typing import Any  # Any: checkpoints are plain nested data

from chronicles.chronicle_set import ChronicleSet
from chronicles.errors import ChronicleError
from chronicles.events import Event, Occurrence, PartialInstance, by_time
from chronicles.execution.engine import Engine
from chronicles.execution.limits import USUAL, Limits
from chronicles.execution.live.plain_data import from_plain, to_plain
from chronicles.execution.live.revision import Revision, Verdict
from chronicles.execution.stored.backfill import recognise_columns
from chronicles.execution.stored.columns import EventColumns
from chronicles.execution.stored.matches import TooManyMatches

_EXECUTORS = ("eager", "backfill")


class Recogniser:
    """Recognises the chronicles of a set, event by event.

    Parameters
    ----------
    chronicles : as given by `chronicles.load`.
    lateness_us : how much earlier than the latest time told an event may be.
    early : whether what rests on open hypotheses is told at once, as tentative, and taken back if need be. Without
        early answers everything waits until the hypotheses are decided, is told once and stands.
    patience_us : how long after a revision of early answers the next one waits, so that it serves many verdicts and
        late events; what comes meanwhile waits with it.
    limits : what each chronicle may cost; instances beyond it are left out, the later ones first.

    Attributes
    ----------
    late_count : number of events that came when nothing could come any more, and were left out.

    Raises
    ------
    ChronicleError
        If a setting is out of its range.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> stay = "chronicle stay[?car](t1, t2) { event(enter[?car], t1) event(leave[?car], t2) t2 - t1 in [0s, 9s] }"
    >>> recogniser = Recogniser(load(stay))
    >>> recogniser.observe(Event("enter", ("car1",), 1_000_000))
    []
    >>> [found] = recogniser.observe(Event("leave", ("car1",), 3_000_000))
    >>> found.chronicle, found.roles, found.start_us, found.end_us
    ('stay', {'car': 'car1'}, 1000000, 3000000)
    """

    def __init__(
        self,
        chronicles: ChronicleSet,
        lateness_us: int = 0,
        *,
        early: bool = True,
        patience_us: int = 0,
        limits: Limits = USUAL,
    ) -> None:
        if type(lateness_us) is not int or lateness_us < 0:
            raise ChronicleError(f"recogniser: expected a lateness >= 0 us, got {lateness_us!r}")
        self.late_count = 0
        self._setup: dict[str, Any] = {
            "format": 4,
            "chronicles": [[plan.name, plan.version] for plan in chronicles.plans],
            "lateness_us": lateness_us,
            "executor": "eager",  # there were others, whose checkpoints have another form
            "early": early,
            "patience_us": patience_us,
            "limits": [limits.most_waiting, limits.most_matches],
        }
        self._make_engine: Callable[[], Engine] = lambda: Engine(chronicles, lateness_us, limits=limits)
        self._engine = self._make_engine()
        self._revision: Revision | None = None

    def observe(self, event: Event) -> Sequence[Occurrence]:
        """Take an event, and let time advance to it.

        Returns
        -------
        What is recognised now, sorted by the time it became certain, then by the chronicle's place in the set, values
        and times. Occurrences are built when they are looked at, so counting thousands of them costs little.
        """
        if event.hypotheses or self._revision is not None:
            return self.revise(events=(event,))
        if event.t_us < self._engine.watermark_us:
            self.late_count += 1
            return []
        return self._engine.observe(event)

    def advance(self, t_us: int) -> Sequence[Occurrence]:
        """Let time pass up to `t_us` without an event; an earlier time than the latest told changes nothing.

        Returns
        -------
        What is recognised now, in the order of `observe`.
        """
        return self._engine.advance(t_us) if self._revision is None else self._revision.advance(t_us)

    def partial_instances(self) -> tuple[PartialInstance, ...]:
        """List the instances that may still be recognised, with the windows of what they expect.

        Events that still wait for the watermark are not looked at.
        """
        return tuple(self._live.partial_instances())

    @property
    def left_out(self) -> Counter[str]:
        """How many instances were beyond the limits, by chronicle; where a revision looks again they count again."""
        return self._live.left_out

    # ---- hypotheses

    @property
    def settled_us(self) -> int:
        """The time before which nothing comes or goes any more: without early answers, all that ended is told."""
        return self._engine.watermark_us if self._revision is None else self._revision.settled_us

    @property
    def open_hypotheses(self) -> dict[str, int]:
        """The hypotheses opened, or of events seen so far, that are not decided; memory grows until they are.

        Each with the time from which on events may come by it that were not seen yet.
        """
        return {} if self._revision is None else self._revision.open_hypotheses

    def open(self, hypothesis: str, since_us: int) -> None:
        """Expect that events from a time on may still come, or be taken back, while a hypothesis is open.

        Events of that time are not late until it is decided.
        """
        self.revise(opened=((hypothesis, since_us),))

    def confirm(self, hypothesis: str) -> list[Occurrence]:
        """Take a hypothesis for true from now on; see `revise`."""
        return self.revise(confirmed=(hypothesis,))

    def retract(self, hypothesis: str) -> list[Occurrence]:
        """Take a hypothesis for false from now on; see `revise`."""
        return self.revise(refuted=(hypothesis,))

    def revise(
        self,
        *,
        opened: Sequence[tuple[str, int]] = (),
        refuted: Collection[str] = (),
        confirmed: Collection[str] = (),
        undecided: Collection[str] = (),
        events: Sequence[Event] = (),
    ) -> list[Occurrence]:
        """Take all that became known together, which costs one revision at most.

        Parameters
        ----------
        opened : see `open`.
        refuted : it is as if the events that rest on them had never come. The time that those events told has passed
            all the same. Events with them that come later are left out.
        confirmed : taken for true.
        undecided : nobody will ever know: what rests on them stays tentative for good, and nothing waits for them.
            Of each hypothesis the first verdict stands.
        events : as for `observe`. Those from before the watermark are taken as if they had come in time, unless they
            are from before what an open hypothesis holds back.

        Returns
        -------
        First the occurrences that fall ("retracted"), then those that rest on no open hypothesis any more
        ("confirmed"), then those that appear.

        Examples
        --------
        >>> from chronicles.chronicle_set import load
        >>> alone = load("chronicle alone[?car](t1) { event(enter[?car], t1) noevent(leave[?car], (t1, t1 + 5s)) }")
        >>> recogniser = Recogniser(alone)
        >>> recogniser.observe(Event("enter", ("car1",), 0))
        []
        >>> recogniser.observe(Event("leave", ("car1",), 2_000_000, hypotheses=("it was car1",)))
        []
        >>> recogniser.advance(5_000_000)
        []
        >>> [(found.status, found.roles) for found in recogniser.revise(refuted=["it was car1"])]
        [('recognised', {'car': 'car1'})]
        """
        is_sure = not (opened or refuted or confirmed or undecided or any(event.hypotheses for event in events))
        if self._revision is None and is_sure:
            return [found for event in sorted(events, key=by_time) for found in self.observe(event)]
        revision = self._revising()
        in_time = [event for event in events if event.t_us >= revision.settled_us]
        self.late_count += len(events) - len(in_time)
        verdicts: dict[Verdict, Collection[str]]
        verdicts = {"refuted": refuted, "confirmed": confirmed, "undecided": undecided}
        return revision.revise(opened, verdicts, in_time)

    def _revising(self) -> Revision:
        if self._revision is None:
            self._revision = Revision(self._engine, early=self._setup["early"], patience_us=self._setup["patience_us"])
        return self._revision

    @property
    def _live(self) -> Engine:
        return self._engine if self._revision is None else self._revision.live

    # ---- checkpoints

    def checkpoint(self) -> dict[str, Any]:  # Any: plain nested data
        """Give everything the recogniser remembers, as plain data that `json.dumps` takes.

        Examples
        --------
        >>> from chronicles.chronicle_set import load
        >>> stay = load("chronicle stay[](t1, t2) { event(enter[], t1) event(leave[], t2) t2 - t1 in [0s, 9s] }")
        >>> first, second = Recogniser(stay), Recogniser(stay)
        >>> first.observe(Event("enter", (), 0))
        []
        >>> second.restore(first.checkpoint())
        >>> len(second.observe(Event("leave", (), 1_000_000)))
        1
        """
        state = to_plain(
            {
                "late_count": self.late_count,
                "engine": self._engine.state() if self._revision is None else None,
                "revision": None if self._revision is None else self._revision.state(),
            }
        )
        return {**self._setup, "state": state, "digest": _digest(state)}

    def restore(self, checkpoint: dict[str, Any]) -> None:  # Any: plain nested data
        """Take up where a checkpoint was made, forgetting everything else.

        Raises
        ------
        ChronicleError
            If the checkpoint is of other chronicles, of other settings, or no checkpoint at all.
        """
        if not isinstance(checkpoint, dict) or checkpoint.get("digest") != _digest(checkpoint.get("state")):
            raise ChronicleError("checkpoint: expected one that a recogniser gave, got another or a damaged one")
        for key, wanted in self._setup.items():
            if checkpoint.get(key) != wanted:
                raise ChronicleError(f"checkpoint: expected {key} {wanted!r}, got {checkpoint.get(key)!r}")
        state = from_plain(checkpoint["state"])
        self.late_count = state["late_count"]
        self._engine, self._revision = self._make_engine(), None
        if state["revision"] is None:
            self._engine.restore(state["engine"])
        else:
            self._revising().restore(state["revision"])


def recognise(
    chronicles: ChronicleSet,
    events: Iterable[Event] | EventColumns,
    *,
    until_us: int | None = None,
    executor: str = "backfill",
    limits: Limits = USUAL,
    left_out: Counter[str] | None = None,
) -> Sequence[Occurrence]:
    """Recognise chronicles in events that are all at hand.

    Parameters
    ----------
    chronicles : as given by `chronicles.load`.
    events : in any order, or stored columns.
    until_us : the time up to which the events are complete; the latest event's time if not given. An absence that ends
        later stays open: nobody saw it come true.
    executor : "eager" or "backfill", which leaves it to "eager" where an event completes more than the limits allow.
    limits : what each chronicle may cost; instances beyond it are left out, the later ones first.
    left_out : gets how many instances were beyond the limits, by chronicle.

    Returns
    -------
    The occurrences in the order in which a `Recogniser` tells them. Where chronicles ask for events alone, those of
    "backfill" are built when they are looked at.

    Raises
    ------
    ChronicleError
        If there is no such executor, or `until_us` is no whole number.

    Examples
    --------
    >>> from chronicles.chronicle_set import load
    >>> alone = load("chronicle alone[?car](t1) { event(enter[?car], t1) noevent(enter[?], (t1 + 1us, t1 + 5s)) }")
    >>> events = [Event("enter", ("car1",), 0), Event("enter", ("car2",), 3_000_000)]
    >>> [found.roles for found in recognise(alone, events)]
    []
    >>> [found.roles for found in recognise(alone, events, until_us=8_000_000)]
    [{'car': 'car2'}]
    """
    if executor not in _EXECUTORS:
        raise ChronicleError(f"recognise: expected the executor 'eager' or 'backfill', got {executor!r}")
    if until_us is not None and type(until_us) is not int:
        raise ChronicleError(f"recognise: expected until_us, a whole number of us, got {until_us!r}")
    if executor == "backfill":
        columns = events if isinstance(events, EventColumns) else EventColumns.from_events(events)
        with suppress(TooManyMatches):
            return recognise_columns(chronicles, columns, until_us=until_us, limits=limits)
        events = columns
    recogniser = Recogniser(chronicles, limits=limits)
    stream = events.events if isinstance(events, EventColumns) else sorted(events, key=by_time)
    found = [occurrence for event in stream for occurrence in recogniser.observe(event)]
    if until_us is not None:
        found += recogniser.advance(until_us)
    if left_out is not None:
        left_out.update(recogniser.left_out)
    return found


def _digest(state: object) -> str:
    """Tell a state from every other one: what is damaged would be noticed much later, or never."""
    return hashlib.sha256(json.dumps(state, sort_keys=True).encode()).hexdigest()
