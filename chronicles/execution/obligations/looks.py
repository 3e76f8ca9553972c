"""Is a `hold` or an `assert` true of the past, and which variables does it give a value?"""

from chronicles.compilation.names.symbols import UNKNOWN
from chronicles.compilation.plan import Persistence
from chronicles.execution.obligations.history import AttributeHistory

Values = tuple[str, ...]
Way = tuple[Values, Values]  # the values of all slots, and the hypotheses that they rest on


class Look:
    """Looks back at what one statement is about; where its known arguments stand is worked out once.

    Attributes
    ----------
    one : the statement.
    is_check : whether all that it is about is known beforehand; then it is asked whether `is_right`.
    """

    __slots__ = ("_history", "_known", "_places", "is_check", "one")

    def __init__(self, one: Persistence, history: AttributeHistory) -> None:
        known = sorted([(at, -1, text) for at, text in one.constants] + [(at, slot, "") for at, slot in one.bound])
        self.one = one
        self._history = history
        self._known = tuple([(slot, text) for _, slot, text in known])
        self._places = tuple([at for at, _, _ in known])
        self.is_check = one.is_complete and one.value_binds < 0
        if not one.is_complete:
            history.index_by(one.attribute, self._places)

    def is_right(self, values: Values, start_us: int, end_us: int) -> bool:
        """Say whether a statement with all arguments known is true in [start, end); an empty `assert` is."""
        one, args = self.one, self.arguments(values)
        if one.is_assumed:
            wanted = one.value if one.value_slot < 0 else values[one.value_slot]
            found = self._history.values_within(one.attribute, args, start_us, end_us)
            return start_us >= end_us or all(value in (wanted, UNKNOWN) for value, _ in found)
        value = self._value(args, start_us, end_us)
        return value is not None and _fits(one, value, values)

    def longer(self, way: Way, start_us: int, end_us: int) -> list[Way]:
        """Extend values, and the hypotheses they rest on, by each way to make the statement true in [start, end)."""
        one, (values, labels) = self.one, way
        found: list[Way] = []
        for args in self._candidates(values):
            value = self._value(args, start_us, end_us)
            if value is None or any(args[first] != args[second] for first, second in one.equal):
                continue
            extended = _bind(one, args, value, values)
            if _fits(one, value, extended) and _is_allowed(one, extended):
                found.append((extended, labels + self.labels(args, start_us, end_us)))
        return found

    def arguments(self, values: Values) -> Values:
        """Give the known arguments, in their order."""
        return tuple([text if slot < 0 else values[slot] for slot, text in self._known])

    def labels(self, args: Values, start_us: int, end_us: int) -> Values:
        """List the hypotheses of the changes that brought the value; what is unknown is evidence for no assert."""
        if start_us >= end_us:
            return ()
        one = self.one
        return self._history.hypotheses_within(one.attribute, args, start_us, end_us, of_known=one.is_assumed)

    def _candidates(self, values: Values) -> list[Values]:
        one, known = self.one, self.arguments(values)
        found = (known,) if one.is_complete else self._history.matching(one.attribute, self._places, known)
        return [args for args in found if len(args) == one.arity]

    def _value(self, args: Values, start_us: int, end_us: int) -> str | None:
        one = self.one
        if one.needs_report and not self._history.is_reported(one.attribute, args, start_us):
            return None
        return self._history.value_throughout(one.attribute, args, start_us, end_us)


def _bind(one: Persistence, args: Values, value: str, values: Values) -> Values:
    extended = list(values)
    for place, slot in one.binds:
        extended[slot] = args[place]
    if one.value_binds >= 0:
        extended[one.value_binds] = value
    return tuple(extended)


def _fits(one: Persistence, value: str, values: Values) -> bool:
    """Say whether the value is the wanted one."""
    if one.needs_known and value == UNKNOWN:
        return False
    if one.value is not None:
        return value == one.value
    return one.value_slot < 0 or value == values[one.value_slot]


def _is_allowed(one: Persistence, values: Values) -> bool:
    return all(values[slot] in allowed for slot, allowed in one.filters) and all(
        values[slot] != values[other] for slot, other in one.different
    )
