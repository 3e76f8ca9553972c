"""The examples of the page on streams are run as they stand."""

import doctest
from pathlib import Path

from dyknow.policies.policy import Approximation, Order

PAGE = Path(__file__).parents[2] / "docs" / "dyknow.md"


def test_examples_of_the_page_are_right() -> None:
    failed, tried = doctest.testfile(str(PAGE), module_relative=False)
    assert (failed, tried > 50) == (0, True)


def test_page_has_a_row_for_every_form() -> None:
    rows = [line.split("|")[1] for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| `")]
    words = [form.value for form in (*Approximation, *Order)]
    words += ["any update", "any change", "sample every", "max delay", "from a", "to b", "from a to b", "oldest"]
    assert [word for word in words if not any(word in row for row in rows)] == []
