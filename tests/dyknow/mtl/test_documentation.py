"""The page on formulas is run as it stands, and its monitors are read."""

import doctest
import re
from pathlib import Path

from dyknow.mtl.formula import Formula
from dyknow.mtl.parser import parse_formula, parse_monitors
from dyknow.mtl.printer import print_monitors

DOCS = Path(__file__).parents[3] / "docs" / "formulas.md"


def test_the_examples_of_the_page_run() -> None:
    failed, attempted = doctest.testfile(str(DOCS), module_relative=False)
    assert attempted > 15
    assert failed == 0


def test_the_monitors_of_the_page_can_be_read() -> None:
    blocks = re.findall(r"```mtl\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)
    monitors = [one for block in blocks for one in parse_monitors(block)]
    assert len(monitors) == 4
    assert parse_monitors(print_monitors(monitors)) == tuple(monitors)


def test_the_forms_of_the_page_can_be_read() -> None:
    rows = re.findall(r"^\| (`.*?`) (?:\(.*?\) )?\|", DOCS.read_text(encoding="utf-8"), re.MULTILINE)
    forms = [form for row in rows for form in re.findall(r"`([^`]*)`", row) if form not in ("->", "<->")]
    read: list[Formula] = []
    for form in forms:
        text = form.replace("[a, b]", "[1s, 2s]").replace("t1, t2", "1s, 2s")
        read.append(parse_formula(text, variables=["a", "b", "c"] if "in Car" not in text else []))
    assert len(read) >= 15
