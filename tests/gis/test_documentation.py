"""The example of the page on `gis` is run as it stands."""

from __future__ import annotations

import doctest
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs" / "gis.md"


def test_the_example_of_the_documentation_runs() -> None:
    failed, attempted = doctest.testfile(str(DOCS), module_relative=False)
    assert attempted > 5
    assert failed == 0
