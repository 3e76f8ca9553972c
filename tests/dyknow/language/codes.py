"""The codes that the shared reading of texts gives to what it finds, in every language."""

import re
from pathlib import Path

import dyknow.language

SOURCES = Path(dyknow.language.__file__).parent


def shared_codes(letter: str) -> set[str]:
    """Give the codes of strange characters and misfits, with the letter of a language."""
    text = "".join(path.read_text("utf-8") for path in SOURCES.glob("*.py"))
    return {letter + number for number in re.findall(r"letter\}(\d{4})", text)}
