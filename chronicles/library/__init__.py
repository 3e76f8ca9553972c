"""Which chronicles come with the package?

Each file `NAME.chronicle` here defines the chronicle NAME; `relations.chronicle` declares the attributes that all of
them look at.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files

from chronicles.chronicle_set import ChronicleSet, load_texts
from chronicles.errors import ChronicleError

_SUFFIX = ".chronicle"
_RELATIONS = "relations"


def names() -> tuple[str, ...]:
    """List the chronicles of the library.

    Examples
    --------
    >>> names()
    ('aborted_overtake', 'crossing', 'overtake', 'pass')
    """
    found = (entry.name for entry in files("chronicles.library").iterdir() if entry.name.endswith(_SUFFIX))
    return tuple(sorted({name.removesuffix(_SUFFIX) for name in found} - {_RELATIONS}))


def text(name: str) -> str:
    """Give the text of one chronicle, without the attributes it looks at.

    Raises
    ------
    ChronicleError
        If there is no such chronicle.
    """
    if name not in names():
        raise ChronicleError(f"chronicle library: expected one of {list(names())}, got {name!r}")
    return _read(name)


def relations_text() -> str:
    """Give the declarations of the attributes that the library looks at.

    A text of one's own may be loaded after it: ``load_texts([("relations", relations_text()), ("mine", mine)])``.
    """
    return _read(_RELATIONS)


def texts(chosen: Sequence[str] | None = None) -> list[tuple[str, str]]:
    """Give (file name, text) of the relations and of the chosen chronicles, all without a choice.

    Raises
    ------
    ChronicleError
        If there is no such chronicle.
    """
    picked = names() if chosen is None else chosen
    return [(_RELATIONS + _SUFFIX, relations_text()), *((name + _SUFFIX, text(name)) for name in picked)]


def load_library(chosen: Sequence[str] | None = None) -> ChronicleSet:
    """Load chronicles of the library, all without a choice.

    Raises
    ------
    ChronicleError
        If there is no such chronicle.

    Examples
    --------
    >>> [role for role, _ in load_library(["overtake"]).plan("overtake").roles]
    ['overtaker', 'overtaken', 'road']
    """
    return load_texts(texts(chosen))


def _read(name: str) -> str:
    return files("chronicles.library").joinpath(name + _SUFFIX).read_text(encoding="utf-8")
