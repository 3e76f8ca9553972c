"""Events and occurrences in a short notation, for tests and for the examples in the documentation."""

import re
from collections.abc import Sequence

from chronicles.chronicle_set import ChronicleSet, load
from chronicles.events import Event, Occurrence
from chronicles.recogniser import Recogniser

_EVENT = re.compile(r"(?P<time>\S+)\s+(?P<name>\w+)\[(?P<args>[^\]]*)\](?:\s+(?P<old>\w+)\s*->\s*(?P<new>\w+))?")
_US = {"us": 1, "ms": 1_000, "s": 1_000_000, "min": 60_000_000}


def us(text: str) -> int:
    """Read "1.5s" as microseconds."""
    match = re.fullmatch(r"(-?[0-9.]+)(us|ms|s|min)", text)
    assert match is not None, text
    return round(float(match[1]) * _US[match[2]])


def event(line: str) -> Event:
    """Read "2s behind[a, b] true -> false" or "2s enter[a]"."""
    match = _EVENT.fullmatch(line.strip())
    assert match is not None, line
    args = tuple(part.strip() for part in match["args"].split(",") if part.strip())
    return Event(match["name"], args, us(match["time"]), match["old"], match["new"])


def steps(text: str) -> list[Event | int]:
    """Read events, one a line; "until 9s" is a time to advance to; "#" starts a comment."""
    lines = [line.split("#")[0].strip() for line in text.strip().splitlines()]
    return [us(line[6:]) if line.startswith("until ") else event(line) for line in lines if line]


def run(
    chronicles: ChronicleSet | str, stream: str | Sequence[Event | int], *, lateness_us: int = 0
) -> list[Occurrence]:
    """Recognise chronicles, given as a set or as text, in a stream of events and times."""
    chosen = load(chronicles) if isinstance(chronicles, str) else chronicles
    recogniser = Recogniser(chosen, lateness_us)
    found: list[Occurrence] = []
    for step in steps(stream) if isinstance(stream, str) else stream:
        found += recogniser.advance(step) if isinstance(step, int) else recogniser.observe(step)
    return found


def shown(occurrences: Sequence[Occurrence]) -> list[str]:
    """Write each occurrence as "name[role=value] start..end" in seconds."""
    lines = []
    for one in occurrences:
        roles = ", ".join(f"{name}={value}" for name, value in one.roles.items())
        lines.append(f"{one.chronicle}[{roles}] {one.start_us / 1e6:g}s..{one.end_us / 1e6:g}s")
    return lines
