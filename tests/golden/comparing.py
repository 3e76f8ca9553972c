"""Does a log say what the golden one says, and where does it not?

Rows are matched by what they say (a relation by its name, arguments and values) and, among those, by time; only then
their numbers are compared. So one row that is missing is one difference, and not all the rows behind it.

==================  ===========================  ==============================================================
what                tolerance                    reason
==================  ===========================  ==============================================================
times (`_us`)       one frame                    a decision may fall on the frame beside
positions           1 cm                         a tenth of what vision is off by; rounding in another CPU or
                                                 decoder moves them by far less
length, width       2 cm                         each has two ends of 1 cm
heading             0.01 rad                     two positions a metre apart, each 0.5 cm off sideways
speed               0.05 m/s                     two positions 0.2 s apart, each 0.5 cm off
rates of streams    1 %                          counts over times
other numbers       one part in a million        they are computed from the input's own numbers
==================  ===========================  ==============================================================

All else is equal, above all the order of the rows of one moment.
"""

import json
import math
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from types import MappingProxyType

from tests.golden.pinned import Row, Table, leaves

POSITION_M, SIZE_M, HEADING_RAD, SPEED_MPS, RATE_PART, OTHER_PART = 0.01, 0.02, 0.01, 0.05, 0.01, 1e-6
SHOWN = 12

_TOLERANCES = MappingProxyType(
    {
        **dict.fromkeys(("x_m", "y_m", "along_m"), POSITION_M),
        **dict.fromkeys(("length_m", "width_m"), SIZE_M),
        "heading_rad": HEADING_RAD,
        "speed_mps": SPEED_MPS,
    }
)
_EXACT_TIMES = frozenset({"frames", "left_out_frames", "runs"})
"""Tables whose times come from the input and its site."""

_OPEN = ("roles", "dropped", "settings")


@dataclass(frozen=True, slots=True)
class Match:
    """By which columns rows of a table belong together; bodies are named by the way into them.

    Attributes
    ----------
    same : equal in both.
    alike : equal in a row that is missing and one that is extra, which then are one that has changed.
    time : orders rows that are the same otherwise.
    moment : rows of one moment keep their order.
    """

    same: tuple[str, ...] = ()
    alike: tuple[str, ...] = ()
    time: str = ""
    moment: str = ""


_MATCHES: Mapping[str, Match] = MappingProxyType(
    {
        "meta": Match(("key",)),
        "events": Match(("type", "body.roles", "status"), ("type",), "start_us", "body.recognised_us"),
        "event_roles": Match(("seq", "role")),
        "revisions": Match(("revised",)),
        "durations": Match(("type",)),
        "role_names": Match(("type", "role")),
        "cars": Match(("car",)),
        "car_states": Match(("t_us", "car")),
        "car_states.lives": Match(("car",)),
        "seen_objects": Match(("t_us", "vision_id")),
        "seen_objects.lives": Match(("vision_id",)),
        "views": Match(("t_us",)),
        "frames": Match(("number",)),
        "left_out_frames": Match(("number",)),
        "links": Match(
            ("kind", "level", "lower", "upper", "reason"), ("kind", "level", "lower"), time="t_us", moment="t_us"
        ),
        "relations": Match(("name", "args", "old", "new"), ("name", "args"), time="t_us", moment="decided_us"),
        "hypotheses": Match(("label", "verdict"), ("label",), time="t_us", moment="t_us"),
        "streams": Match(("body.label",)),
    }
)


