"""Builders of small event logs for the tests of the service."""

import random
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any  # records of many kinds

import msgspec
from sqlalchemy import text

from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.records.events import ChronicleRef, EventDraft, EventRecord, Place, SubEvent
from service.records.runs import CameraRecord, ChronicleRecord, RunRecord
from service.records.seen import CarState, LinkRecord, RelationRecord
from service.store import schema
from service.store.log import open_log

START_UTC_US = 1_777_622_400_000_000  # 2026-05-01T08:00:00Z
SECOND_US = 1_000_000

# Ten pixels a metre, the origin at pixel (100, 200), y up on the ground and down in the image.
CAMERA = CameraRecord((10.0, 0.0, 100.0, 0.0, -10.0, 200.0, 0.0, 0.0, 1.0), 640, 360)

OVERTAKE_TEXT = "chronicle overtake[?overtaker,?overtaken]() {}"


def run(run_id: str = "r1", **fields: object) -> RunRecord:
    """Build a run of `demo.mp4` that starts at 08:00 UTC."""
    chronicle = ChronicleRecord(
        name="overtake",
        version="v1",
        parameters=("overtaker", "overtaken"),
        text=OVERTAKE_TEXT,
        file="overtake.chronicle",
    )
    defaults: dict[str, object] = {
        "source": "demo.mp4",
        "start_utc_us": START_UTC_US,
        "camera": CAMERA,
        "chronicles": (chronicle,),
    }
    return RunRecord(id=run_id, **(defaults | fields))  # type: ignore[arg-type]  # fields of any type, by name


def overtake(start_us: int = 12 * SECOND_US, end_us: int | None = None, **fields: object) -> EventDraft:
    """Build an overtake of car3 by car7."""
    defaults: dict[str, object] = {
        "type": "overtake",
        "chronicle": ChronicleRef("overtake", "v1"),
        "start_us": start_us,
        "end_us": start_us + 3 * SECOND_US if end_us is None else end_us,
        "roles": {"overtaker": "car7", "overtaken": "car3"},
        "recognised_us": start_us + 4 * SECOND_US,
        "hypotheses": ("h1", "h2"),
        "sub_events": (SubEvent("begin", start_us), SubEvent("end", start_us + 3 * SECOND_US)),
        "place": Place("road1", 10.5, -2.25),
    }
    return EventDraft(**(defaults | fields))  # type: ignore[arg-type]  # fields of any type, by name


def state(t_us: int, car: str, x_m: float = 0.0, y_m: float = 0.0, **fields: object) -> CarState:
    """Build a car heading east on road1."""
    defaults: dict[str, object] = {
        "heading_rad": 0.0,
        "speed_mps": 13.9,
        "length_m": 4.5,
        "width_m": 1.8,
        "car_class": "car",
        "road": "road1",
        "along_m": x_m,
        "lane": "road1_0",
        "vision_id": "v1",
    }
    return CarState(t_us=t_us, car=car, x_m=x_m, y_m=y_m, **(defaults | fields))  # type: ignore[arg-type]  # by name


def write_log(place: Path | str, events: Sequence[EventDraft], *, record: RunRecord | None = None) -> str:
    """Write one run with events alone, into a file or where a URL says; return the log's URL."""
    url = place if isinstance(place, str) else f"sqlite:///{place}"
    with open_log(url, "w") as log:
        writer = log.begin_run(record or run())
        writer.append_events(events)
        writer.finish("finished")
    return url


