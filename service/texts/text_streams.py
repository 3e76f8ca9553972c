"""Which events do chronicle texts speak about: DyKnow's relations, or events of their own?

Texts for traffic look at the relations without declaring them, so the declarations are put before them. Texts for a
file of other events bring their own, which may use the same names for other things.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from typing import Literal

from chronicles import library
from chronicles.language import model
from chronicles.language.parser import parse
from dyknow.language.diagnostics import Reporter

Stream = Literal["traffic", "own"]

NEARLY = 0.85  # "clse" for "close", but not "light" for "right"


def stream_of(texts: Sequence[tuple[str, str]]) -> Stream:
    """Tell which stream texts (name, text) are about.

    They are about "traffic" if they use a name of the relations' file that they do not declare, or nearly one, or an
    event of the library: texts without declarations may use any name, and a slip of the pen would pass unseen.

    Examples
    --------
    >>> stream_of([("mine", "chronicle a[?x](t1) { event(moving[?x]:(false, true), t1) }")])
    'traffic'
    >>> stream_of([("mine", "attribute moving[?x] chronicle a[?x](t1) { event(moving[?x]:(false, true), t1) }")])
    'own'
    """
    used, declared = _names(texts)
    given = _names([("", library.relations_text())])[1]
    is_traffic = any(get_close_matches(name, given, n=1, cutoff=NEARLY) for name in used - declared)
    return "traffic" if is_traffic or library_events(texts) else "own"


def library_events(
    texts: Sequence[tuple[str, str]], *, nearly: float = 1.0, monitored: Collection[str] = ()
) -> list[str]:
    """Name the events of the library that texts (name, text) use without declaring them.

    Parameters
    ----------
    monitored : names that monitors use besides.
    nearly : how like a name may be that is none of the library, and is meant to be one; 1 for the very names.

    Examples
    --------
    >>> texts = [("mine", "chronicle a[?x](t1) { event(overtak[?x, ?, ?], t1) }")]
    >>> library_events(texts), library_events(texts, nearly=NEARLY)
    ([], ['overtake'])
    """
    used, declared = _names(texts)
    found = (get_close_matches(name, library.names(), n=1, cutoff=nearly) for name in used.union(monitored) - declared)
    return sorted({name for names in found for name in names})


def _names(texts: Sequence[tuple[str, str]]) -> tuple[set[str], set[str]]:
    """Give the names of events, attributes and domains that texts use, and of those that they declare or define."""
    reporter = Reporter(dict(texts))
    declarations = [one for name, text in texts for one in parse(text, name, reporter).declarations]
    named = model.Domain | model.Attribute | model.Message | model.Chronicle
    declared = {one.name for one in declarations if isinstance(one, named)}
    return set(_looked_at(declarations)), declared


def _looked_at(declarations: Sequence[model.Declaration]) -> Iterator[str]:
    pending: list[object] = list(declarations)
    while pending:
        node = pending.pop()
        if isinstance(node, model.Pattern | model.DomainName):
            yield node.name
        if isinstance(node, tuple):
            pending += node
        elif is_dataclass(node):
            pending += [getattr(node, field.name) for field in fields(node)]
