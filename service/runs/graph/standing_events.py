"""Which events of chronicles stand, for monitors that look at them? Those that nothing can take back any more.

An event is true in one state: the first at or after its time. A state is *complete* when no event up to its time can
come or go; until then it is held back from the monitors that look at events.
"""

from bisect import bisect_right, insort
from collections import deque
from collections.abc import Collection, Iterable, Iterator
from operator import attrgetter

from chronicles.adapter import RecognitionUnit
from chronicles.chronicle_set import ChronicleSet
from chronicles.compilation.hierarchy import levels
from chronicles.events import Event, Occurrence
from chronicles.execution.limits import USUAL, Limits
from chronicles.recogniser import Recogniser
from dyknow.sample import Sample
from qsr.adapter import FrameRelations
from service.runs.graph.monitored_states import TrafficState

_NEVER_US, _FOR_GOOD_US = -(2**62), 2**62
_time = attrgetter("t_us")


class StandingEvents:
    """Holds states back until they are complete; recognises the chronicles that monitors look at meanwhile.

    Parameters
    ----------
    chronicles : those of the run.
    names : the events that are looked at; without any, each state is complete at once.
    lag_us : how far back relation changes are dated, at most.
    """

    def __init__(
        self, chronicles: ChronicleSet, names: Collection[str], *, lag_us: int, limits: Limits = USUAL
    ) -> None:
        feeding = chronicles.feeding(names)
        placed = levels(feeding.plans)
        delays_us = (placed[plan.name][1] + us for plan in feeding.plans for name, _, us in plan.given if name in names)
        self._names = names
        self._delay_us = max(delays_us, default=0)
        # Final answers only: what the run tells early, by its own recogniser, may be taken back.
        self._recogniser = Recogniser(feeding, lag_us, early=False, limits=limits)
        self._unit = RecognitionUnit(self._recogniser, horizon_us=lag_us)
        self._complete_us = _NEVER_US if names else _FOR_GOOD_US
        self._waiting: deque[tuple[int, TrafficState]] = deque()
        self._events: list[Event] = []

    def take(self, t_us: int, frame: FrameRelations) -> None:
        """Take what a frame decided."""
        if self._names:
            self._add(one.value for one in self._unit.update(Sample(t_us, t_us, frame)))
            self._complete_us = self._recogniser.settled_us - self._delay_us - 1  # of that very time more may come

    def finish(self, found: Iterable[Occurrence] = ()) -> None:
        """Take it that nothing comes any more, but for what was found otherwise."""
        self._add(one.value for one in self._unit.finish())
        self._add(found)
        self._complete_us = _FOR_GOOD_US

    def hold(self, t_us: int, state: TrafficState) -> None:
        """Take the next state."""
        self._waiting.append((t_us, state))

    def complete(self) -> Iterator[tuple[int, TrafficState]]:
        """Give the states that are complete by now, with their times, and the events in them."""
        while self._waiting and self._waiting[0][0] <= self._complete_us:
            t_us, state = self._waiting.popleft()
            count = bisect_right(self._events, t_us, key=_time)
            yield t_us, state.with_events(self._events[:count])
            del self._events[:count]

    def _add(self, found: Iterable[Occurrence]) -> None:
        for one in found:
            for event in one.given:
                if event.name in self._names and one.confidence >= one.floor:
                    insort(self._events, event, key=_time)
