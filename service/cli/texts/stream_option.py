"""How does a user say which events chronicle texts are about, and how is a user told what was taken for granted?"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from service.texts.text_streams import Stream


class StreamChoice(StrEnum):
    """What chronicle texts are about."""

    traffic = "traffic"
    own = "own"


# Codes of findings that may only mean that the texts are about other events than was thought.
STREAM_CODES = frozenset({"C0201", "C0203", "C0301", "C0302", "C0901"})

StreamOption = Annotated[
    StreamChoice | None,
    typer.Option(
        "--stream", help="The texts are about DyKnow's relations (traffic) or their own events. Default: as they say."
    ),
]


def tell_stream(stream: "Stream", *, is_doubtful: bool) -> None:
    """Say on stderr what texts were taken to be about, where another choice may have been meant."""
    if stream == "own":
        said = "taken as texts about their own events; --stream traffic takes them with DyKnow's relations"
    elif is_doubtful:
        said = "taken with DyKnow's relations; --stream own takes them as texts about their own events"
    else:
        return
    print(f"note: {said}", file=sys.stderr)


@contextmanager
def hinting_at_stream(*, is_open: bool) -> Iterator[None]:
    """Say on stderr that there is a choice, where texts are refused and `is_open`: nobody has chosen."""
    from chronicles.errors import ChronicleError

    try:
        yield
    except ChronicleError:
        if is_open:
            print(
                "note: --stream traffic takes texts with DyKnow's relations, --stream own without them", file=sys.stderr
            )
        raise
