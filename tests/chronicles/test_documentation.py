"""The examples of the language page are run as they stand."""

import doctest
import re
from pathlib import Path

import pytest

from tests.chronicles.support import run, shown

PAGE = Path(__file__).parents[2] / "docs" / "chronicle_language.md"
FENCE = re.compile(r"^```(chronicle|events|occurrences)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
BLOCKS = FENCE.findall(PAGE.read_text(encoding="utf-8"))
EXAMPLES = [tuple(text for _, text in BLOCKS[index : index + 3]) for index in range(0, len(BLOCKS), 3)]


def test_every_example_has_a_chronicle_a_stream_and_its_occurrences() -> None:
    assert [kind for kind, _ in BLOCKS] == ["chronicle", "events", "occurrences"] * len(EXAMPLES)
    assert len(EXAMPLES) >= 8


@pytest.mark.parametrize(("chronicle", "events", "occurrences"), EXAMPLES)
def test_example_of_the_language_page_is_right(chronicle: str, events: str, occurrences: str) -> None:
    assert shown(run(chronicle, events)) == occurrences.strip().splitlines()


def test_examples_of_the_engine_page_are_right() -> None:
    page = PAGE.with_name("chronicles.md")
    failed, tried = doctest.testfile(str(page), module_relative=False)
    assert (failed, tried > 5) == (0, True)
