"""Rooms are small, and those of the service lie along the way of its data: no file imports from one further on."""

import pytest

from tests.architecture.test_imports import FILES, ROOT, imported_modules

ALONE = {"service.runs.machine"}
"""What knows nothing of ours, and may be used anywhere."""

WAYS = (
    ("records", "texts", "store", "runs.graph", "runs.inputs", "questions", "runs", "export", "api", "cli"),
    ("store.databases", "store.chunks", "store", "store.registers"),
    ("questions.events", "questions.observations", "questions.recognition"),
    ("runs", "runs.live", "runs.jobs"),
    ("api.messages", "api.processes", "api.access", "api.routes", "api.app"),
    ("api.messages", "api.delivery", "api.routes", "api.app"),
    ("cli.asking", "cli.making", "cli.operating", "cli.app"),
)
MOST_AT_A_ROOT, MOST_FILES = 12, 14
NO_ENTRIES = {"__pycache__", "__init__.py", "__init__.pyi", "py.typed"}
"""The face of a package is no room."""


def place(module: str, way: tuple[str, ...]) -> int | None:
    """Say how far on the way a module is, by the innermost room that has it; None if it is in none."""
    rooms = [room for room in way if f"{module}.".startswith(f"service.{room}.")]
    return way.index(max(rooms, key=len)) if rooms else None


@pytest.mark.long
def test_imports_go_one_way_along_the_data() -> None:
    found = []
    for path in FILES:
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for way in WAYS:
            here = place(module, way)
            for other in imported_modules(path) if here is not None else ():
                there = place(other, way)
                if other not in ALONE and there is not None and there > here:
                    found.append(f"{module}: {other} is further on in {way}")
    assert found == []


def test_a_room_can_be_overlooked() -> None:
    rooms = {path.parent for path in FILES}
    for room in sorted(rooms):
        entries = [one for one in room.iterdir() if one.name not in NO_ENTRIES]
        assert room.parent != ROOT or len(entries) <= MOST_AT_A_ROOT, f"{room}: {len(entries)} entries"
        assert sum(one.suffix == ".py" for one in entries) <= MOST_FILES, room
