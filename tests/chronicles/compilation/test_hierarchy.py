"""The order in which chronicles run, and how late."""

import pytest

from chronicles.chronicle_set import check_texts, load
from chronicles.compilation.hierarchy import levels
from chronicles.errors import ChronicleError
from chronicles.events import Event
from chronicles.recogniser import Recogniser
from tests.chronicles.support import run, shown

SET = "chronicle {name}(t1) {{ event({seen}[], t1) when recognised {{ assert(p[]:{name}, t1) }} }} "


def test_emitters_come_first_whatever_the_order_of_the_text() -> None:
    text = """chronicle last(t1) { event(b[], t1) }
    chronicle middle(t1) { event(a[], t1) when recognised { emit b[] } }
    chronicle first(t1) { event(x[], t1) when recognised { emit a[] } }"""
    loaded = load(text)
    assert loaded.names == ("first", "middle", "last")
    assert [level for level, _ in levels(loaded.plans).values()] == [0, 1, 2]


def test_chronicles_that_set_one_attribute_run_together_behind_all_that_any_of_them_looks_at() -> None:
    text = SET.format(name="one", seen="x") + SET.format(name="two", seen="e")
    text += "chronicle source(t1) { event(y[], t1) when recognised { emit e[] } }"
    text += "chronicle reader(t1) { event(p[]:(?, two), t1) }"
    assert {name: level for name, (level, _) in levels(load(text).plans).items()} == {
        "source": 0,
        "one": 1,
        "two": 1,
        "reader": 2,
    }


def test_what_emits_changes_of_an_attribute_runs_before_what_asserts_it() -> None:
    text = SET.format(name="one", seen="x")
    text += "chronicle source(t1) { event(y[], t1) when recognised { emit event(p[]:(off, red), t1) } }"
    assert load(text).names == ("source", "one")
    [_, found] = run(text, "1s y[]\n2s x[]\nuntil 9s")
    assert found.emitted == (Event("p", (), 2_000_000, "red", "one"),)


@pytest.mark.parametrize(
    "statement",
    ["hold(p[]:one, (t1, t1 + 1s))", "event(p[]:(?, red), t1)", "occurs((1, oo), p[]:(?, ?), (t1, t1 + 1s))"],
)
def test_chronicle_that_looks_at_what_it_asserts_is_refused(statement: str) -> None:
    with pytest.raises(ChronicleError, match="got one -> one"):
        load(SET.format(name="one", seen="x").replace("when", f"{statement} when"))


def test_circle_names_each_chronicle_and_whom_it_feeds() -> None:
    text = "".join(
        f"chronicle {name}(t1) {{ event({seen}[], t1) when recognised {{ emit {given}[] }} }}\n"
        for name, seen, given in (("one", "a", "c"), ("two", "b", "a"), ("three", "c", "b"))
    )
    [found] = check_texts([("text", text)])
    assert found.message.endswith("got one -> two -> three -> one")
    assert [(one.line, one.label) for one in found.related] == [(2, "feeds 'one'"), (3, "feeds 'two'")]


@pytest.mark.long
def test_chain_of_more_chronicles_than_python_nests_calls_is_ordered() -> None:
    text = "\n".join(
        f"chronicle c{number}(t1) {{ event(e{number}[], t1) when recognised {{ emit e{number + 1}[] }} }}"
        for number in reversed(range(1100))
    )
    chronicles = load(text)
    assert chronicles.names == tuple(f"c{number}" for number in range(1100))
    assert levels(chronicles.plans)["c1099"] == (1099, 0)


def test_chronicles_that_set_attributes_by_way_of_others_run_together() -> None:
    text = "".join(
        f"chronicle {name}(t1) {{ event({name}_seen[], t1) when recognised {{ {actions} }} }}\n"
        for name, actions in (
            ("left", "assert(p[]:on, t1)"),
            ("alone", "assert(r[]:on, t1)"),
            ("between", "assert(p[]:off, t1) assert(q[]:off, t1)"),
            ("right", "assert(q[]:on, t1)"),
        )
    )
    text += "chronicle source(t1) { event(y[], t1) when recognised { emit right_seen[] } }"
    of = {name: level for name, (level, _) in levels(load(text).plans).items()}
    assert of == {"source": 0, "left": 1, "between": 1, "right": 1, "alone": 0}


def test_level_is_as_late_as_its_latest_chronicle_and_so_is_what_comes_after() -> None:
    text = """
    chronicle quick(t1) { event(x[], t1) when recognised { emit a[] } }
    chronicle slow(t1) { event(y[], t1) noevent(n[], (t1, t1 + 9s)) when recognised { emit s[] } }
    chronicle relay(t1) { event(a[], t1) when recognised { emit b[] } }
    chronicle heavy(t1) { event(s[], t1) }
    chronicle last(t1) { event(b[], t1) noevent(b[], (t1 + 1us, t1 + 2s)) }
    """
    assert levels(load(text).plans)["last"] == (2, 9_000_000)
    recogniser = Recogniser(load(text))
    found = [one for second in (1, 2) for one in recogniser.observe(Event("x", (), second * 1_000_000))]
    found += [one for second in range(3, 40) for one in recogniser.advance(second * 1_000_000)]
    assert [line for line in shown(found) if line.startswith("last")] == ["last[] 2s..2s"]


def test_selected_occurrence_emits_one_microsecond_later_and_others_wait_for_it() -> None:
    text = """
    chronicle seen(t1) { event(x[], t1) select first(t1) when recognised { emit a[] } }
    chronicle unseen(t1) { event(y[], t1) noevent(a[], (t1, t1 + 1us)) }
    """
    recogniser = Recogniser(load(text))
    found = [one for name in "yx" for one in recogniser.observe(Event(name, (), 100))]
    found += [one for t_us in range(100, 110) for one in recogniser.advance(t_us)]
    assert [one.chronicle for one in found] == ["seen"]
