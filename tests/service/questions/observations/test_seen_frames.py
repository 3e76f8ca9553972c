"""Cars come out of a log as the relations of its run had them."""

from pathlib import Path

from qsr.changes.line_up import Seen
from service.questions.observations.computed_relations import seen_frames
from service.records.seen import LinkKind, LinkRecord
from service.store.log import open_log
from tests.service.logs import run, state

FRAMES_US = range(0, 60_000_000, 80_000)


def shown(path: Path, rows_us: dict[str, range], links: list[tuple[int, LinkKind, str]]) -> dict[int, Seen]:
    """Write a log with rows of cars at some times, and read it."""
    with open_log(str(path), "w") as log:
        writer = log.begin_run(run())
        writer.append_frames(list(FRAMES_US))
        for car, times_us in rows_us.items():
            writer.append_states([state(t_us, car, t_us / 1e6) for t_us in times_us])
        writer.append([LinkRecord(t_us, kind, "car", "r1", car) for t_us, kind, car in links])
        writer.finish("finished")
    with open_log(str(path)) as log:
        frames = [one for some in seen_frames(log, log.run(), None, tolerance_m=1.0) for one in some]
    assert [one.footprints.t_us for one in frames] == list(FRAMES_US)
    return {one.footprints.t_us: one for one in frames}


STEP_US = 80_000


def there_us(frames: dict[int, Seen], car: str) -> list[int]:
    return [t_us for t_us, one in frames.items() if car in one.footprints.ids]


def test_a_car_is_there_while_it_has_its_name(tmp_path: Path) -> None:
    rows_us = {"car1": range(8_000_000, 40_000_000, STEP_US), "car2": range(0, 59_000_000, STEP_US)}
    links: list[tuple[int, LinkKind, str]] = [
        (9_600_000, "established", "car1"),
        (20_000_000, "refuted", "car1"),
        (28_000_000, "reestablished", "car1"),
        (36_000_000, "ended", "car1"),
    ]
    frames = shown(tmp_path / "a.db", rows_us, links)
    assert there_us(frames, "car2") == list(rows_us["car2"])
    assert there_us(frames, "car1") == [
        *range(9_600_000, 20_000_000, STEP_US),
        *range(28_000_000, 36_000_000, STEP_US),
    ]
    # What it did before it had its name is told when it gets it.
    told = {t_us: [then.t_us for then in one.filled] for t_us, one in frames.items() if one.filled}
    assert told == {
        9_600_000: list(range(8_000_000, 9_600_000, STEP_US)),
        28_000_000: list(range(20_000_000, 28_000_000, STEP_US)),
    }


def test_a_car_without_rows_stands_unseen_where_it_was(tmp_path: Path) -> None:
    rows_us = {"car1": range(0, 50_000_000, 24_960_000), "car2": range(40_000_000, 40_080_001, STEP_US)}
    frames = shown(tmp_path / "a.db", rows_us, [])
    assert there_us(frames, "car1") == list(range(0, 49_920_001, STEP_US))
    for t_us, one in frames.items():
        if "car1" in one.footprints.ids:
            row = one.footprints.ids.index("car1")
            assert one.footprints.observed[row] == (t_us in rows_us["car1"])
            assert one.footprints.centre_m[row, 0] == t_us // 24_960_000 * 24.96
    assert there_us(frames, "car2") == [40_000_000, 40_080_000]


def test_frames_in_which_nobody_is_are_shown(tmp_path: Path) -> None:
    assert not any(one.footprints.ids for one in shown(tmp_path / "a.db", {}, []).values())
