"""What is an event of the truth, when does it count, and how is it written down?

An event counts if an observer could be asked for it: its vehicles are in view and not hidden from 1 s before to 1 s
after it, and no threshold of its definition was nearly missed. All others are kept with the reason: finding them is no
mistake and missing them neither.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from data_gen.simulation.states import BoolArray, IntArray

ROLES: Mapping[str, tuple[str, ...]] = {
    "overtake": ("overtaker", "overtaken"),
    "aborted_overtake": ("overtaker", "overtaken"),
    "pass": ("passer", "passed"),
    "follow": ("follower", "leader"),
    "tailgating": ("tailgater", "leader"),
    "cut_in": ("cutter", "car"),
    "turn_left": ("car",),
    "turn_right": ("car",),
    "drive_straight": ("car",),
    "u_turn": ("car",),
    "crossing": ("car",),
    "wrong_way": ("car",),
    "stop_and_go": ("car",),
    "near_miss": ("car", "other"),
    "reckless_overtake": ("overtaker", "overtaken", "danger"),
    "queue_jump": ("jumper", "first", "last"),
}
"""Roles that vehicles play in each type of event, in the order of `TruthEvent.vehicles`."""

INTERCHANGEABLE = frozenset({"near_miss"})
"""Types whose roles say nothing: either vehicle may have either of them."""

MARGIN_US = 1_000_000
"""Before and after an event the vehicles must be seen for so long."""


@dataclass(frozen=True, slots=True)
class TruthEvent:
    """Something that a vehicle did, mostly to another one."""

    type: str
    """One of the keys of `ROLES`."""
    vehicles: tuple[str, ...]
    """In the order of the type's roles."""
    start_us: int
    """Core interval, half-open; start and end are equal for an event without duration."""
    end_us: int
    why_not_countable: str | None = None
    manoeuvre_start_us: int | None = None
    """When the actor's centre left the other's lane; None if that was before the clip or never."""
    manoeuvre_end_us: int | None = None
    """When it was back in that lane; None if that is after the clip or never."""
    places: tuple[tuple[str, str], ...] = ()
    """Roles of roads, lanes and junctions, as ("junction", "centre")."""

    @property
    def countable(self) -> bool:
        """Tell whether nothing speaks against asking an observer for it."""
        return self.why_not_countable is None

    @property
    def actor(self) -> str:
        """Return the vehicle that does it: the first one."""
        return self.vehicles[0]

    @property
    def other(self) -> str:
        """Return the vehicle to which it is done: the second one; there must be one."""
        return self.vehicles[1]

    @property
    def roles(self) -> dict[str, str]:
        """Return vehicles by role; the last role is left out where a place has it, as a junction may be a danger."""
        return dict(zip(ROLES[self.type], self.vehicles, strict=False))


def rows_around(t_us: IntArray, start_us: int, end_us: int, margin_us: int = MARGIN_US) -> slice:
    """Give the steps from a margin before to a margin after an interval, as far as the clip goes.

    Examples
    --------
    >>> rows_around(np.arange(10) * 1_000_000, 3_000_000, 5_000_000)
    slice(2, 7, None)
    """
    first, last = np.searchsorted(t_us, (start_us - margin_us, end_us + margin_us), side="left").tolist()
    return slice(first, min(last + 1, len(t_us)))


def reasons_out_of_view(seen: BoolArray, roles: Sequence[str], what: str = "event") -> list[str]:
    """Say which vehicles are not seen all the time.

    Parameters
    ----------
    seen : (steps, vehicles), from 1 s before to 1 s after.
    roles : of the vehicles.
    what : name of the interval.
    """
    return [
        f"the {role} is not in view from 1 s before to 1 s after the {what}"
        for column, role in enumerate(roles)
        if not seen[:, column].all()
    ]


def reasons_cut_by_clip(t_us: IntArray, start_us: int, end_us: int, what: str = "event") -> list[str]:
    """Say whether the clip does not reach 1 s beyond an event.

    Examples
    --------
    >>> reasons_cut_by_clip(np.arange(10) * 1_000_000, 500_000, 5_000_000)
    ['the clip starts less than 1 s before the event']
    """
    reasons: list[str] = []
    if start_us - MARGIN_US < t_us[0]:
        reasons.append(f"the clip starts less than 1 s before the {what}")
    if end_us + MARGIN_US > t_us[-1]:
        reasons.append(f"the clip ends less than 1 s after the {what}")
    return reasons


def in_order(events: Iterable[TruthEvent]) -> tuple[TruthEvent, ...]:
    """Sort events by start, vehicles and type."""
    return tuple(sorted(events, key=lambda event: (event.start_us, event.vehicles, event.type, event.end_us)))


def write_truth_events(path: Path, events: Sequence[TruthEvent]) -> None:
    """Write one JSON object a line.

    Parameters
    ----------
    path : the file, `truth_events.jsonl` by custom.
    events : in the order in which they are written.
    """
    with path.open("w", encoding="utf-8") as file:
        file.writelines(json.dumps(_body(event)) + "\n" for event in events)


def _body(event: TruthEvent) -> dict[str, object]:
    return {
        "type": event.type,
        "roles": event.roles,
        "start_us": event.start_us,
        "end_us": event.end_us,
        "countable": event.countable,
        "why_not_countable": event.why_not_countable,
        "manoeuvre_start_us": event.manoeuvre_start_us,
        "manoeuvre_end_us": event.manoeuvre_end_us,
        "places": dict(event.places),
    }
