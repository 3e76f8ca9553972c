"""How does a result leave `dyknow`? As a table, as one JSON object, as a file, and as an exit code.

A table has plain columns, two blanks apart, as wide as their widest cell: no frames, no colours, nothing cut off.
Scripts rely on the exit codes; docs/cli.md lists them.
"""

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import typer

from service.errors import InputError

if TYPE_CHECKING:
    from vision.objects import ByteArray

OK: Final = 0
INTERNAL: Final = 1  # a fault of ours
BROKEN: Final = 1  # of `doctor`, which would also say 1 if it failed itself
USAGE: Final = 2  # the command line itself is wrong
INVALID: Final = 3  # a file, chronicle or log is wrong
NOTHING_FOUND: Final = 4  # only with --fail-empty
BELOW_THRESHOLD: Final = 5  # an evaluation below the wanted score, or an example that fails
BUSY: Final = 6  # another process is writing the same run
SIGNALLED: Final = 128  # and the number of the signal, as shells have it
INTERRUPTED: Final = 130  # by Ctrl-C


def format_table(titles: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Lay out rows under titles; the text ends with a newline.

    Examples
    --------
    >>> print(format_table(["type", "road"], [["overtake", "road1"], ["pass", ""]]), end="")
    type      road
    overtake  road1
    pass
    """
    lines = [titles, *rows]
    widths = [max(len(line[column]) for line in lines) for column in range(len(titles))]
    padded = ("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) for line in lines)
    return "".join(f"{line.rstrip()}\n" for line in padded)


def check_target(out: Path, *read: Path | None) -> None:
    """Refuse to write where nothing can be written, or over what is read, by whatever name it goes.

    Raises
    ------
    InputError
        If `out` is one of the files that are read, a folder, or in one that is not there.
    """
    if out.exists() and any(one is not None and one.exists() and out.samefile(one) for one in read):
        raise InputError(f"{out}: expected a new file, got one that is being read")
    if not out.parent.is_dir() or out.is_dir():
        raise InputError(f"{out}: expected a file in an existing folder, got another path")


def write_picture(path: Path, picture: "ByteArray") -> None:
    """Write a picture.

    Raises
    ------
    InputError
        If the name is not that of a picture, or it cannot be written.
    """
    import cv2

    if path.suffix.lower() not in (".png", ".jpg"):
        raise InputError(f"{path}: expected a path ending in .png or .jpg")
    if not cv2.imwrite(str(path), picture):
        raise InputError(f"{path}: expected a path that can be written, got a refusal")


def print_json(record: object) -> None:
    """Print one JSON object: plain data, structs or dataclasses."""
    import msgspec

    print(msgspec.json.encode(record).decode(), flush=True)


def show(record: object, text: str, *, as_json: bool) -> None:
    """Print a result: its record as one JSON object, or its text."""
    if as_json:
        print_json(record)
    else:
        print(text.removesuffix("\n"))


def print_json_list(name: str, items: Iterable[str], **rest: object) -> None:
    """Print one JSON object with a list of JSON texts, one by one, and other fields before it.

    Examples
    --------
    >>> print_json_list("cars", ['{"id":1}', '{"id":2}'], run="r1")
    {"run":"r1","cars":[{"id":1},{"id":2}]}
    """
    import msgspec

    fields = [f'"{key}":{msgspec.json.encode(value).decode()},' for key, value in rest.items()]
    sys.stdout.write(f'{{{"".join(fields)}"{name}":[')
    before = ""
    for item in items:
        sys.stdout.write(before + item)
        before = ","
    sys.stdout.write("]}\n")


def write_blocks(blocks: Iterable[str] | Iterable[bytes]) -> None:
    """Write a file to stdout; raises a `BadParameter` where what is not text would go to a terminal."""
    for block in blocks:
        if isinstance(block, str):
            sys.stdout.write(block)
        elif sys.stdout.isatty():
            raise typer.BadParameter("expected a file to write into (> FILE), got a terminal", param_hint="--format")
        else:
            sys.stdout.buffer.write(block)


def tell(kind: str, texts: Iterable[str]) -> None:
    """Print lines on stderr under a kind such as `warning`; diagnostics begin with a kind of their own."""
    for text in texts:
        print(text if text.startswith(f"{kind}[") else f"{kind}: {text}", file=sys.stderr)


def counted(count: int, noun: str) -> str:
    """Write a number of things.

    Examples
    --------
    >>> counted(1, "error"), counted(2, "error")
    ('1 error', '2 errors')
    """
    return f"{count} {noun}{'' if count == 1 else 's'}"


def shown_roles(roles: Iterable[tuple[str, str]]) -> str:
    """Write roles for a table."""
    return " ".join(f"{role}={value}" for role, value in roles)
