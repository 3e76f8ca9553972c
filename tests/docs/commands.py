"""Which `dyknow` commands do the README and the pages show, and what of such a line is ours?"""

import re
import shlex
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import typer.main

from service.cli.app import make_app

ROOT = Path(__file__).parents[2]
README = ROOT / "README.md"
PAGES = (README, ROOT / "ARCHITECTURE.md", *sorted((ROOT / "docs").glob("*.md")))

_SHELL = re.compile(r"\s(?:#|\||>|&|&&)(?:\s.*)?$")


@dataclass(frozen=True, slots=True)
class Command:
    """A command as a page shows it: where, and the words after `dyknow`."""

    place: str
    words: tuple[str, ...]


def block_commands(path: Path) -> list[Command]:
    """List the commands in blocks, which can be pasted into a shell."""
    text = re.sub(r"\\\n\s*", "", path.read_text(encoding="utf-8"))
    found = re.finditer(r"^(?: {4}|\$ )?dyknow ([a-z-]+\b.*)$", text, re.MULTILINE)
    return [Command(_place(path, text, one), split(one[1])) for one in found]


def sentence_commands(path: Path) -> list[Command]:
    """List the commands inside sentences and tables."""
    text = path.read_text(encoding="utf-8")
    found = re.finditer(r"`dyknow\s+([a-z-]+\b[^`]*)`", text)
    return [Command(_place(path, text, one), split(one[1])) for one in found]


def program() -> Any:  # Any: typer brings its own copy of click, without types
    """Give `dyknow` itself, with the options before the command."""
    return typer.main.get_command(make_app())


@cache
def all_commands() -> dict[str, Any]:  # Any: as above
    """Give the commands by their names, those of groups with two words."""
    found = {}
    for name, one in program().commands.items():
        inner = getattr(one, "commands", None)
        found.update({name: one} if inner is None else {f"{name} {word}": two for word, two in inner.items()})
    return found


def refusal(words: tuple[str, ...], *, is_whole: bool = True) -> str:
    """Parse a command line without running it; say what is wrong with it, in a word or two.

    Parameters
    ----------
    is_whole : a command in a sentence may leave out what the sentence is not about.
    """
    commands = all_commands()
    groups = {name.split()[0] for name in commands if " " in name}
    count = 2 if words[0] in groups else 1
    name, arguments = " ".join(words[:count]), list(words[count:])
    if name not in commands:
        return f"no command {name!r}"
    if not is_whole:
        arguments = [one for one in arguments if one != "..."]
        arguments += ["WORD"] if arguments and arguments[-1].startswith("--") else []
    try:
        commands[name].make_context(name, arguments).close()
    except Exception as error:
        if not is_whole and type(error).__name__ == "MissingParameter":
            return ""
        return getattr(error, "message", None) or str(error)
    return ""


def fenced(path: Path, language: str) -> list[str]:
    """Give the texts of the blocks of a language; "" is that of blocks which name none."""
    blocks = re.findall(r"^```(\w*)\n(.*?)^```$", path.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    return [text for word, text in blocks if word == language]


def split(line: str) -> tuple[str, ...]:
    """Split a command as a shell does, without what the shell keeps for itself.

    Examples
    --------
    >>> split("events a.db --format csv > events.csv"), split("serve a.db &"), split("check a.chronicle  # first")
    (('events', 'a.db', '--format', 'csv'), ('serve', 'a.db'), ('check', 'a.chronicle'))
    """
    return tuple(shlex.split(_SHELL.sub("", line.replace("\n", " "))))


def _place(path: Path, text: str, found: re.Match[str]) -> str:
    line = text.count("\n", 0, found.start()) + 1
    return f"{path.name}:{line}"
