"""How does a formula become the condition of a link? A DyKnow progressor is asked state by state."""

from collections.abc import Mapping, Sequence
from functools import partial

from anchoring.hypotheses.conditions import Maker, Verdict
from anchoring.hypotheses.language import FLUENTS, LinkageText, read_linkage
from anchoring.settings import AnchoringSettings
from dyknow.language.words import Source, Word
from dyknow.mtl.formula import Formula
from dyknow.mtl.kinds import Signature
from dyknow.mtl.parser import read_formula
from dyknow.mtl.progression.progressor import Progressor
from dyknow.mtl.progression.shared_work import SharedWork
from dyknow.mtl.progression.states import DictState

_SIGNATURE = Signature(dict.fromkeys(FLUENTS, 0))


def load_linkage(text: str, settings: AnchoringSettings, *, name: str = "linkage") -> LinkageText:
    """Read a linkage text with formulas of any shape; see `read_linkage`.

    Raises
    ------
    LinkageError
        If the text is malformed or means nothing.

    Examples
    --------
    >>> from anchoring.hypotheses.language import default_text
    >>> mine = default_text().replace("visible and fits;", "eventually[0, 1s] (visible and fits);")
    >>> condition = load_linkage(mine, AnchoringSettings()).linkages[0].reestablish()
    >>> [condition.progress(t_us, dict.fromkeys(FLUENTS, t_us > 0)).value for t_us in (0, 900_000)]
    ['unknown', 'true']
    """
    return read_linkage(text, settings, name=name, read_formula=_condition_of)


def _condition_of(words: Sequence[Word], source: Source, *, is_lasting: bool) -> Maker | None:
    formula = read_formula(words, source, signature=_SIGNATURE)
    return None if formula is None else partial(Progressed, formula, SharedWork(), is_lasting=is_lasting)


class Progressed:
    """Ask a progressor; see `Condition` for when a formula that is not to be maintained (lasting) starts anew."""

    __slots__ = ("_fresh", "_is_lasting", "_progressor", "_verdict", "is_idle")

    def __init__(self, formula: Formula, shared: SharedWork, *, is_lasting: bool) -> None:
        self._fresh = partial(Progressor, formula, shared=shared)
        self._is_lasting = is_lasting
        self._progressor = self._fresh()
        self._verdict = Verdict.UNKNOWN
        self.is_idle = False  # until the first state

    def progress(self, t_us: int, state: Mapping[str, bool]) -> Verdict:
        """Take the next state."""
        now, before = DictState(state), self._verdict
        if self._is_lasting or before is not Verdict.TRUE:
            self._verdict = Verdict(self._progressor.progress(t_us, now).value)
            self.is_idle = self._progressor.is_idle
            if self._is_lasting or self._verdict is Verdict.UNKNOWN:
                return self._verdict
        fails_alone = self._fresh().progress(t_us, now).value == "false"
        self.is_idle = not fails_alone
        if self._verdict is Verdict.FALSE or (before is Verdict.TRUE and fails_alone):
            self._progressor, self._verdict, self.is_idle = self._fresh(), Verdict.UNKNOWN, fails_alone
        return self._verdict
