"""The rooms of the service, in the order of its data: no file imports from a room further on."""

from tests.architecture.test_imports import FILES, ROOT, imported_modules

ALONE = {"service.runs.interrupts"}
"""What knows nothing of ours, and may be used anywhere."""

WAYS = (
    ("records", "texts", "store", "runs.graph", "runs.inputs", "questions", "runs", "export", "api", "cli"),
    ("store.databases", "store.chunks", "store", "store.registers"),
    ("questions.events", "questions.observations", "questions.recognition"),
    ("runs", "runs.jobs"),
    ("runs", "runs.live"),
    ("api.messages", "api.processes", "api.access", "api.routes", "api.app"),
    ("api.messages", "api.delivery", "api.routes", "api.app"),
    ("cli.asking", "cli.making", "cli.operating", "cli.app"),
)
MOST_AT_A_ROOT, MOST_FILES = 12, 14


def place(module: str, way: tuple[str, ...]) -> int | None:
    """Say how far on the way a module is, by the innermost room that has it; None if it is in none."""
    rooms = [room for room in way if f"{module}.".startswith(f"service.{room}.")]
    return way.index(max(rooms, key=len)) if rooms else None


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
    service = ROOT / "service"
    rooms = {path.parent for path in FILES if path.is_relative_to(service)}
    sizes = {room: sum(one.name != "__pycache__" for one in room.iterdir()) for room in rooms}
    too_many = {
        room.relative_to(ROOT).as_posix(): size
        for room, size in sizes.items()
        if size > (MOST_AT_A_ROOT if room == service else MOST_FILES)
    }
    assert too_many == {}
