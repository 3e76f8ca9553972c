"""Domains of many parts: long chains are evaluated, deep expressions are refused where they become too deep."""

import pytest

from chronicles.chronicle_set import check_texts, load
from chronicles.language.formatter import format_text
from chronicles.language.model import DEEPEST_DOMAIN

USE = "message m[?a] { ?a in Last } chronicle c[?a](t1) { event(m[?a], t1) }"
MANY = 1200  # more than the 1000 calls that Python nests
TERMS = [f"{{b{number}}}" for number in range(MANY)]


@pytest.mark.parametrize(
    ("expression", "column"),
    [
        (" | ".join(TERMS), len("domain Last = ")),
        (" ~ ".join(TERMS), len("domain Last = ")),
        (
            "({a} | " * MANY + "{a}" + ")" * MANY,
            len("domain Last = ") + len("({a} | ") * (MANY - 1 - DEEPEST_DOMAIN) + 1,
        ),
    ],
    ids=["union", "difference", "parentheses"],
)
def test_deep_expression_is_refused_once(expression: str, column: int) -> None:
    [found] = check_texts([("text", f"domain Last = {expression} {USE}")])
    assert (found.code, found.line, found.column) == ("C0109", 1, column + 1)
    assert found.message == "expected a domain of at most 100 operations in one another, got at least 101"
    assert "give parts of the domain names of their own" in found.hint


def test_deep_expression_in_a_body_is_refused() -> None:
    body = USE.replace("t1) }", "t1) ?a in " + " | ".join(TERMS) + " }")
    assert [one.code for one in check_texts([("text", f"domain Last = symbol {body}")])] == ["C0109"]


def test_deepest_expression_is_evaluated_compared_and_printed() -> None:
    expression = " | ".join(TERMS[: DEEPEST_DOMAIN + 1])
    text = f"domain Last = {expression}\n{USE}"
    right = "({a} | " * DEEPEST_DOMAIN + "{b}" + ")" * DEEPEST_DOMAIN
    body = f"domain Last = {{a, b}} {USE[:-1]} ?a in {right} ?a in {right} }}"
    assert load(text).warnings == ()
    assert [one.code for one in load(body).warnings] == ["C0602"]
    assert format_text(format_text(body)) == format_text(body)


def test_parentheses_without_operations_may_be_many() -> None:
    assert check_texts([("text", "domain Last = " + "(" * MANY + "{a}" + ")" * MANY + USE)]) == ()


@pytest.mark.long
@pytest.mark.parametrize("is_last_first", [False, True])
def test_chain_of_domains_may_be_long(is_last_first: bool) -> None:
    chain = ["domain D0 = {a}", *(f"domain D{one} = D{one - 1} | {{b{one}}}" for one in range(1, MANY))]
    chain.append(f"domain Last = D{MANY - 1}")
    ordered = reversed(chain) if is_last_first else chain
    text = "\n".join([*ordered, USE])
    assert check_texts([("text", text)]) == ()
    [found] = check_texts([("text", text.replace("t1) }", f"t1) event(m[b{MANY}], t1) }}"))])
    assert (found.code, found.edit) == ("C0303", "b200")


def test_domain_that_doubles_itself_is_evaluated_once() -> None:
    chain = ["domain D0 = {a}", *(f"domain D{one} = D{one - 1} | D{one - 1}" for one in range(1, 60))]
    assert check_texts([("text", "\n".join([*chain, "domain Last = D59", USE]))]) == ()


def test_long_circle_is_reported_once() -> None:
    circle = [f"domain D{one} = D{(one + 1) % MANY}" for one in range(MANY)]
    assert [one.code for one in check_texts([("text", "\n".join([*circle, USE.replace("Last", "D0")]))])] == ["C0205"]