def write_small_log(place: Path | str, record: RunRecord | None = None) -> str:
    """Write one run with a few rows of everything; return the log's URL."""
    url = place if isinstance(place, str) else f"sqlite:///{place}"
    with open_log(url, "w") as log:
        writer = log.begin_run(record or run())
        for frame in range(3):
            t_us = frame * 40_000
            writer.append_frames([t_us])
            writer.append_states(
                [state(t_us, "car7", 1.0 + frame, 2.0), state(t_us, "car10", 9.0, 5.0, linked=frame < 2)]
            )
        writer.append([LinkRecord(0, "established", "car", "o1", "car7", "seen for 0.5 s", "o1->car7#1")])
        writer.append(
            [
                RelationRecord(10_000, 40_000, "behind", ("car7", "car10"), "unknown", "true", ("v1->w1#1",)),
                RelationRecord(20_000, 40_000, "moving", ("car7",), "false", "true"),
                RelationRecord(30_000, 40_000, "turn", ("car7", "from", "j1"), "unknown", "left"),
            ]
        )
        writer.append_events([overtake(12 * SECOND_US), overtake(40 * SECOND_US, type="pass", place=None)])
        writer.finish("finished")
    return url


def random_drafts(rng: random.Random, count: int, run_id: str = "r1") -> list[EventDraft]:
    """Build events of a few types, cars and roads, with many equal starts, some without duration, some revised."""
    drafts: list[EventDraft] = []
    revised = iter(rng.sample(range(1, count // 2), count // 5))
    for number in range(1, count + 1):
        start_us = rng.randrange(40) * SECOND_US
        first, second = rng.sample(["car1", "car2", "car3", "car4", "car5"], 2)
        drafts.append(
            overtake(
                start_us,
                start_us + rng.choice([0, 0, 1, 2, 7]) * SECOND_US,
                type=rng.choice(["overtake", "pass", "follow"]),
                roles={"overtaker": first, "overtaken": second},
                status=rng.choice(["recognised", "tentative", "retracted"]),
                place=rng.choice([None, Place("road1", 0.0, 0.0), Place("road2", 1.0, 1.0)]),
                revises=f"{run_id}-{next(revised, 1)}" if number > count - count // 5 else None,
            )
        )
    return drafts


def read_rows(url: str) -> list[EventRecord]:
    """Read every event that was ever written to a log, newest states or not, in the order of writing."""
    with open_log(url) as log, log.connect() as connection:
        return [decode_event(body) for body in connection.scalars(text("select body from events order by seq"))]


def count_rows(url: str) -> dict[str, int]:
    """Count the rows of every table."""
    with open_log(url) as log, log.connect() as connection:
        return {name: connection.scalar(text(f"select count(*) from {name}")) for name in schema.metadata.tables}


def kept_rows(log: Path | str) -> dict[str, list[Any]]:
    """Read everything that the runs of a log keep, by kind, but what a clock measured."""
    kinds = (
        "states",
        "objects",
        "frames",
        "source_frames",
        "views",
        "relations",
        "links",
        "hypotheses",
        "cars",
        "streams",
    )
    with open_log(str(log)) as opened:
        found = {kind: [row for run in opened.runs() for row in getattr(opened, kind)(run.id)] for kind in kinds}
        with opened.connect() as connection:
            found["events"] = list(map(tuple, connection.execute(text("select * from events order by seq"))))
    return found


def read_all(url: str, wanted: EventFilter | None = None) -> list[EventRecord]:
    """Read all events of a filter."""
    with open_log(url) as log:
        return [decode_event(text) for text in iterate_events(log, wanted or EventFilter())]


def event_of_row(row: Mapping[str, str]) -> EventRecord:
    """Read an event back from its row of a CSV file."""
    roles = {
        column.removeprefix("role."): actor for column, actor in row.items() if column.startswith("role.") and actor
    }
    place = Place(row["place_road"], float(row["place_x_m"]), float(row["place_y_m"])) if row["place_x_m"] else None
    plain = {
        "chronicle": ChronicleRef(row["chronicle"], row["version"]),
        "roles": roles,
        "place": place,
        "revises": row["revises"] or None,
        "confidence": float(row["confidence"]),
        "hypotheses": msgspec.json.decode(row["hypotheses"], type=tuple[str, ...]),
        "sub_events": msgspec.json.decode(row["sub_events"], type=tuple[SubEvent, ...]),
        **{column: int(row[column]) for column in ("seq", "start_us", "end_us", "recognised_us")},
        **{column: row[column] for column in ("id", "type", "source", "run", "start", "end", "status")},
    }
    return msgspec.convert(plain, EventRecord)