@dataclass(frozen=True, slots=True)
class Comparison:
    """What is different, and what the golden log does not know of."""

    differences: tuple[str, ...]
    not_pinned: tuple[str, ...]

    def report(self) -> str:
        """Show a handful, and how many there are in each table."""
        if not self.differences:
            return ""
        counts: dict[str, int] = defaultdict(int)
        for one in self.differences:
            counts[one.partition(":")[0]] += 1
        shown = [line for table in counts for line in self._of(table)[: max(2, SHOWN // len(counts))]]
        sums = ", ".join(f"{table} {count}" for table, count in counts.items())
        return "\n".join([f"{len(self.differences)} differences to the golden log ({sums}), among them", *shown])

    def _of(self, table: str) -> list[str]:
        return [one for one in self.differences if one.startswith(f"{table}:")]


def compare(
    golden: Mapping[str, Table], got: Mapping[str, Table], *, frame_us: int, is_exact: bool = False
) -> Comparison:
    """Compare the tables of a log with the golden ones.

    Parameters
    ----------
    frame_us : the time from frame to frame, by which times may be off.
    is_exact : no tolerance at all, for a log that was made on the same machine.
    """
    differences: list[str] = []
    not_pinned = [f"table {name}" for name in got if name not in golden]
    for name, expected in golden.items():
        if name not in got:
            differences.append(f"{name}: expected this table, got none")
            continue
        off_us = 0 if is_exact or name in _EXACT_TIMES else frame_us
        both = _TableComparison(expected, got[name], off_us, is_exact=is_exact)
        differences += both.differences()
        not_pinned += both.not_pinned()
    return Comparison(tuple(differences), tuple(not_pinned))


class _TableComparison:
    def __init__(self, golden: Table, got: Table, frame_us: int, *, is_exact: bool) -> None:
        self._is_exact = is_exact
        self._golden = golden
        self._got = got
        self._frame_us = frame_us
        self._match = _MATCHES.get(golden.name, Match())
        self._new: dict[str, None] = {}

    def differences(self) -> Iterator[str]:
        """Yield what is different; each begins with the name of the table."""
        lost = [column for column in self._golden.columns if column not in self._got.columns]
        if lost:
            yield f"{self._golden.name}: expected columns {lost}, got {list(self._got.columns)}"
            return
        pairs, missing, extra = self._matched()
        changed = []
        for place in list(missing):
            alike = [one for one in extra if self._are_alike(self._golden.rows[place], self._got.rows[one])]
            if self._match.alike and alike:
                missing.remove(place)
                extra.remove(alike[0])
                changed.append((place, alike[0]))
        for place in missing:
            yield f"{self._golden.name}: {self._words(self._golden.rows[place])}: expected this row, got none"
        for place in extra:
            yield f"{self._golden.name}: {self._words(self._got.rows[place])}: expected no such row, got one"
        for place, other in sorted([*pairs, *changed]):
            yield from self._row_differences(self._golden.rows[place], self._got.rows[other])
        yield from self._order_differences(pairs)

    def not_pinned(self) -> Iterator[str]:
        """Yield columns, and fields in bodies, that the golden log does not have; call it last."""
        for column in self._got.columns:
            if column not in self._golden.columns:
                yield f"column {self._golden.name}.{column}"
        for way in self._new:
            yield f"field {self._golden.name}.{way}"

    def _matched(self) -> tuple[list[tuple[int, int]], list[int], list[int]]:
        """Give places of rows that belong together, of golden rows that are missing, and of rows that are extra."""
        pairs: list[tuple[int, int]] = []
        missing: list[int] = []
        extra: list[int] = []
        golden, got = self._groups(self._golden.rows), self._groups(self._got.rows)
        for key in golden.keys() | got.keys():
            left, right = golden.get(key, []), got.get(key, [])
            for place, other in _aligned(self._times(self._golden, left), self._times(self._got, right)):
                if other is None:
                    missing.append(left[place])
                elif place is None:
                    extra.append(right[other])
                else:
                    pairs.append((left[place], right[other]))
        return sorted(pairs), sorted(missing), sorted(extra)

    def _groups(self, rows: Sequence[Row]) -> dict[str, list[int]]:
        groups: dict[str, list[int]] = defaultdict(list)
        for place, row in enumerate(rows):
            groups[json.dumps([_cell(row, way) for way in self._match.same])].append(place)
        return groups

    def _times(self, table: Table, places: Sequence[int]) -> list[float]:
        if not self._match.time:
            return [0.0] * len(places)
        return [float(str(table.rows[place][self._match.time])) for place in places]

    def _are_alike(self, golden: Row, got: Row) -> bool:
        same = all(_cell(golden, way) == _cell(got, way) for way in self._match.alike)
        time = self._match.time
        return same and (not time or abs(float(str(golden[time])) - float(str(got[time]))) <= self._frame_us)

    def _row_differences(self, golden: Row, got: Row) -> Iterator[str]:
        for column in self._golden.columns:
            expected, came = dict(leaves(column, golden[column])), dict(leaves(column, got[column]))
            for way, value in expected.items():
                if way not in came:
                    yield f"{self._golden.name}: {self._words(golden)}: {way}: expected {value!r}, got nothing"
                elif value != came[way] and (self._is_exact or not self._is_near(way, value, came[way])):
                    yield f"{self._golden.name}: {self._words(golden)}: {way}: expected {value!r}, got {came[way]!r}"
            known = {_without_places(way) for way in expected}
            for way in sorted(came.keys() - expected.keys()):
                if _is_in_open_record(way):
                    yield f"{self._golden.name}: {self._words(golden)}: {way}: expected nothing, got {came[way]!r}"
                elif _without_places(way) not in known:  # else the list has become longer, which its length says
                    self._new[_without_places(way)] = None

    def _is_near(self, way: str, expected: object, came: object) -> bool:
        name = way.rpartition(".")[2].partition("[")[0]
        if isinstance(expected, str) and isinstance(came, str) and name in ("start", "end"):
            return abs(_clock_us(expected) - _clock_us(came)) <= self._frame_us
        if isinstance(expected, bool) or not isinstance(expected, int | float) or not isinstance(came, int | float):
            return expected == came
        if name.endswith("_us"):
            return abs(expected - came) <= self._frame_us
        if isinstance(expected, int) and isinstance(came, int):
            return expected == came
        off = abs(expected - came)
        if name == "heading_rad":
            off = abs(math.remainder(off, math.tau))
        if name == "rate_hz":
            return off <= RATE_PART * abs(expected)
        return off <= _TOLERANCES.get(name, OTHER_PART * abs(expected)) + 1e-9

    def _order_differences(self, pairs: Sequence[tuple[int, int]]) -> Iterator[str]:
        """Tell of rows that were written at the same moment in another order."""
        if not self._match.moment:
            return
        newest: dict[tuple[object, object], tuple[int, int]] = {}
        for place, other in pairs:
            moments = (
                _cell(self._golden.rows[place], self._match.moment),
                _cell(self._got.rows[other], self._match.moment),
            )
            before = newest.get(moments)
            if before is not None and other < before[1]:
                words = self._words(self._golden.rows[place])
                after = self._words(self._golden.rows[before[0]])
                yield f"{self._golden.name}: {words}: order of rows: expected after {after}, got before"
            else:
                newest[moments] = (place, other)

    def _words(self, row: Row) -> str:
        """Name a row by what it says."""
        ways = [*self._match.same, *([self._match.time] if self._match.time else [])] or list(row)[:3]
        return ", ".join(f"{way} {_short(_cell(row, way))}" for way in dict.fromkeys(ways)) or "the row"


def _aligned(golden: Sequence[float], got: Sequence[float]) -> Iterator[tuple[int | None, int | None]]:
    """Pair times, both ascending or all equal; where one side has more, those farthest from a partner are left over."""
    left, right = sorted(range(len(golden)), key=golden.__getitem__), sorted(range(len(got)), key=got.__getitem__)
    while len(left) != len(right):
        more, times, others = (left, golden, got) if len(left) > len(right) else (right, got, golden)
        less = right if more is left else left
        away = {one: min((abs(times[one] - others[two]) for two in less), default=0.0) for one in more}
        lone = max(reversed(more), key=away.__getitem__)
        more.remove(lone)
        yield (lone, None) if more is left else (None, lone)
    yield from zip(left, right, strict=True)


def _cell(row: Row, way: str) -> object:
    value: object = row
    for part in way.split("."):
        assert isinstance(value, dict), (way, row)
        value = value[part]
    return value


def _short(value: object) -> str:
    text = str(value) if not isinstance(value, list) else ",".join(map(str, value))
    return text if len(text) <= 60 else text[:57] + "..."


def _clock_us(text: str) -> int:
    return round(datetime.fromisoformat(text).timestamp() * 1e6)


def _without_places(way: str) -> str:
    return re.sub(r"\[\d+\]", "[]", way)


def _is_in_open_record(way: str) -> bool:
    """Tell whether the names in a record are data, such as roles, and no fields."""
    return any(f".{name}." in way for name in _OPEN)
