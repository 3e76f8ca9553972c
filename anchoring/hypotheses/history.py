"""Who was who, and when? The links of the past, from the link changes."""

from collections.abc import Iterable
from dataclasses import dataclass

from anchoring.observations import Level, LinkChange


@dataclass(frozen=True, slots=True)
class LinkInterval:
    """Say that a lower object was linked to an upper one during [start_us, end_us); ``end_us`` None: it still is."""

    level: Level
    lower: str
    upper: str
    start_us: int
    end_us: int | None
    reason: str


class LinkHistory:
    """Keep every link there ever was.

    Examples
    --------
    >>> history = LinkHistory()
    >>> history.record([LinkChange(0, "established", "world", "v1", "w1", ""),
    ...                 LinkChange(0, "established", "car", "w1", "car1", ""),
    ...                 LinkChange(9, "lost", "world", "v1", "w1", "out of sight"),
    ...                 LinkChange(15, "reestablished", "world", "v2", "w1", "")])
    >>> history.car_of("v1", 3), history.car_of("v1", 12), history.car_of("v2", 20)
    ('car1', '', 'car1')
    >>> history.vision_ids("car1")
    (('v1', 0, 9), ('v2', 15, None))
    """

    __slots__ = ("_by_lower", "_by_upper", "_open")

    def __init__(self) -> None:
        self._by_lower: dict[str, list[LinkInterval]] = {}
        self._by_upper: dict[str, list[LinkInterval]] = {}
        self._open: dict[tuple[Level, str], LinkInterval] = {}

    def record(self, changes: Iterable[LinkChange]) -> None:
        """Take the link changes of a frame, in order of time."""
        for change in changes:
            key = change.level, change.upper
            before = self._open.pop(key, None)
            if before is not None:
                self._replace(before, change)
            if change.kind in {"established", "reestablished"}:
                interval = LinkInterval(change.level, change.lower, change.upper, change.t_us, None, "")
                self._open[key] = interval
                self._by_lower.setdefault(change.lower, []).append(interval)
                self._by_upper.setdefault(change.upper, []).append(interval)

    def car_of(self, vision_id: str, t_us: int) -> str:
        """Find the car that a vision object was at a time; "" for none."""
        name, links = vision_id, self._at(vision_id, t_us)
        while links:
            name = links[0].upper
            if links[0].level == "car":
                return name
            links = self._at(name, t_us)
        return ""

    def vision_ids(self, car_id: str) -> tuple[tuple[str, int, int | None], ...]:
        """List the vision objects that a car has been, in order: name, start, and end or None if it still is."""
        lowest: list[LinkInterval] = []
        pending = [car_id]
        while pending:
            for interval in self._by_upper.get(pending.pop(), []):
                if interval.level == "world":
                    lowest.append(interval)
                elif interval.lower not in pending:
                    pending.append(interval.lower)
        ordered = sorted(set(lowest), key=lambda interval: (interval.start_us, interval.lower))
        return tuple((interval.lower, interval.start_us, interval.end_us) for interval in ordered)

    def links_of(self, upper: str) -> tuple[LinkInterval, ...]:
        """List the links below an upper object, in order of time."""
        return tuple(self._by_upper.get(upper, ()))

    def _at(self, lower: str, t_us: int) -> list[LinkInterval]:
        return [
            interval
            for interval in self._by_lower.get(lower, ())
            if interval.start_us <= t_us and (interval.end_us is None or t_us < interval.end_us)
        ]

    def _replace(self, before: LinkInterval, change: LinkChange) -> None:
        after = LinkInterval(
            before.level, before.lower, before.upper, before.start_us, change.t_us, f"{change.kind}: {change.reason}"
        )
        for intervals in (self._by_lower[before.lower], self._by_upper[before.upper]):
            intervals[intervals.index(before)] = after
