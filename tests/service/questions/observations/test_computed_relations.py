"""Relations that a run did not watch are those of a run that did, or it is said why they cannot be had."""

import re
import shutil
import sqlite3
from pathlib import Path

import msgspec
import pytest

from chronicles import library
from service.cli.app import run
from service.errors import InputError, LogError
from service.questions.observations.stored_events import Unwatched, relations_of, streamed_events, unwatched_relations
from service.questions.recognition import stored_recognition
from service.records.runs import RunRecord
from service.records.seen import RelationRecord
from service.runs.processing import RunRequest, process
from service.store.log import open_log
from service.texts.chronicle_files import load_chronicle_files

ATTRIBUTES = re.findall(r"^attribute (\w+)(\[[^\]]*\])", library.relations_text(), re.MULTILINE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make tracks of a road, a log of them that watched all relations, and one that watched one."""
    folder = tmp_path_factory.mktemp("tracks")
    tracks = folder / "tracks.csv"
    assert run(["trajectories", "rural_overtaking", "--out", str(tracks), "--seed", "3", "--seconds", "34"]) == 0
    every = [
        f"chronicle w_{name}[?x](t1) {{ event({name}[?x{args[args.index(',') :] if ',' in args else ']'}:(?, ?), t1) }}"
        for name, args in ATTRIBUTES
    ]
    (folder / "every.chronicle").write_text("\n".join(every))
    (folder / "one.chronicle").write_text(every[0])
    for name in ("every", "one"):
        site, log = folder / "site.toml", str(folder / f"{name}.db")
        process(RunRequest(tracks, site, log, chronicle_files=(folder / f"{name}.chronicle",)))
    return folder


def _sorted(changes: list[RelationRecord]) -> list[RelationRecord]:
    without = [msgspec.structs.replace(one, hypotheses=()) for one in changes]
    return sorted(without, key=lambda one: (one.decided_us, one.t_us, one.name, one.args))


@pytest.mark.long
def test_they_are_those_of_a_run_that_watched_them(folder: Path) -> None:
    names = [name for name, _ in ATTRIBUTES]
    with open_log(str(folder / "every.db")) as every, open_log(str(folder / "one.db")) as one:
        (watched,) = one.run().relations
        expected = [change for change in every.relations(every.run().id) if change.name != watched]
        assert _sorted(list(unwatched_relations(one, one.run(), names).changes)) == _sorted(expected)
        assert len(expected) > 1000
        assert unwatched_relations(every, every.run(), names) == Unwatched()


@pytest.mark.long
def test_what_is_recognised_does_not_depend_on_how_much_is_at_hand(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["recognise", str(folder / "one.db"), "--format", "jsonl", "--evidence"]
    assert run(asked) == 0
    at_hand = capsys.readouterr().out
    monkeypatch.setattr(stored_recognition, "_MOST_AT_HAND", 100)
    assert run(asked) == 0
    assert capsys.readouterr() == (at_hand, "")
    assert len(at_hand.splitlines()) > 5
    with open_log(str(folder / "one.db")) as log:
        names = relations_of(load_chronicle_files(()).merged)
        unwatched = [unwatched_relations(log, log.run(), names) for _ in range(2)]
        decided, in_time = (
            list(streamed_events(log, log.run().id, names, one, in_time=is_one))
            for one, is_one in zip(unwatched, (False, True), strict=True)
        )
    assert in_time == sorted(decided, key=lambda event: event.t_us) != decided


@pytest.mark.long
def test_in_a_window_they_are_those_of_the_cars_that_come_in_it(folder: Path) -> None:
    names, from_us, to_us = ["close", "behind", "on", "moving"], 10_000_000, 32_000_000
    with open_log(str(folder / "one.db")) as log:
        there = {one.car for one in log.cars(log.run().id) if one.first_us < from_us}
        whole, part = (
            [
                one
                for one in unwatched_relations(log, log.run(), names, None, window_us).changes
                if there.isdisjoint(one.args) and one.decided_us < to_us
            ]
            for window_us in ((None, None), (from_us, to_us))
        )
    assert whole == part
    assert len(part) > 5


@pytest.mark.long
def test_cars_are_there_again_after_frames_that_are_damaged(folder: Path, tmp_path: Path) -> None:
    shutil.copy(folder / "one.db", tmp_path / "one.db")
    with sqlite3.connect(tmp_path / "one.db") as connection:
        connection.execute("update chunks set data = x'00' where kind = 'frames' and span_us = 10000000")
    connection.close()
    with open_log(str(folder / "one.db")) as whole, open_log(str(tmp_path / "one.db")) as damaged:
        decided_us = [
            {one.decided_us for one in unwatched_relations(log, log.run(), ["close", "behind", "on"]).changes}
            for log in (whole, damaged)
        ]
    early = [{t_us for t_us in some if t_us < 10_000_000} for some in decided_us]
    assert early[0] == early[1]
    assert not any(10_000_000 <= t_us < 20_000_000 for t_us in decided_us[1])
    late = [{t_us for t_us in some if t_us > 25_000_000} for some in decided_us]
    assert len(late[0] & late[1]) > 0.9 * len(late[0]) > 5


@pytest.mark.long
def test_the_site_may_have_moved_but_must_be_the_same(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    moved, log = tmp_path / "moved", str(tmp_path / "one.db")
    shutil.copytree(folder, moved)
    tracks, site = tmp_path / "tracks.csv", tmp_path / "site.toml"
    for name in ("tracks.csv", "site.toml", "network.net.xml", "one.chronicle"):
        shutil.copy(folder / name, tmp_path / name)
    tracks.write_text("".join(tracks.read_text().splitlines(keepends=True)[:2500]))
    process(RunRequest(tracks, site, log, chronicle_files=(tmp_path / "one.chronicle",)))
    asked = ["recognise", log, "--chronicles", str(folder / "every.chronicle"), "--format", "jsonl"]
    assert run(asked) == 0
    before = capsys.readouterr().out
    site.unlink()
    assert run(asked) == 3
    assert f"got no file {str(site)!r}; say where it is with --site" in capsys.readouterr().err
    assert run([*asked, "--site", str(moved / "site.toml")]) == 0
    assert capsys.readouterr().out == before
    network = moved / "network.net.xml"
    network.write_text(network.read_text().replace("</net>", "<!-- later --></net>"))
    assert run([*asked, "--site", str(moved / "site.toml")]) == 3
    assert "as it was, to compute " in capsys.readouterr().err


def test_a_log_that_knows_no_site_file_or_thins_its_cars_is_refused(tmp_path: Path) -> None:
    with open_log(str(tmp_path / "a.db"), "w") as log:
        for number, fields in enumerate(({"site": "bend"}, {"kpl": "stream x"})):
            record = RunRecord(id=f"r{number}", source="a.mp4", start_utc_us=0, **fields)
            log.begin_run(record).finish("finished")
        with pytest.raises(
            InputError, match=r"site file of 'bend' as it was, to compute close .* none in this older log"
        ):
            unwatched_relations(log, log.run("r0"), ["close"])
        with pytest.raises(LogError, match="expected one that watched close, got one that watched none and whose"):
            unwatched_relations(log, log.run("r1"), ["close"])


def test_a_file_of_events_has_no_site(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    events, text = tmp_path / "a.jsonl", tmp_path / "a.chronicle"
    events.write_text('{"t_us": 0, "name": "honk", "args": ["a"]}\n')
    text.write_text("chronicle loud[?a](t1) { event(honk[?a], t1) }")
    (tmp_path / "site.toml").write_text('name = "bend"')
    assert run(["recognise", str(events), "--chronicles", str(text), "--site", str(tmp_path / "site.toml")]) == 2
    assert "--site: expected a log to go with it, got a file of events" in capsys.readouterr().err
