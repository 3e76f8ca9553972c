"""Does docs/http.md say what `/openapi.json` says: the same paths, methods, parameters and errors?

A table of the page whose head is "parameter of `PATH`" has all parameters of that path and no others. Those of other
paths are named, between backticks, in a section that shows the path; "the filters of `PATH`" names those in its table.
"""

import re
from typing import Any  # JSON

import pytest

from service.api.app import create_app
from tests.contracts.tables import page, table
from tests.service.logs import overtake, write_log

PAGE = page("http.md")
SECTIONS = PAGE.split("\n## ")[1:]  # what comes before lists all paths
HEAD = re.compile(r"^\| (parameter of `(/.*?)`) \|", re.MULTILINE)

Operations = dict[tuple[str, str], dict[str, Any]]


@pytest.fixture(scope="module")
def operations(tmp_path_factory: pytest.TempPathFactory) -> Operations:
    """What is described, by method and path; names between braces do not matter."""
    app = create_app(write_log(tmp_path_factory.mktemp("page") / "a.db", [overtake()]), shipped=[])
    paths = app.openapi()["paths"]
    return {(method.upper(), bare(path)): one for path, found in paths.items() for method, one in found.items()}


def bare(path: str) -> str:
    return re.sub(r"\{.*?\}", "{}", path)


def parameters(operation: dict[str, Any]) -> set[str]:
    """Name what a query may hold as the page does."""
    named = {one["name"] for one in operation.get("parameters", ()) if one["in"] == "query"}
    return {"role.NAME" if name == "roles" else name for name in named}


def named_in(text: str) -> set[str]:
    return set(re.findall(r"`([\w.]+)`", text))


def rows(head: str) -> set[str]:
    """Name what the first column of a table names."""
    return {name for first, *_ in table("http.md", head) for name in named_in(first)}


def test_the_page_lists_the_paths_and_methods_that_there_are(operations: Operations) -> None:
    listed = set()
    for first, *_ in table("http.md", "path"):
        methods = re.findall(r"`([A-Z]+)`", first)
        methods += ["GET"] if not methods or "also" in first else []
        listed |= {(method, bare(path)) for path in re.findall(r"`(/.*?)`", first) for method in methods}
    assert listed == set(operations)


def test_tables_of_parameters_are_those_of_their_paths(operations: Operations) -> None:
    heads = HEAD.findall(PAGE)
    assert len(heads) >= 2
    for head, path in heads:
        assert rows(head) == parameters(operations["GET", bare(path)]), path


def test_other_parameters_are_named_where_their_path_is_shown(operations: Operations) -> None:
    listed = {bare(path): rows(head) for head, path in HEAD.findall(PAGE)}
    for (method, path), operation in operations.items():
        if path in listed:
            continue
        shown = re.compile(re.escape(path).replace(r"\{\}", r"[^/\s'`?]+") + r"(?=[?'`\s])")
        showing = [section for section in SECTIONS if shown.search(section)]
        told = {name for section in showing for name in named_in(section)}
        for section in showing:
            told.update(*(listed[other] for other in re.findall("the filters of `(/.*?)`", section)))
        assert parameters(operation) - told == set(), (method, path)


def test_the_page_lists_the_errors_that_are_answered(operations: Operations) -> None:
    answered = {code for one in operations.values() for code in one["responses"] if code.startswith(("4", "5"))}
    listed = {code.strip() for first, *_ in table("http.md", "status") for code in first.split(",")}
    assert answered - listed == set()
