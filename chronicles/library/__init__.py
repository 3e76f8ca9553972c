"""Which chronicles come with the package?

Each file `NAME.chronicle` here defines the chronicle NAME, or several that all emit the event NAME, and says in its
head what that means; `relations.chronicle` declares the attributes that all of them look at.
"""

import re
from collections.abc import Sequence
from importlib.resources import files

from chronicles.chronicle_set import ChronicleSet, load_texts
from chronicles.errors import ChronicleError

_SUFFIX = ".chronicle"
_RELATIONS = "relations"
_EVENT = re.compile(r"\bevent\((\w+)")


def names() -> tuple[str, ...]:
    """List what the library finds: the events that its chronicles emit.

    Examples
    --------
    >>> len(names()), names()[:3]
    (16, ('aborted_overtake', 'crossing', 'cut_in'))
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

    Chronicles that the chosen ones build on come with them.

    Raises
    ------
    ChronicleError
        If there is no such chronicle.

    Examples
    --------
    >>> [name for name, _ in texts(["reckless_overtake"])]
    ['relations.chronicle', 'reckless_overtake.chronicle', 'overtake.chronicle']
    """
    pending = list(names() if chosen is None else chosen)
    found = {_RELATIONS: relations_text()}
    while pending:
        name = pending.pop(0)
        if name not in found:
            found[name] = text(name)
            pending += [used for used in _EVENT.findall(found[name]) if used in names()]
    return [(name + _SUFFIX, one) for name, one in found.items()]


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
