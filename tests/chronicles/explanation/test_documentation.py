"""The examples of the page on explanations are run as they stand."""

import doctest
from pathlib import Path

PAGE = Path(__file__).parents[3] / "docs" / "explanations.md"


def test_examples_of_the_page_are_right() -> None:
    failed, tried = doctest.testfile(str(PAGE), module_relative=False, optionflags=doctest.ELLIPSIS)
    assert (failed, tried > 10) == (0, True)
