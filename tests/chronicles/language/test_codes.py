"""The page of codes: complete, and each of its examples does what it says."""

import re
from pathlib import Path

import pytest

import chronicles
from chronicles.chronicle_set import check_texts
from chronicles.errors import ChronicleError
from chronicles.language.codes import Code, all_codes, explain_code, page
from tests.cases import for_each
from tests.dyknow.language.codes import shared_codes

SOURCES = Path(chronicles.__file__).parent
PRODUCED = {"C0901": ["enter"]}


def codes_in(text: str, code: str) -> list[tuple[str, str]]:
    return [(one.code, one.severity) for one in check_texts([("text", text)], PRODUCED.get(code))]


def test_every_code_of_the_sources_has_its_section_and_no_other() -> None:
    used = {code for path in SOURCES.rglob("*.py") for code in re.findall(r'"(C\d{4})"', path.read_text("utf-8"))}
    documented = [one.code for one in all_codes()]
    assert documented == sorted(used | shared_codes("C"))
    assert page().count("\n## ") == len(documented)


@for_each("one", all_codes())
def test_wrong_text_has_this_finding_only(one: Code) -> None:
    assert codes_in(one.wrong, one.code) == [(one.code, "warning" if one.is_warning else "error")]


@for_each("one", all_codes())
def test_mended_text_has_no_findings(one: Code) -> None:
    assert codes_in(one.mended, one.code) == []


def test_explanation_has_meaning_and_both_texts() -> None:
    text = explain_code("c0701")
    assert text.startswith("C0701: waiting for ever\n")
    assert "t1 < t2 }" in text
    assert "t1 < t2 t2 <= t1 + 1h }" in text


def test_unknown_code_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ChronicleError, match=r"expected one of the codes C0101, .* got 'C9999'"):
        explain_code("C9999")
