"""Do the truth of generated scenes, the chronicles of the library and their page name the same events and roles?"""

import re

from data_gen.truth.event import INTERCHANGEABLE, ROLES
from service.cli.app import run
from tests.contracts.tables import DOCS, LIBRARY, cells, declared, page, table

TEXTS = {path.stem: path.read_text(encoding="utf-8") for path in LIBRARY.glob("*.chronicle")}
RELATIONS = declared(TEXTS.pop("relations"), "attribute")
MESSAGES = {name: arguments for text in TEXTS.values() for name, arguments in declared(text, "message").items()}
HEAD = re.compile(r"^chronicle (\w+)\[([^\]]*)\]\(", re.MULTILINE)
EMIT = re.compile(r"\bemit (\w+)\[([^\]]*)\]")
ROWS = {name: row for row in table("library.md", "event") for name in re.findall(r"`(\w+)`", row[0])}


def names(arguments: str) -> tuple[str, ...]:
    return tuple(re.findall(r"\?(\w+)", arguments))


def test_truth_and_library_have_the_same_types() -> None:
    assert set(TEXTS) == set(MESSAGES) == set(ROLES) == set(ROWS)


def test_roles_of_the_truth_are_the_vehicles_of_the_library() -> None:
    # A danger may be a car or a junction, so its message leaves the domain open.
    vehicles = {
        name: tuple(one for one, domain in arguments if domain in ("Car", "")) for name, arguments in MESSAGES.items()
    }
    assert vehicles == ROLES
    assert set(ROLES) >= INTERCHANGEABLE


def test_heads_messages_and_emitted_events_have_the_same_roles_in_the_same_order() -> None:
    for name, text in TEXTS.items():
        roles = tuple(one for one, _ in MESSAGES[name])
        emitted = [(event, names(arguments)) for event, arguments in EMIT.findall(text)]
        heads = HEAD.findall(text)
        assert set(emitted) == {(name, roles)}, name
        assert len(emitted) == len(heads) > 0, name
        assert all(chronicle.startswith(name) and names(head) == roles for chronicle, head in heads), name


def test_page_has_the_roles_of_each_event() -> None:
    documented = {name: tuple(re.findall(r"\w+", re.sub(r"\(.*?\)", "", row[2]))) for name, row in ROWS.items()}
    assert documented == {name: tuple(one for one, _ in arguments) for name, arguments in MESSAGES.items()}


def test_page_has_the_relations_that_each_event_looks_at() -> None:
    for name, text in TEXTS.items():
        bodies = re.sub(r"#.*", "", re.split(r"^example", text, maxsplit=1, flags=re.MULTILINE)[0])
        looked_at = {one for one in re.findall(r"\b(\w+)\[", bodies) if one in RELATIONS or one in MESSAGES} - {name}
        assert set(re.findall(r"\w+", ROWS[name][4])) == looked_at, name


def test_twins_of_the_page_are_events_of_the_library() -> None:
    rows = [row for line in page("library.md").splitlines() if (row := cells(line)) and row[0].startswith("`")]
    twins = {name for row in rows if len(row) == 2 for name in re.findall(r"`([\w*]+)`", row[0])}
    assert all(any(re.fullmatch(name.replace("*", r"\w+"), one) for one in MESSAGES) for name in twins), twins
    assert len(twins) > 5


def test_readme_counts_the_events_of_the_library() -> None:
    (count,) = re.findall(r"looks for (\d+) kinds of events", (DOCS.parent / "README.md").read_text(encoding="utf-8"))
    assert int(count) == len(MESSAGES)


def test_library_checks_without_a_finding() -> None:
    assert run(["check", *(str(path) for path in sorted(LIBRARY.glob("*.chronicle")) if path.stem in TEXTS)]) == 0
