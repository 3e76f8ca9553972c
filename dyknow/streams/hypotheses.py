"""Which hypotheses does what is told at one time rest on, and what has become of those of earlier times?"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Hypotheses:
    """Hold labels of hypotheses, each used once.

    Attributes
    ----------
    about : of each object, those by which it is the object it is, and that are not known to be right; objects without
        such are left out.
    absences : of each object that is hidden, the one that it does not come back.
    opened : those by which something may still turn out to have happened, and from when on, microseconds.
    validated, refuted : those that are decided now.
    undecided : those that nobody will ever decide.

    Examples
    --------
    >>> known = Hypotheses({"b": ("v2->b#7",), "c": ("v3->c#8",)}, absences={"a": "a lost#9"})
    >>> known.of(("a", "b"), absent=("a",))
    ('v2->b#7', 'a lost#9')
    """

    about: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    absences: Mapping[str, str] = field(default_factory=dict)
    opened: tuple[tuple[str, int], ...] = ()
    validated: tuple[str, ...] = ()
    refuted: tuple[str, ...] = ()
    undecided: tuple[str, ...] = ()

    def of(self, objects: Iterable[str], absent: Iterable[str] = ()) -> tuple[str, ...]:
        """Give those that what is told of some objects rests on, some of which are absent."""
        labels: tuple[str, ...] = ()
        for one in objects if self.about else ():
            labels += self.about.get(one, ())
        for one in absent:
            labels += (self.absences[one],)
        return labels
