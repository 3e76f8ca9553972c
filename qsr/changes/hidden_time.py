"""What is kept for the time when somebody turns out to have been there? Where all the others were meanwhile.

An object that is hidden stays among the objects, at its last place and not measured, so that all relations of it stay
as they were. When it is known where it was, the frames since its loss are looked at again, for its relations alone. So
are those in which an object was seen already that has got its name only now.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from qsr.changes.looks import NEVER_US, Doubt, Gone
from qsr.measuring.footprints import Footprints, pick_rows


class HiddenTime:
    """Keep who is not seen, and the frames since the first of them was lost, but at least the latest ones.

    Parameters
    ----------
    back_us : how far back a frame is kept in any case.
    """

    def __init__(self, back_us: int) -> None:
        self._back_us = back_us
        self._last: Footprints | None = None
        self._since_us: dict[str, int] = {}
        self._told: frozenset[str] = frozenset()
        self._frames: dict[int, Footprints] = {}

    def complete(self, frame: Footprints, hidden: Mapping[str, int]) -> Footprints:
        """Add those who are hidden, where they were last, and leave out guesses of those who were never seen."""
        if frame.observed.all() and not hidden:
            return frame
        last = self._last or frame.select(())
        known = frozenset(last.ids)
        is_seen = frame.observed.tolist()
        present = [one for k, one in enumerate(frame.ids) if is_seen[k] or one in known]
        kept = [one for one in hidden if one in known and one not in frame.ids]
        if len(present) == len(frame.ids) and not kept:
            return frame
        return pick_rows(frame.t_us, (*present, *kept), (frame, _unseen(last)))

    def moments(self, earlier: Sequence[Footprints]) -> Iterator[tuple[Footprints, frozenset[str]]]:
        """Give the frames to be looked at again, with those of whom it is known now where they were.

        Parameters
        ----------
        earlier : where those who are seen now were at earlier frames, in order of time.

        Returns
        -------
        Rows of all objects of the last frame, in its order, and of those that are new, from their first row on.
        """
        if self._last is None or not earlier:
            return
        known = _unseen(self._last)
        for rows in earlier:
            then = self._frames.get(rows.t_us)
            if then is not None and rows.ids:
                seen = rows.having(observed=np.ones(len(rows.ids), np.bool_))
                ids = (*known.ids, *[one for one in rows.ids if one not in known.ids])
                at_once = pick_rows(rows.t_us, ids, (seen, then, known))
                known = _unseen(at_once)
                self._frames[rows.t_us] = at_once
                yield at_once, frozenset(rows.ids)

    def gone(self, frame: Footprints, ids: Sequence[str]) -> dict[str, Gone]:
        """Find who was there in the last frame and is not in this one, as it is completed.

        Parameters
        ----------
        ids : of the last look, by column.
        """
        now = set(frame.ids)
        return {
            one: Gone(self._since_us.get(one, frame.t_us), one in self._told, column)
            for column, one in enumerate(ids)
            if one not in now
        }

    def doubt(self, frame: Footprints, hidden: Mapping[str, int], ids: Sequence[str]) -> Doubt | None:
        """Say who is hidden, of the objects of a completed frame in some order; None if nobody is, or was.

        Call it once a frame, after everything else.
        """
        hidden = {one: hidden[one] for one in frame.ids if one in hidden} if hidden else hidden
        doubt = None
        if hidden or self._told:
            was_told = np.array([one in self._told for one in ids], dtype=np.bool_)
            doubt = Doubt(np.array([hidden.get(one, NEVER_US) for one in ids], dtype=np.int64), was_told)
        unseen = [frame.ids[k] for k in (~frame.observed).nonzero()[0].tolist()]
        self._since_us = {one: self._since_us.get(one, frame.t_us) for one in unseen}
        self._last, self._told = frame, frozenset(hidden)
        self._frames[frame.t_us] = frame
        first_us = min([frame.t_us - self._back_us, *self._since_us.values()])
        while self._frames and (oldest := next(iter(self._frames))) < first_us:
            del self._frames[oldest]
        return doubt


def _unseen(frame: Footprints) -> Footprints:
    return frame.having(observed=np.zeros(len(frame.ids), np.bool_))
