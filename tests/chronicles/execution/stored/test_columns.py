"""Events kept as columns."""

from chronicles.events import Event
from chronicles.execution.stored.columns import NO_CODE, EventColumns

EVENTS = [
    Event("enter", ("car2",), 7, hypotheses=("h1",)),
    Event("near", ("car1", "car2"), 5, "false", "true"),
    Event("enter", ("car1",), 5),
    Event("near", ("car1", "car2"), 5, None, "true"),
    Event("enter", (), 1),
]


def test_events_stand_in_the_order_of_time_and_as_given_where_simultaneous() -> None:
    columns = EventColumns.from_events(EVENTS)
    assert [id(one) for one in columns.events] == [id(EVENTS[place]) for place in (4, 1, 2, 3, 0)]
    assert len(columns) == 5


def test_each_kind_of_event_has_a_table() -> None:
    columns = EventColumns.from_events(EVENTS)
    near = columns.table(("near", 2, True))
    assert near.t_us.tolist() == [5, 5]
    assert near.sequence.tolist() == [1, 3]
    assert [[columns.texts[code] for code in row] for row in near.codes.tolist()] == [
        ["car1", "car2", "false", "true"],
        ["car1", "car2", "unknown", "true"],
    ]
    kinds = (("enter", 0, False), ("enter", 1, False), ("enter", 1, True))
    assert [len(columns.table(kind)) for kind in kinds] == [1, 2, 0]


def test_codes_do_not_change_when_other_tables_are_asked_for() -> None:
    columns = EventColumns.from_events([*EVENTS, Event("left", ("car9",), 9, "on", "off")])
    before = columns.table(("near", 2, True)).codes.tolist()
    columns.table(("left", 1, True))
    assert columns.table(("near", 2, True)).codes.tolist() == before
    assert [columns.code(text) for text in ("unknown", "car1", "off", "car77")] == [0, 1, 7, NO_CODE]


def test_no_events_make_empty_columns() -> None:
    columns = EventColumns.from_events([])
    assert (len(columns), list(columns.events), len(columns.table(("near", 2, True)))) == (0, [], 0)
