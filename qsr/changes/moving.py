"""Which objects are moving, and since when?"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from qsr.changes.crossings import RelationChange, SwitchBank
from qsr.settings import RelationSettings

FloatArray = NDArray[np.float64]
LongArray = NDArray[np.int64]


class MovingTracker:
    """Follow moving(object): faster than a limit, with hysteresis.

    Parameters
    ----------
    settings : thresholds.
    """

    __slots__ = ("_bank", "_changed_us", "_fresh", "_limit_mps")

    def __init__(self, settings: RelationSettings) -> None:
        self._limit_mps = settings.moving_mps
        self._bank = SwitchBank(np.array([settings.moving_margin_mps]), backdate_us=settings.backdate_us)
        self._changed_us: LongArray = np.zeros(0, dtype=np.int64)
        self._fresh: LongArray = np.zeros(0, dtype=np.int64)

    def forget(self, object_id: str, column: int, t_us: int) -> list[RelationChange]:
        """Make an object that has disappeared unknown; to be called before `keep`."""
        return [RelationChange("moving", (object_id,), t_us, t_us, bool(self._bank.is_on[0, column]), None)]

    def keep(
        self, columns: NDArray[np.intp], speed_mps: FloatArray, ids: Sequence[str], t_us: int
    ) -> list[RelationChange]:
        """Rearrange the objects as in `SwitchBank.keep`; fresh ones start with their next `update`."""
        self._bank.keep(columns)
        if len(self._changed_us):
            self._changed_us = np.where(columns < 0, t_us, self._changed_us.take(columns))
        else:
            self._changed_us = np.full(len(columns), t_us, dtype=np.int64)
        self._fresh = np.flatnonzero(columns < 0)
        return []

    def update(self, t_us: int, speed_mps: FloatArray, ids: Sequence[str]) -> list[RelationChange]:
        """Take the speed of every object, (n,), and return the changes."""
        turned = self._bank.update(t_us, (speed_mps - self._limit_mps).reshape(1, -1))[0]
        is_on = self._bank.is_on[0]
        changes = [
            RelationChange("moving", (ids[column],), t_us, t_us, None, bool(is_on[column]))
            for column in self._fresh.tolist()
        ]
        self._fresh = self._fresh[:0]
        if turned.any():
            for column in np.flatnonzero(turned).tolist():
                at_us = max(int(self._bank.since_us[0, column]), int(self._changed_us[column]) + 1)
                self._changed_us[column] = at_us
                now = bool(is_on[column])
                changes.append(RelationChange("moving", (ids[column],), at_us, t_us, not now, now))
        return changes
