"""Trajectories from a file, a pipe or standard input become one and the same run, with the classes that they name."""

import io
import os
import sys
import threading
from pathlib import Path

import pytest

from service.cli.app import run
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.store.log import open_log
from tests.service.tracks import write_tracks


def classed(path: Path, word: str) -> Path:
    """Write a car-sized body of 40 frames under a class."""
    header, *rows = write_tracks(path, frames=40).read_text().splitlines()
    path.write_text("\n".join([f"{header},class", *(f"{row},{word}" for row in rows), ""]))
    return path


@pytest.mark.parametrize("word", ["bus", "van", "motorcycle"])
def test_a_class_of_the_input_is_kept_in_cars_states_and_tracks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], word: str
) -> None:
    log = tmp_path / "a.db"
    assert run(["process", str(classed(tmp_path / "t.csv", word)), "--log", str(log)]) == 0
    with open_log(str(log)) as opened:
        record = opened.run()
        assert [one.car_class for one in opened.cars(record.id)] == [word]
        assert {one.car_class for one in opened.states(record.id)} == {word}
    capsys.readouterr()
    assert run(["tracks", str(log)]) == 0
    assert {line.split(",")[2] for line in capsys.readouterr().out.splitlines()[1:]} == {word}


def test_without_a_known_class_the_size_decides(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "a.db"
    assert run(["process", str(classed(tmp_path / "t.csv", "tram")), "--log", str(log)]) == 0
    assert "warning: " + str(tmp_path / "t.csv") + ": column class: expected car, " in capsys.readouterr().err
    with open_log(str(log)) as opened:
        assert [one.car_class for one in opened.cars(opened.run().id)] == ["car"]


@pytest.mark.parametrize("name", ["tracks.csv", "pipe"])
def test_a_named_pipe_is_read_once(tmp_path: Path, name: str) -> None:
    text = write_tracks(tmp_path / "plain.csv", frames=20).read_text()
    os.mkfifo(tmp_path / name)
    writer = threading.Thread(target=(tmp_path / name).write_text, args=(text,))
    writer.start()
    assert run(["process", str(tmp_path / name), "--log", str(tmp_path / "a.db")]) == 0
    writer.join()
    with open_log(str(tmp_path / "a.db")) as log:
        assert len(list(log.states(log.run().id))) > 0


@pytest.mark.parametrize("name", ["-", "/dev/stdin"])
def test_standard_input_is_read_as_trajectories(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    data = write_tracks(tmp_path / "plain.csv", frames=20).read_bytes()
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))
    assert run(["process", name, "--log", str(tmp_path / "a.db")]) == 0
    with open_log(str(tmp_path / "a.db")) as log:
        assert (log.run().source, log.run().status) == ("stdin", "finished")


def test_the_same_bytes_give_the_same_run_whichever_way_they_come(tmp_path: Path) -> None:
    plain = write_tracks(tmp_path / "t.csv", frames=20)
    assert run(["process", str(plain), "--log", str(tmp_path / "a.db")]) == 0
    text = plain.read_text()
    plain.unlink()
    os.mkfifo(plain)
    writer = threading.Thread(target=plain.write_text, args=(text,))
    writer.start()
    assert run(["process", str(plain), "--log", str(tmp_path / "b.db")]) == 0
    writer.join()
    with open_log(str(tmp_path / "a.db")) as one, open_log(str(tmp_path / "b.db")) as other:
        assert one.run().id == other.run().id


@pytest.mark.long
def test_dating_names_back_adds_rows_of_cars_with_which_their_relations_begin(tmp_path: Path) -> None:
    folder = Path(__file__).parents[2] / "golden" / "junction_tracks"
    site = (folder / "site.toml").read_text().replace('"network', f'"{folder}/network')
    header, *rows = (folder / "tracks.csv").read_text().splitlines()
    early = [row for row in rows if int(row.split(",")[header.split(",").index("t_us")]) < 10_000_000]
    (tmp_path / "tracks.csv").write_text("\n".join([header, *early, ""]))
    logs = []
    for text in ("", "[anchoring]\nname_back_us = 0\n"):
        (tmp_path / f"site{len(text)}.toml").write_text(f"{site}\n{text}")
        log = str(tmp_path / f"{len(text)}.db")
        assert (
            run(
                [
                    "process",
                    str(tmp_path / "tracks.csv"),
                    "--site",
                    str(tmp_path / f"site{len(text)}.toml"),
                    "--log",
                    log,
                ]
            )
            == 0
        )
        logs.append(log)
    with open_log(logs[0]) as dated, open_log(logs[1]) as plain:
        one, other = dated.run().id, plain.run().id
        states, fewer = list(dated.states(one)), list(plain.states(other))
        assert set(map(repr, fewer)) < set(map(repr, states))
        assert len(states) - len(fewer) >= 50
        relations = list(dated.relations(one)), list(plain.relations(other))
        begins_us, later_us = ({(r.name, r.args): r.t_us for r in reversed(list(found))} for found in relations)
        assert begins_us.keys() >= later_us.keys()
        earlier_us = [at_us - begins_us[relation] for relation, at_us in later_us.items()]
        assert min(earlier_us) >= 0
        assert sum(one == 400_000 for one in earlier_us) > 0.4 * len(earlier_us)  # the others are near only later
        most_us = [max(one.decided_us - one.t_us for one in found) for found in relations]
        assert most_us[0] == most_us[1]
        assert list(dated.links(one)) == list(plain.links(other))
        texts = [[decode_event(text) for text in iterate_events(log, EventFilter())] for log in (dated, plain)]
        told = [[(e.type, e.roles, e.end_us, e.recognised_us) for e in found] for found in texts]
        assert told[0] == told[1]
        assert len(told[0]) > 10
        assert {mine.start_us - late.start_us for mine, late in zip(*texts, strict=True)} == {-400_000, 0}
        first_us = {car.car: car.first_us for car in dated.cars(one)}
        assert first_us == {car: min(s.t_us for s in states if s.car == car) for car in first_us}
