"""What does the code of a finding mean, and how is such a text mended?

`diagnostics.md` has a section for each code: what is wrong, a wrong text and a mended one.
"""

import re
from dataclasses import dataclass
from importlib.resources import files

from chronicles.errors import ChronicleError

_SECTION = re.compile(
    r"^## (?P<code>C\d{4}): (?P<title>.*?)(?P<warning> \(warning\))?\n(?P<meaning>.*?)\n\n"
    r"Wrong:\n```chronicle\n(?P<wrong>.*?)```\nMended:\n```chronicle\n(?P<mended>.*?)```$",
    re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True, slots=True)
class Code:
    """A kind of finding: a short title, what it means, a text that has it, and the text without it."""

    code: str
    title: str
    is_warning: bool
    meaning: str
    wrong: str
    mended: str


def page() -> str:
    """Give the page that explains all codes, in Markdown."""
    return files("chronicles.language").joinpath("diagnostics.md").read_text(encoding="utf-8")


def all_codes() -> tuple[Code, ...]:
    """List all kinds of findings in the order of their codes."""
    return tuple(
        Code(one["code"], one["title"], one["warning"] is not None, one["meaning"], one["wrong"], one["mended"])
        for one in _SECTION.finditer(page())
    )


def explain_code(code: str) -> str:
    """Explain a code, with a wrong and a mended text.

    Raises
    ------
    ChronicleError
        If there is no such code.

    Examples
    --------
    >>> print(explain_code("C0404"))
    C0404: a time point against itself
    A time constraint is about two time points.
    <BLANKLINE>
    Wrong:
      chronicle visit(t1, t2) { event(enter[], t1) event(leave[], t2) t2 - t2 in [1s, 5s] t2 - t1 in [1s, 5s] }
    Mended:
      chronicle visit(t1, t2) { event(enter[], t1) event(leave[], t2) t2 - t1 in [1s, 5s] }
    """
    for one in all_codes():
        if one.code == code.upper():
            wrong, mended = ("\n".join(f"  {line}" for line in text.splitlines()) for text in (one.wrong, one.mended))
            kind = " (warning)" if one.is_warning else ""
            return f"{one.code}: {one.title}{kind}\n{one.meaning}\n\nWrong:\n{wrong}\nMended:\n{mended}"
    known = ", ".join(one.code for one in all_codes())
    raise ChronicleError(f"diagnostics: expected one of the codes {known}, got {code!r}")
