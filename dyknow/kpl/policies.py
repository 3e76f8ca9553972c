"""Which `Policy` do the constraints of a KPL text make, and can it ever deliver a sample?

At most one constraint of each family may be written; the others have their defaults: `any update, no approximation, max
delay oo, from now to oo, any order`.
"""

from collections.abc import Sequence

from dyknow.errors import KplError
from dyknow.kpl.model import Constraint, ConstraintKind
from dyknow.kpl.parser import open_constraints
from dyknow.language.diagnostics import Reporter
from dyknow.language.durations import format_duration
from dyknow.policies.policy import AnyChange, AnyUpdate, Approximation, Cause, Order, Policy, SampleEvery


def parse_policy(text: str, *, name: str = "policy") -> Policy:
    """Read a policy in the words of KPL, such as ``str(policy)`` writes.

    Raises
    ------
    KplError
        If the text is malformed or contradicts itself.

    Examples
    --------
    >>> parse_policy("any change, max delay 2s")
    Policy(cause=AnyChange(), approximation=<Approximation.NONE: 'no approximation'>, max_delay_us=2000000,
           from_us=None, to_us=None, oldest_us=None, order=<Order.ANY: 'any order'>)
    """
    constraints, reporter = open_constraints(text, name)
    check_policy(constraints, reporter)
    reporter.raise_if_any(KplError)
    return policy_of(constraints)


def policy_of(constraints: Sequence[Constraint]) -> Policy:
    """Make a policy of constraints that `check_policy` finds nothing in.

    Examples
    --------
    >>> str(policy_of([Constraint(ConstraintKind.STRICT_ORDER), Constraint(ConstraintKind.MAX_DELAY, 2_000)]))
    'any update, max delay 2ms, strict order'
    """
    written = _by_family(constraints)
    return Policy(
        _cause(written.get("cause")),
        Approximation(written["approximation"].kind.value) if "approximation" in written else Approximation.NONE,
        max_delay_us=_us(written.get("max delay")),
        from_us=_us(written.get("from")),
        to_us=_us(written.get("to")),
        oldest_us=_us(written.get("oldest")),
        order=Order(written["order"].kind.value) if "order" in written else Order.ANY,
    )


def check_policy(constraints: Sequence[Constraint], reporter: Reporter) -> None:
    """Report constraints that exclude each other, and policies under which no sample could ever be delivered.

    Examples
    --------
    >>> constraints, reporter = open_constraints("sample every 1ms", "policy")
    >>> check_policy(constraints, reporter)
    >>> [found.code for found in reporter.diagnostics]
    ['K0404']
    """
    first = _by_family(constraints)
    for constraint in constraints:
        earlier = first[constraint.kind.family]
        if earlier is not constraint:
            message = (
                f"expected one constraint of each kind, got {constraint.kind.value!r} besides {earlier.kind.value!r}"
            )
            reporter.error("K0401", message, constraint.span, related=[(earlier.span, "the first")])
    _check_limits(first, reporter)
    cause = first.get("cause")
    if cause is not None and cause.kind is ConstraintKind.SAMPLE_EVERY:
        _check_sampling(cause, first, reporter)


def _check_limits(written: dict[str, Constraint], reporter: Reporter) -> None:
    from_us, to_us = _us(written.get("from")), _us(written.get("to"))
    if from_us is not None and to_us is not None and from_us > to_us:
        message = (
            f"expected an end that is not before the start {format_duration(from_us)}, got {format_duration(to_us)}"
        )
        reporter.error("K0405", message, written["to"].span, related=[(written["from"].span, "the start")])


def _check_sampling(cause: Constraint, written: dict[str, Constraint], reporter: Reporter) -> None:
    delay = written.get("max delay")
    order = written.get("order")
    if not cause.us:
        reporter.error("K0402", "expected a period longer than 0s, got 0s", cause.span)
    if (delay is None or delay.us is None) and (order is None or order.kind is ConstraintKind.ANY_ORDER):
        message = "expected 'max delay' or an order, or no sampled value is ever settled, got neither"
        reporter.error("K0404", message, cause.span, "add 'strict order', or a delay such as 'max delay 400ms'")


def _by_family(constraints: Sequence[Constraint]) -> dict[str, Constraint]:
    """Give the first constraint of each family."""
    return {constraint.kind.family: constraint for constraint in reversed(constraints)}


def _cause(written: Constraint | None) -> Cause:
    if written is None or written.kind is ConstraintKind.ANY_UPDATE:
        return AnyUpdate()
    return SampleEvery(written.us or 0) if written.kind is ConstraintKind.SAMPLE_EVERY else AnyChange()


def _us(written: Constraint | None) -> int | None:
    return None if written is None else written.us
