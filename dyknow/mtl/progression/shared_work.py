"""What do progressors have in common? Work done for one of them serves the others."""

from dyknow.mtl.progression.automaton import Automaton, automaton_of
from dyknow.mtl.progression.residual import Moment
from dyknow.mtl.progression.states import State
from dyknow.mtl.progression.table import FormulaTable
from dyknow.mtl.progression.templates import Template, TemplateMaker


class SharedWork:
    """Equal obligations, what was asked of the present state, and the steps that came before.

    Parameters
    ----------
    remembers : whether steps are remembered in automata; without, every state is progressed. The verdicts are the
        same, so this serves comparisons.
    least_kept : how many residuals the table always remembers.
    """

    def __init__(self, *, remembers: bool = True, least_kept: int = 10_000) -> None:
        self.table = FormulaTable(least_kept)
        self.templates = TemplateMaker()
        self._automata: dict[Template, Automaton | None] = {}
        self._remembers = remembers
        self._moment: Moment | None = None

    def automaton(self, template: Template) -> Automaton | None:
        """Give the automaton of a formula, which all its progressors fill; None if it has none."""
        if self._remembers and template not in self._automata:
            self._automata[template] = automaton_of(template)
        return self._automata.get(template)

    def moment(self, t_us: int, state: State) -> Moment:
        """Give the memory of one state, the same for all who come with the same time and the same state object."""
        moment = self._moment
        if moment is None or moment.t_us != t_us or moment.state is not state:
            self.table.forget_if_full()
            moment = self._moment = Moment(t_us, state)
        return moment
