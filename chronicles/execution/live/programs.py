"""What does the program look like that extends the instances of a chronicle by an event?

Two kinds of small Python functions are written for it, with tests, windows and the places of values as constants in
them: several times as fast as loops over tables, and readable, see `EagerExecutor.source`.

* ``read`` turns an event that fits a pattern into the row of an instance that has only this event.
* ``extend`` takes such a row, and the rows that wait for it, and makes the rows of the extended instances, or, with the
  last event, the instances in the form of `Layout`.

The row of a state holds, for each matched position in ascending order, the time ``t`` and the held event ``h``
(`instances`), then the values ``s`` of the known slots; the numbers in these names are those of positions and slots.
"""

from collections.abc import Callable, Sequence

from chronicles.compilation.plan import EventTest, Plan
from chronicles.compilation.steps import Step, known_slots, members
from chronicles.compilation.times.network import UNBOUNDED_US
from chronicles.execution.event_tests import Code, field_text, fit_code, tuple_text
from chronicles.execution.instances import Record, says_everything

_HELD_WHOLE = "(sequence, args, event.old, event.new, event.hypotheses, event.confidence)"  # as `instances.Held` has it


# ---- events


def read_code(test: EventTest) -> Code:
    """Write the function that gives the row of a record that fits, and None if it does not fit."""
    lines, names = fit_code(test)
    held = _HELD_WHOLE
    if says_everything(test):
        # Where `old` or `new` is missing the row has UNKNOWN, from which it cannot be told afterwards.
        is_plain = "event.old and event.new" if test.is_change else "event.old is None"
        held = f"sequence if {is_plain} and not event.hypotheses and event.confidence == 1 else {held}"
    lines.append(f"return {tuple_text(['t_us', held, *(field_text(test, field) for field, _ in test.variables)])}")
    return Code("read(record)", ["t_us, sequence, event = record", *lines], names)


# ---- rows


def row_places(plan: Plan, mask: int, slots: Sequence[int]) -> tuple[int, ...]:
    """Give the places of some slots in the row of a state."""
    known = known_slots(plan, mask)
    return tuple(2 * mask.bit_count() + known.index(slot) for slot in slots)


def extend_code(plan: Plan, step: Step, records: Sequence[Callable[..., Record]]) -> Code:
    """Write the function that makes the rows, or with the last event the instances, of a step.

    It takes the row of the event, the row or the rows that wait for it, and the record. `records` gives for each
    position the function of `record_builder`. A step from nothing is only written where it makes a whole instance.
    """
    position = plan.positions[step.position]
    own = [f"v{slot}" for _, slot in position.test.variables]
    lines = [f"# {position.pattern} at {position.label}", f"{tuple_text(['t_us', 'held', *own])} = row"]
    is_last = step.target == (1 << len(plan.positions)) - 1
    made = _instance(plan, step) if is_last else tuple_text(_row(plan, step.target, step))
    if not step.source:
        lines.append(f"return [{made}]")
    else:
        lines += _loop(plan, step, made)
    names = {f"record_{one}": record for one, record in enumerate(records)} if is_last else {}
    return Code(f"extend_{step.source}_to_{step.target}(row, waiting, record)", lines, names)


def _loop(plan: Plan, step: Step, made: str) -> list[str]:
    """Write the loop over the rows that wait."""
    lines = ["if type(waiting) is tuple:", "    waiting = (waiting,)"]
    fits = []
    for one, least, most in step.windows:
        lines += [f"from_{one} = t_us - {most}"] * (most is not None)
        lines += [f"to_{one} = t_us - {least}"] * (least is not None)
        fits.append(f"from_{one} <= " * (most is not None) + f"t{one}" + f" <= to_{one}" * (least is not None))
    fits += [f"v{new} != s{old}" for new, old in step.differ]
    return [
        *lines,
        "made = []",
        f"for {tuple_text(_row(plan, step.source))} in waiting:",
        f"    if {' and '.join(fits)}:",
        f"        made.append({made})",
        "return made",
    ]


def _row(plan: Plan, mask: int, step: Step | None = None) -> list[str]:
    """Name the items of a row; what `step` gives has other names than what stood in the row before."""
    items = [name for one in members(mask) for name in _time_and_event(one, step)]
    return items + [_slot(slot, step) for slot in known_slots(plan, mask)]


def _time_and_event(position: int, step: Step | None) -> tuple[str, str]:
    if step is not None and position == step.position:
        return "t_us", "held"
    return f"t{position}", f"h{position}"


def _slot(slot: int, step: Step | None) -> str:
    return f"v{slot}" if step is not None and slot in step.fresh else f"s{slot}"


def _instance(plan: Plan, step: Step) -> str:
    """Write the list that `Layout` describes."""
    times = [_time_and_event(one, step)[0] for one in range(len(plan.positions))]
    slots = [_slot(slot, step) for slot in range(plan.event_slot_count)]
    records = [_record(plan, one, step) for one in range(len(plan.positions))]
    return f"[{', '.join([str(UNBOUNDED_US), *times, *slots, *records])}]"


def _record(plan: Plan, position: int, step: Step) -> str:
    if position == step.position:
        return "record"
    values = [_slot(slot, step) for _, slot in plan.positions[position].test.variables]
    return f"record_{position}({', '.join([*_time_and_event(position, step), *values])})"
