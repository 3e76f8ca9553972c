"""What is said about texts as people who know other languages write them.

The messages are kept in `golden/messages.txt`; rewrite it with UPDATE_GOLDEN=1 and read the difference.
"""

import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from dyknow.errors import FormulaError
from dyknow.mtl.parser import parse_formula, parse_monitors

GOLDEN = Path(__file__).parent / "golden" / "messages.txt"


def texts() -> Iterator[tuple[str, str]]:
    """Give each text of the golden file, with the heading that it stands under."""
    heading = ""
    for line in GOLDEN.read_text(encoding="utf-8").split("\n"):
        if line.startswith("# "):
            heading = line
        elif line.startswith("> "):
            yield heading, line[2:]


def error_of(heading: str, text: str) -> FormulaError:
    try:
        if heading == "# monitors":
            parse_monitors(text)
        else:
            parse_formula(text, variables=["a", "c"])
    except FormulaError as error:
        return error
    pytest.fail(f"{text!r} was read")


def written() -> str:
    """Write all texts again, each with what is said about it now."""
    blocks: list[str] = []
    previous = ""
    for heading, text in texts():
        if heading != previous:
            blocks.append(heading)
            previous = heading
        lines = [f"> {text}"]
        for one in error_of(heading, text).diagnostics:
            caret = " " * (one.column - 1) + "^" * (one.end_column - one.column)
            lines += [f"  {caret}", f"  {one.code} {one.message}", *([f"  = {one.hint}"] if one.hint else [])]
        blocks.append("\n".join(lines))
    return "\n\n".join(blocks) + "\n"


def test_messages_are_as_they_were() -> None:
    found = written()
    if os.environ.get("UPDATE_GOLDEN"):
        GOLDEN.write_text(found, encoding="utf-8")
    assert found == GOLDEN.read_text(encoding="utf-8")


def test_messages_speak_of_what_the_user_types() -> None:
    """No name from inside the grammar: capitals, underscores, or a sign that is called by its name."""
    inside = re.compile(
        r"[A-Z]{3,}|__|'[a-z]+_[a-z]+'|'(?:at_most|more|less|equal|different|plus|star|lpar|rsqb|colon)'"
    )
    count = 0
    for heading, text in texts():
        for one in error_of(heading, text).diagnostics:
            count += 1
            message = one.message.replace(repr(text), "")
            said = re.sub(r"(got|after) '[^']*'", "", message)
            assert not inside.search(said), (text, one.message)
            assert re.match(r"expected .+, got .+", one.message), one.message
            assert 1 <= one.column < one.end_column <= len(text) + 2
    assert count >= 120
