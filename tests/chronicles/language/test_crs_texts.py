"""Texts that other chronicle tools write are read: no blanks, no semicolons, bare numbers, empty lists everywhere."""

import pytest

from chronicles.chronicle_set import check_texts, load
from tests.chronicles.support import run, shown

# As `pychronicles.utils.to_crs` of pychronicles 0.2.0 writes a pattern of four events, but for its name.
EXPORTED = """chronicle C0[]()
{
	event(EA[], t000)
	event(EB[], t001)
	event(EC[], t002)
	event(EA[], t003)

	t000-t001 in [1.0,5.0]
	t001-t002 in [-3.0,10.0]
	t000-t003 in [0.5,4.0]
}"""


def test_exported_text_is_read_with_its_unit_before_it() -> None:
    loaded = load("timeunit 1s\n" + EXPORTED)
    [plan] = loaded.plans
    assert [(one.label, one.test.name) for one in plan.positions] == [
        ("t000", "EA"), ("t003", "EA"), ("t001", "EB"), ("t002", "EC"),
    ]  # fmt: skip
    assert plan.distance_us[0][2] == -1_000_000
    assert plan.distance_us[2][0] == 5_000_000
    assert plan.distance_us[1][0] == 4_000_000


def test_differences_mean_what_they_say() -> None:
    # t000-t001 in [1,5] puts t001 first; pychronicles itself writes the pair the other way round.
    stream = "1s EB[]\n2s EC[]\n2s EA[]\n4s EA[]\nuntil 60s"
    assert shown(run(load("timeunit 1s\n" + EXPORTED), stream)) == ["C0[] 1s..4s"]


def test_exported_text_without_a_unit_asks_for_one_once() -> None:
    [found] = check_texts([("text", EXPORTED)])
    assert (found.code, found.line) == ("C0106", 8)
    assert found.hint == "write 1.0s, or say what all numbers of the text count: timeunit 1s"


@pytest.mark.parametrize("head", ["chronicle C1[]()", "chronicle C1()", "chronicle C1[]", "chronicle C1"])
def test_lists_of_a_head_may_be_empty_or_missing(head: str) -> None:
    text = "timeunit 1us " + head + "{\nevent(A[],t001)\nevent(B[],t002)\nt002-t001 in [-5,20]\n}"
    assert shown(run(text, "0us B[]\n3us A[]\n17us B[]")) == ["C1[] 0s..3e-06s", "C1[] 3e-06s..1.7e-05s"]


@pytest.mark.parametrize(
    ("constraint", "low_us", "high_us"),
    [
        ("t2-t1 in [-3,10]", -3, 10),
        ("t2-t1 in [-3,-1]", -3, -1),
        ("t2-t1 in[3,3]", 3, 3),
        ("t1-t2 in [-10,3]", -3, 10),
        ("-3<=t2-t1<=10", -3, 10),
        ("t2-t1 in ]-3,10[", -2, 9),
        ("t2>=t1-3 t2<=t1+10", -3, 10),
        ("t2-t1 in [-3,10] t2-t1 in [0,20]", 0, 10),
    ],
)
def test_constraints_need_no_blanks(constraint: str, low_us: int, high_us: int) -> None:
    plan = load(f"timeunit 1us chronicle c {{ event(A[],t1)event(B[],t2){constraint} }}").plans[0]
    assert (-plan.distance_us[1][0], plan.distance_us[0][1]) == (low_us, high_us)


@pytest.mark.parametrize("bound", ["inf", "-inf"])
def test_infinity_of_other_tools_is_told_its_name(bound: str) -> None:
    ends = f"1.0,{bound}" if bound == "inf" else f"{bound},1.0"
    found = check_texts([("t", f"timeunit 1s chronicle c {{ event(A[], t1) event(B[], t2) t1-t2 in [{ends}] }}")])
    [one] = [one for one in found if one.severity == "error"]
    assert (one.code, one.hint, one.edit) == ("C0204", "no bound is written oo", "oo")


def test_count_may_be_written_without_its_parentheses() -> None:
    legacy, usual = (
        f"timeunit 1us chronicle c {{ event(A[], t1) event(B[], t2) t2-t1 in [1,9] occurs({count}, C[], (t1,t2)) }}"
        for count in ("1, 2", "(1, 2)")
    )
    assert load(legacy).plans == load(usual).plans


def test_actions_may_have_semicolons_and_the_other_spelling() -> None:
    text = """timeunit 1us chronicle c[]() {
      event(A[], t1);
      noevent(B[], (t1+1,t1+5));
      when recognized { emit event(found[], t1+5); }
    }"""
    [found] = run(text, "1us A[]\n10us B[]")
    assert [(one.name, one.t_us) for one in found.emitted] == [("found", 6)]
