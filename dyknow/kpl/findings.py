"""How does a KPL text that is wrong come back to its author? As an error that lists everything found."""

from __future__ import annotations

from dyknow.language.diagnostics import Diagnostic, TextError

_MOST_SHOWN = 50
_LONGEST_WORD = 60


class KplError(TextError):
    """A KPL text that cannot be used; `diagnostics` lists every error, the message shows the first fifty."""

    def __init__(self, diagnostics: tuple[Diagnostic, ...]) -> None:
        super().__init__(diagnostics[:_MOST_SHOWN])
        self.diagnostics = diagnostics
        if len(diagnostics) > _MOST_SHOWN:
            self.args = (f"{self.args[0]}\n\nand {len(diagnostics) - _MOST_SHOWN} more errors",)


def normalised(text: str) -> str:
    r"""Take what editors add out of a text: a byte order mark at its start, and foreign ends of lines.

    Examples
    --------
    >>> normalised("\ufeffsort A;\r\nsort B;\rsort C;")
    'sort A;\nsort B;\nsort C;'
    """
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")


def shown(word: str) -> str:
    """Write a word of a text in quotes, shortened where no reader would want all of it.

    Examples
    --------
    >>> shown("speed"), len(shown("9" * 1000))
    ("'speed'", 62)
    """
    return repr(word if len(word) <= _LONGEST_WORD else f"{word[: _LONGEST_WORD - 3]}...")
