"""Which arguments and options do several commands take, and how are their texts read?"""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from service.cli.printing import tell
from service.errors import QueryError
from service.records.times import parse_media_us

if TYPE_CHECKING:
    from service.store.log import EventLog, Mode
    from service.texts.text_streams import Stream

_TIMES = "12.5s, 01:23 or 12500000 (us)"
_AGE = re.compile(r"(\d{1,6})(d|h|min)", re.ASCII)
_AGE_UNIT_US = {"d": 86_400_000_000, "h": 3_600_000_000, "min": 60_000_000}

LogName = Annotated[str, typer.Argument(metavar="LOG", help="Event log: PATH.db, or a URL.")]
RunName = Annotated[str | None, typer.Option("--run", help="Run of the log, if it holds several.")]
From = Annotated[str | None, typer.Option("--from", help=f"First media time: {_TIMES}.")]
To = Annotated[str | None, typer.Option("--to", help="Media time to stop before.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object, whatever --format says.")]
ChronicleFiles = Annotated[
    list[Path] | None,
    typer.Option("--chronicles", help="Chronicle file; repeat for several. Default: those of the run, or the library."),
]
SiteOfInput = Annotated[Path | None, typer.Option("--site", help="Site file: roads, camera, start time.")]
ChroniclesToRun = Annotated[
    list[Path] | None,
    typer.Option("--chronicles", help="Chronicle file; repeat for several. Default: the whole library."),
]
MonitorsToRun = Annotated[
    list[Path] | None,
    typer.Option("--monitors", help="File of monitors, formulas to watch over; repeat for several."),
]
KplFile = Annotated[
    Path | None, typer.Option("--kpl", help="KPL file: the streams and policies instead of the shipped ones.")
]
LinkageFile = Annotated[
    Path | None,
    typer.Option("--linkage", help="Linkage file: the classes and links of objects instead of the shipped ones."),
]
Rate = Annotated[
    str | None,
    typer.Option("--rate", metavar="HZ", help="Frames looked at in a second; full: all. Default: 12.5."),
]
Final = Annotated[
    bool, typer.Option("--final", help="Tell events when they are final: none is tentative first or taken back.")
]
VisionWorkers = Annotated[
    Literal["auto", "0", "1"],
    typer.Option("--workers", help="Processes that look at the video, beside the one that thinks."),
]
SiteOfRun = Annotated[
    Path | None,
    typer.Option(
        "--site",
        exists=True,
        dir_okay=False,
        help="Site file of the run, if it moved: with it, relations not watched are computed.",
    ),
]
Texts = Annotated[list[str] | None, typer.Argument(metavar="FILE...", help="Chronicle files; - reads standard input.")]
MinConfidence = Annotated[
    float | None,
    typer.Option(
        min=0.0,
        max=1.0,
        help="How sure an event is at least, 0 to 1, instead of what its chronicle asks for; 0 tells all.",
    ),
]
Seed = Annotated[int, typer.Option("--seed", min=0, help="The same seed gives the same files to the byte.")]
ScenarioOptions = Annotated[
    list[str] | None, typer.Option("--option", help="Option of the scenario, NAME=VALUE; may come several times.")
]


StreamChoice = Literal["traffic", "own"]
StreamOption = Annotated[
    StreamChoice | None,
    typer.Option(
        "--stream", help="The texts are about DyKnow's relations (traffic) or their own events. Default: as they say."
    ),
]

# Codes of findings that may only mean that the texts are about other events than was thought.
STREAM_CODES = frozenset({"C0201", "C0203", "C0301", "C0302", "C0901"})


def open_log(name: str, mode: "Mode" = "r") -> "EventLog":
    """Open an event log, as `service.store.log.open_log`, which takes longer to load than help may take."""
    from service.store import log

    return log.open_log(name, mode)


def read_window(start: str | None, end: str | None) -> tuple[int | None, int | None]:
    """Read `--from` and `--to` as microseconds of media time; raises `QueryError` if one is no time."""
    from_us = None if start is None else parse_media_us(start, parameter="--from")
    return from_us, None if end is None else parse_media_us(end, parameter="--to")


def read_age_us(text: str, refusal: str) -> int:
    """Read a length of time in days, hours or minutes; raises a `QueryError` that says `refusal` if it is none.

    Examples
    --------
    >>> read_age_us("90min", "--expires: expected an age, got another text")
    5400000000
    """
    given = _AGE.fullmatch(text)
    if given is None:
        raise QueryError(refusal)
    return int(given[1]) * _AGE_UNIT_US[given[2]]


def read_pairs(texts: Sequence[str], option: str, expected: str) -> list[tuple[str, str]]:
    """Read `NAME=VALUE` texts.

    Raises
    ------
    typer.BadParameter
        If a text is not of this form; `expected` says what was.

    Examples
    --------
    >>> read_pairs(["lanes=2", "curve="], "--option", "NAME=VALUE")
    [('lanes', '2'), ('curve', '')]
    """
    pairs = []
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise typer.BadParameter(f"expected {expected}, got {text!r}", param_hint=option)
        pairs.append((name, value))
    return pairs


def read_roles(texts: Sequence[str]) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Read `NAME=ID` texts; the same name again adds an alternative.

    Raises
    ------
    typer.BadParameter
        If a text is not of this form.

    Examples
    --------
    >>> read_roles(["overtaker=car7", "overtaken=car3", "overtaker=car9"])
    (('overtaken', ('car3',)), ('overtaker', ('car7', 'car9')))
    """
    roles: dict[str, list[str]] = {}
    expected = "NAME=ID, such as overtaker=car7"
    for name, actor in read_pairs(texts, "--role", expected):
        if not actor:
            raise typer.BadParameter(f"expected {expected}, got {name + '='!r}", param_hint="--role")
        roles.setdefault(name, []).append(actor)
    return tuple((name, tuple(actors)) for name, actors in sorted(roles.items()))


def tell_stream(stream: "Stream", *, is_doubtful: bool) -> None:
    """Say on stderr what texts were taken to be about, where another choice may have been meant."""
    if stream == "own":
        said = "taken as texts about their own events; --stream traffic takes them with DyKnow's relations"
    elif is_doubtful:
        said = "taken with DyKnow's relations; --stream own takes them as texts about their own events"
    else:
        return
    tell("note", [said])


@contextmanager
def hinting_at_stream(*, is_open: bool) -> Iterator[None]:
    """Say on stderr that there is a choice, where texts are refused and `is_open`: nobody has chosen."""
    from chronicles.errors import ChronicleError

    try:
        yield
    except ChronicleError:
        if is_open:
            tell("note", ["--stream traffic takes texts with DyKnow's relations, --stream own without them"])
        raise
