"""Types are compared by what their sorts stand for, whatever the sorts stand for."""

import random

import pytest

from dyknow.kpl import model
from dyknow.kpl.checks import check_kpl
from dyknow.kpl.parser import parse_kpl, parse_type
from dyknow.kpl.vocabulary import Vocabulary
from dyknow.language.diagnostics import Reporter
from tests.cases import for_each


def vocabulary(text: str) -> Vocabulary:
    return Vocabulary(parse_kpl(text), Reporter({"kpl": text}))


def same(text: str, one: str, other: str) -> bool:
    return vocabulary(text).are_same(parse_type(one), parse_type(other))


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        ("Point", "<float, float>", True),
        ("Place", "Point", True),
        ("set(Place)", "set(<float, float>)", True),
        ("<Point, int>", "<<float, float>, int>", True),
        ("Point", "<float, int>", False),
        ("Point", "<float, float, float>", False),
        ("Point", "set(float)", False),
        ("int", "float", False),
        ("Frame", "Frame", True),
        ("Frame", "Picture", False),
    ],
)
def test_types_are_the_same_if_what_they_stand_for_is(one: str, other: str, expected: bool) -> None:
    text = "sort Place = Point; sort Point = <float, float>; sort Frame; sort Picture;"
    assert same(text, one, other) is same(text, other, one) is expected


@pytest.mark.parametrize(
    ("type_", "expected"),
    [("int", True), ("Speeds", True), ("bool", False), ("<int, string>", False), ("set(int)", False), ("time", False)],
)
def test_numbers_and_tuples_of_numbers_can_be_interpolated(type_: str, expected: bool) -> None:
    declared = vocabulary("sort Speed = float; sort Speeds = <Speed, <int, Speed>>;")
    assert declared.is_numeric(parse_type(type_)) is expected


@for_each("seed", range(40))
def test_comparison_agrees_with_writing_the_types_out(seed: int) -> None:
    rng = random.Random(seed)
    leaves = ["int", "float", "Opaque"]
    sorts: dict[str, str] = {}
    for index in range(6):
        inside = [rng.choice([*leaves, *sorts]) for _ in range(rng.randrange(1, 3))]
        sorts[f"S{index}"] = rng.choice([inside[0], f"<{', '.join(inside)}>", f"set({inside[0]})"])
    declared = vocabulary("sort Opaque;" + "".join(f"sort {name} = {type_};" for name, type_ in sorts.items()))
    for one in sorts:
        for other in sorts:
            expected = written_out(parse_type(one), declared) == written_out(parse_type(other), declared)
            assert declared.are_same(parse_type(one), parse_type(other)) is expected
        is_numeric = set(written_out(parse_type(one), declared).replace("<", " ").replace(">", " ").split()) <= {
            "int",
            "float",
        }
        assert declared.is_numeric(parse_type(one)) is is_numeric


def written_out(type_: model.Type, declared: Vocabulary) -> str:
    match type_:
        case model.TupleType(parts):
            return f"<{' '.join(written_out(part, declared) for part in parts)}>"
        case model.SetType(element):
            return f"set({written_out(element, declared)})"
        case model.NamedType(name):
            inside = declared.sorts[name.text].type if name.text in declared.sorts else None
            return written_out(inside, declared) if inside else name.text


def test_sorts_that_would_fill_the_memory_when_written_out_are_compared_at_once() -> None:
    text = "sort A0 = float; sort B0 = float;"
    text += "".join(f"sort {one}{i} = <{one}{i - 1}, {one}{i - 1}>;" for i in range(1, 200) for one in "AB")
    text += "source A199 s; compunit int u(B199); strmgen a = s;"
    text += "strmgen b = u(a with sample every 1s, linear interpolation, strict order); stream c = b;"
    assert check_kpl(text).warnings == ()


def test_long_chain_of_sorts_is_no_problem() -> None:
    text = "sort S0 = int;" + "".join(f"sort S{index} = S{index - 1};" for index in range(1, 2000))
    assert same(text, "S1999", "int")


def test_sorts_made_of_themselves_do_not_hang_the_comparison() -> None:
    assert same("sort A = <A>; sort B = <B>;", "A", "B")
    assert not same("sort A = <A>; sort B = set(B);", "A", "B")
