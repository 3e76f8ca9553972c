"""Every chronicle text that differs from another by one bound, which lets more match, moved by some microseconds."""

from collections.abc import Iterator
from dataclasses import replace

from chronicles.chronicle_set import ChronicleSet, load
from chronicles.errors import ChronicleError
from chronicles.language import model
from chronicles.language.parser import parse
from chronicles.language.printer import print_file
from dyknow.language.diagnostics import Reporter


def relaxed_sets(text: str, by_us: int) -> Iterator[ChronicleSet]:
    """Give the set of each text in which one bound is looser by so much; texts that are refused are left out."""
    file = parse(text, "text", Reporter({"text": text}))
    chronicle = file.declarations[-1]
    assert isinstance(chronicle, model.Chronicle)
    for place, statement in enumerate(chronicle.statements):
        for changed in _relaxed(statement, by_us):
            statements = (*chronicle.statements[:place], changed, *chronicle.statements[place + 1 :])
            body = replace(chronicle, statements=statements)
            try:
                yield load(print_file(replace(file, declarations=(*file.declarations[:-1], body))))
            except ChronicleError:
                continue


def _relaxed(one: model.Statement, by_us: int) -> Iterator[model.Statement]:
    match one:
        case model.Range():
            if one.low.duration is not None:
                yield replace(one, low=_moved(one.low, -by_us, one))
            if one.high.duration is not None:
                yield replace(one, high=_moved(one.high, by_us, one))
        case model.Comparison():
            for sign in {"<": (1,), "<=": (1,), ">": (-1,), ">=": (-1,), "=": (1, -1)}[one.comparator]:
                yield replace(one, offset=_moved(one.offset, sign * by_us, one))
        case model.NoEventStatement() | model.HoldStatement() | model.AssertStatement() | model.OccursStatement():
            interval = one.interval
            # More than was seen may be asked of an occurs, so its interval may have to grow.
            for inwards_us in (by_us, -by_us) if isinstance(one, model.OccursStatement) else (by_us,):
                start = replace(interval.start, offset=_moved(interval.start.offset, inwards_us, one))
                end = replace(interval.end, offset=_moved(interval.end.offset, -inwards_us, one))
                yield replace(one, interval=replace(interval, start=start))
                yield replace(one, interval=replace(interval, end=end))
        case _:
            return


def _moved(bound: model.Bound | None, by_us: int, place: model.Statement) -> model.Bound:
    written_us = by_us
    if bound is not None and bound.duration is not None:
        assert not bound.duration.constant
        written_us += -bound.duration.us if bound.negative else bound.duration.us
    return model.Bound(written_us < 0, model.Duration(abs(written_us), "", span=place.span), span=place.span)
