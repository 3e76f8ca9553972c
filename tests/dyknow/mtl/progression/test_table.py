"""Which obligations stay when obligations are joined."""

import pytest

from dyknow.mtl.parser import parse_formula
from dyknow.mtl.progression.residual import FALSE, STARTED_US, TRUE, UNKNOWN, Junction, Residual, Waiting
from dyknow.mtl.progression.table import FormulaTable
from dyknow.mtl.progression.templates import NEVER_US, Operator, Shape, TemplateMaker

Windows = list[tuple[int, int]]
OPEN = STARTED_US
MAKER = TemplateMaker()


def shape_of(text: str) -> Shape:
    template = MAKER.make(parse_formula(text), ())
    assert isinstance(template, Operator)
    return template.shape


SOME, ALL = shape_of("eventually p"), shape_of("always p")
UNTIL, RELEASE = shape_of("p until q"), shape_of("not (p until q)")


def joined(shape: Shape, windows: Windows, *, is_conjunction: bool) -> Windows:
    """Join one shape in several windows, and give the windows that stay."""
    table = FormulaTable()
    found = table.join([table.waiting(shape, (), *one) for one in windows], is_conjunction=is_conjunction)
    parts: tuple[Residual, ...] = found.parts if isinstance(found, Junction) else (found,)
    return sorted((one.start_us, one.end_us) for one in parts if isinstance(one, Waiting))


@pytest.mark.parametrize(
    ("windows", "strictest", "union"),
    [
        ([(OPEN, 5), (OPEN, 9)], [(OPEN, 5)], [(OPEN, 9)]),
        ([(OPEN, 9), (OPEN, 5), (OPEN, 7)], [(OPEN, 5)], [(OPEN, 9)]),
        ([(OPEN, NEVER_US), (OPEN, 5)], [(OPEN, 5)], [(OPEN, NEVER_US)]),
        ([(3, 5), (4, 8)], [(3, 5), (4, 8)], [(3, 8)]),
        ([(3, 5), (6, 8)], [(3, 5), (6, 8)], [(3, 8)]),
        ([(3, 5), (7, 8)], [(3, 5), (7, 8)], [(3, 5), (7, 8)]),
        ([(3, 9), (4, 6)], [(4, 6)], [(3, 9)]),
        ([(3, 6), (3, 9), (2, 6)], [(3, 6)], [(2, 9)]),
        ([(OPEN, 6), (3, 6), (8, 9)], [(3, 6), (8, 9)], [(OPEN, 6), (8, 9)]),
        ([(3, NEVER_US), (5, NEVER_US)], [(5, NEVER_US)], [(3, NEVER_US)]),
    ],
)
def test_windows_of_one_shape_are_merged(windows: Windows, strictest: Windows, union: Windows) -> None:
    for existential in (SOME, UNTIL):
        assert joined(existential, windows, is_conjunction=True) == strictest
        assert joined(existential, windows, is_conjunction=False) == union
    for universal in (ALL, RELEASE):
        assert joined(universal, windows, is_conjunction=True) == union
        assert joined(universal, windows, is_conjunction=False) == strictest


def test_other_shapes_and_other_objects_stay_apart() -> None:
    table = FormulaTable()
    parts = [
        table.waiting(SOME, (), OPEN, 5),
        table.waiting(ALL, (), OPEN, 5),
        table.waiting(SOME, ("car7",), OPEN, 9),
        table.waiting(SOME, ("car8",), OPEN, 9),
    ]
    found = table.join(parts, is_conjunction=True)
    assert isinstance(found, Junction)
    assert set(found.parts) == set(parts)


def test_equal_residuals_are_one_object() -> None:
    table = FormulaTable()
    one, other = table.waiting(SOME, (), 3, 5), table.waiting(ALL, (), 3, 5)
    assert table.waiting(SOME, (), 3, 5) is one
    assert table.join([one, other], is_conjunction=True) is table.join([other, one, one], is_conjunction=True)
    assert table.join([one, other], is_conjunction=True) is not table.join([one, other], is_conjunction=False)


def test_known_parts_decide_or_vanish() -> None:
    table = FormulaTable()
    one = table.waiting(SOME, (), 3, 5)
    assert table.join([one, TRUE], is_conjunction=True) is one
    assert table.join([one, FALSE], is_conjunction=True) is FALSE
    assert table.join([one, TRUE], is_conjunction=False) is TRUE
    assert table.join([TRUE, TRUE], is_conjunction=True) is TRUE
    assert table.join([], is_conjunction=False) is FALSE
    assert isinstance(table.join([one, UNKNOWN], is_conjunction=True), Junction)


@pytest.mark.parametrize("is_conjunction", [True, False])
def test_a_junction_that_another_part_makes_superfluous_is_left_out(is_conjunction: bool) -> None:
    table = FormulaTable()
    shape, other = (SOME, ALL) if is_conjunction else (ALL, SOME)
    strict, loose = table.waiting(shape, (), OPEN, 5), table.waiting(shape, (), OPEN, 9)
    beside = table.waiting(other, (), 7, 8)
    strict_or, loose_or = (table.join([one, beside], is_conjunction=not is_conjunction) for one in (strict, loose))
    assert table.join([strict, loose_or], is_conjunction=is_conjunction) is strict
    assert table.join([loose_or, strict_or], is_conjunction=is_conjunction) is strict_or
    assert table.join([strict_or, loose_or], is_conjunction=is_conjunction) is strict_or
    kept = table.join([loose, strict_or], is_conjunction=is_conjunction)
    assert isinstance(kept, Junction)
    assert set(kept.parts) == {loose, strict_or}


def test_a_junction_about_another_object_stays() -> None:
    table = FormulaTable()
    beside = table.waiting(ALL, (), 7, 8)
    for strict, loose in (
        (table.waiting(SOME, ("car7",), OPEN, 5), table.waiting(SOME, ("car8",), OPEN, 9)),
        (
            table.guarded("Car", "car7", table.waiting(SOME, (), OPEN, 5)),
            table.guarded("Car", "car8", table.waiting(SOME, (), OPEN, 9)),
        ),
    ):
        loose_or = table.join([loose, beside], is_conjunction=False)
        found = table.join([strict, loose_or], is_conjunction=True)
        assert isinstance(found, Junction)
        assert set(found.parts) == {strict, loose_or}


def test_obligations_about_one_member_are_merged_inside_its_guard() -> None:
    table = FormulaTable()
    early, late = (table.guarded("Car", "car7", table.waiting(SOME, ("car7",), OPEN, end_us)) for end_us in (5, 9))
    other = table.guarded("Car", "car8", table.waiting(SOME, ("car8",), OPEN, 9))
    assert table.join([late, early], is_conjunction=True) is early
    found = table.join([late, early, other], is_conjunction=True)
    assert isinstance(found, Junction)
    assert set(found.parts) == {early, other}
    assert table.guarded("Car", "car7", FALSE) is FALSE
