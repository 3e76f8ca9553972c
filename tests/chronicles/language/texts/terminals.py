"""The names that the grammar gives to kinds of words, which no message may show."""

import re
from importlib.resources import files

_GRAMMAR = files("chronicles.language").joinpath("chronicle.lark").read_text(encoding="utf-8")
TERMINAL_NAMES = frozenset(re.findall(r"^(_?[A-Z][A-Z_]+)(?:\.\d)?\s*:", _GRAMMAR, re.MULTILINE)) | {
    "LPAR",
    "RPAR",
    "LBRACE",
    "RBRACE",
    "LSQB",
    "RSQB",
    "COMMA",
    "COLON",
    "SEMICOLON",
    "QMARK",
    "VBAR",
    "TILDE",
    "END",
}
