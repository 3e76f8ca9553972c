"""What is true of a car once it turns out that what was seen lately was not that car?

What was told of it while it was taken for another one is taken back, by its label. But relations are told as changes,
so what is told next must go on from what held before. So the observer is kept as it was before each frame in which a
link begins that may be refuted, and with it the frames since. They are looked at again then, with that car not seen.
"""

from collections.abc import Collection, Mapping
from dataclasses import replace

from qsr.changes.crossings import RelationChange
from qsr.changes.line_up import Seen
from qsr.observer import RelationObserver, rank


class ReplayingObserver:
    """Observe relations among objects some of which may turn out to be others.

    Parameters
    ----------
    observer : that has seen no frame yet.
    """

    def __init__(self, observer: RelationObserver) -> None:
        self._observer = observer
        self._labels: dict[str, tuple[str, int]] = {}  # that may be refuted: whom each is about, and since which frame
        self._before: dict[int, RelationObserver] = {}  # as it was before each of these frames
        self._seen: dict[int, Seen] = {}  # since the first of them

    def observe(
        self,
        seen: Seen,
        begun: Mapping[str, str] | None = None,
        decided: Collection[str] = (),
        refuted: Collection[str] = (),
    ) -> list[RelationChange]:
        """Take one frame and return the changes it decides; see `RelationObserver.observe`.

        Parameters
        ----------
        seen : the frame.
        begun : labels of hypotheses by which an object is the one it is, from this frame on, and that object.
        decided : labels that will never be refuted.
        refuted : labels of which it is known now that the object was not seen since they began. What was told of it
            since then must be taken back; what is true of it since then is among the changes. These say which of the
            labels are ``younger`` than what shows them: whoever refutes one looks again from its beginning only.
        """
        t_us = seen.footprints.t_us
        for label in decided:
            self._labels.pop(label, None)
        wrong = [self._labels.pop(label) for label in refuted if label in self._labels]
        self._labels |= {label: (one, t_us) for label, one in (begun or {}).items()}
        retold = self._again(wrong, seen) if wrong else []
        if begun:
            self._before[t_us] = self._observer.copy()
        [changes] = self._observer.observe_all([seen])
        if self._labels:
            self._seen[t_us] = seen
        if self._seen:
            first_us = min((since_us for _, since_us in self._labels.values()), default=t_us + 1)
            self._before = {then_us: one for then_us, one in self._before.items() if then_us >= first_us}
            self._seen = {then_us: one for then_us, one in self._seen.items() if then_us >= first_us}
        return sorted(retold + changes, key=rank) if retold else changes

    def _again(self, wrong: Collection[tuple[str, int]], now: Seen) -> list[RelationChange]:
        """Look at the frames again since some objects were taken for others; tell what is true of these."""
        first_us = min(since_us for _, since_us in wrong)
        observer, told = self._before[first_us], list[RelationChange]()
        for t_us in [t_us for t_us in self._seen if t_us >= first_us]:
            if t_us in self._before:
                self._before[t_us] = observer.copy()
            unseen = {one for one, since_us in wrong if since_us <= t_us}
            self._seen[t_us] = seen = self._seen[t_us].without(unseen)
            told = _without_who_is_there(told, seen)
            younger = tuple(label for label, (_, since_us) in self._labels.items() if since_us > t_us)
            [changes] = observer.observe_all([seen])
            told += [
                replace(change, decided_us=now.footprints.t_us, younger=younger)
                for change in changes
                if not unseen.isdisjoint(change.args)
            ]
        self._observer = observer
        # Nothing will ever be known of those who did not come back.
        return [
            replace(change, absent=tuple([one for one in change.absent if one in now.hidden]))
            for change in _without_who_is_there(told, now)
        ]


def _without_who_is_there(told: Collection[RelationChange], seen: Seen) -> list[RelationChange]:
    """Leave out what was unknown because of somebody who has come back."""
    return [change for change in told if not set(change.absent).intersection(seen.footprints.ids)]
