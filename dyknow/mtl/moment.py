"""What has been worked out about one state already? The memory that all progressors of a table share."""

from __future__ import annotations

from dyknow.mtl.residual import Residual
from dyknow.mtl.states import State


class Moment:
    """One state at one time.

    Attributes
    ----------
    memo : residuals of what was asked or progressed in this state.
    has_opened : whether a window was opened whose place in time depends on that of the state, since this was last set
        to False: whoever wants to know does so before asking.
    openers : the keys of `memo` whose residuals opened such a window; who finds one there has opened it as well.
    """

    __slots__ = ("_members", "has_opened", "memo", "openers", "state", "t_us")

    def __init__(self, t_us: int, state: State) -> None:
        self.t_us = t_us
        self.state = state
        self.memo: dict[object, Residual] = {}
        self.has_opened = False
        self.openers: set[object] = set()
        self._members: dict[str, frozenset[str]] | None = None  # made when needed: most formulas name no sort

    def has_member(self, sort: str, member: str) -> bool:
        """Tell whether an object is a member of a sort in this state."""
        if self._members is None:
            self._members = {}
        if sort not in self._members:
            self._members[sort] = frozenset(self.state.members(sort))
        return member in self._members[sort]
