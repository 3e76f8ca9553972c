"""`dyknow streams`: what ran in a run, and what is declared to run."""

import json
import re
import sqlite3
from pathlib import Path

import pytest

from service.cli.app import run
from service.runs.graph.pipeline import TRAJECTORIES, shipped_kpl
from service.runs.processing import RunRequest, process
from service.store.log import open_log
from tests.service.logs import write_small_log
from tests.service.runs.graph.test_stream_processes import run_race, write_race

LABELS = ["vision_objects", "cars", "relations", "states", "verdicts", "occurrences"]


def stored_rows(log: Path) -> list[tuple[object, ...]]:
    with sqlite3.connect(log) as connection:
        return connection.execute("select * from streams order by run_no, number").fetchall()


def forget_reports(log: Path) -> None:
    """Make a log of a run that was killed."""
    with sqlite3.connect(log) as connection:
        connection.execute("delete from streams")


def run_limited(folder: Path) -> Path:
    """Process the race under a text that gives the relations only the first five seconds."""
    kpl, log = folder / "mine.kpl", folder / "log.db"
    text = shipped_kpl(TRAJECTORIES).text
    kpl.write_text(text.replace("qsr(cars with strict order)", "qsr(cars with from 0s to 5s, strict order)"))
    process(RunRequest(input=write_race(folder / "race.csv"), site=None, log_url=str(log), kpl_file=kpl))
    return log


# ---- of a run


@pytest.mark.long
def test_the_report_of_the_node_is_stored_with_the_run(tmp_path: Path) -> None:
    race, url = write_race(tmp_path / "race.csv"), str(tmp_path / "log.db")
    summary = process(RunRequest(input=race, site=None, log_url=url))
    with open_log(url) as log:
        stored = log.streams(summary.run)
    assert [(one.label, one.kind, one.published, one.updates, one.last_value) for one in stored] == [
        (one.label, one.kind, one.published, one.updates, one.last_value) for one in summary.streams
    ]
    assert [one.made_of for one in stored] == [
        "trajectories",
        "anchoring",
        "qsr",
        "synchronisation",
        "monitoring",
        "chronicles",
    ]


@pytest.mark.long
def test_a_repeated_run_stores_the_same_report_again(tmp_path: Path) -> None:
    run_race(tmp_path, "")
    before = stored_rows(tmp_path / "log.db")
    run_race(tmp_path, "")
    assert stored_rows(tmp_path / "log.db") == before
    assert len(before) == len(LABELS)


def test_every_process_is_listed_with_what_it_reads(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["streams", run_race(tmp_path, "")]) == 0
    title, *lines = capsys.readouterr().out.splitlines()
    assert title.split("  ")[0] == "label"
    assert [line.split()[0] for line in lines] == LABELS
    assert lines[0].split()[1:9] == ["trajectories", "120", "0", "0", "10.0/s", "0", "ms", "00:11.900"]
    assert title.split() == [
        "label",
        "made",
        "of",
        "reads",
        "published",
        "dropped",
        "queued",
        "rate",
        "lag",
        "cost",
        "last",
        "time",
        "last",
        "value",
    ]
    assert "cars with any update, strict order; relations with any update, strict order" in lines[3]
    assert "Occurrence(chronicle='pass'" in lines[5]


@pytest.mark.long
def test_what_a_policy_drops_is_listed_by_cause(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = run_limited(tmp_path)
    assert run(["streams", str(log)]) == 0
    shown = capsys.readouterr().out
    assert "cars with any update, from 0s to 5s, strict order" in shown
    assert run(["streams", str(log), "--json"]) == 0
    cars = json.loads(capsys.readouterr().out)["streams"][1]
    [(cause, count)] = cars["dropped"].items()
    assert f"{count} ({cause})" in shown
    assert count == 120 - 51  # ten frames a second, both ends of the five seconds included


@pytest.mark.long
def test_json_of_a_run_is_one_object(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["streams", run_race(tmp_path, ""), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found.keys() == {"run", "streams"}
    source = found["streams"][0]
    assert source.pop("last_value").startswith("TrajectoryObjects(")
    assert source == {
        "label": "vision_objects",
        "kind": "source",
        "made_of": "trajectories",
        "type": "VisionObjects",
        "inputs": [],
        "waiting_for": [],
        "published": 120,
        "delivered": 240,
        "dropped": {},
        "subscribers": 2,
        "queued": [],
        "rate_hz": 10.0,
        "lag_us": 0,
        "last_valid_us": 11_900_000,
        "updates": 0,
        "busy_us": 0,
    }
    assert all(one["busy_us"] > 0 for one in found["streams"][1:3])


@pytest.mark.long
def test_a_run_that_is_not_in_the_log_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["streams", run_race(tmp_path, ""), "--run", "none"]) == 3
    assert "expected a run 'none'" in capsys.readouterr().err


def test_a_run_without_a_report_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = write_small_log(tmp_path / "log.db")
    assert run(["streams", url]) == 3
    assert "run 'r1': expected a report of its streams, got none" in capsys.readouterr().err


@pytest.mark.long
def test_a_repeat_of_a_run_without_a_report_tells_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = run_race(tmp_path, "")
    forget_reports(tmp_path / "log.db")
    assert run(["streams", url]) == 3
    assert "expected a report of its streams" in capsys.readouterr().err
    run_race(tmp_path, "")
    assert run(["streams", url]) == 0


@pytest.mark.long
def test_cost_is_told_of_each_process_with_code_and_left_out_where_the_log_has_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    url = run_race(tmp_path, "")
    assert run(["streams", url]) == 0
    costs = [re.findall(r"(\d+\.\d\d) s, (\d+\.\d\d) ms each", line) for line in capsys.readouterr().out.splitlines()]
    [(total_s, each_ms)] = costs[2]
    assert float(total_s) == pytest.approx(120 * float(each_ms) / 1000, abs=0.01)
    assert costs[1] == []
    with sqlite3.connect(tmp_path / "log.db") as connection:
        connection.execute("delete from costs")
    assert run(["streams", url]) == 0
    assert " ms each" not in capsys.readouterr().out


# ---- of a text


def test_without_a_log_the_shipped_declaration_is_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["streams"]) == 0
    rows = [line.split(maxsplit=4) for line in capsys.readouterr().out.splitlines()]
    assert rows[1] == ["frames", "source", "video", "Frame"]
    assert rows[2] == [
        "vision_objects",
        "refinement",
        "vision",
        "VisionObjects",
        "frames with any update, strict order",
    ]
    assert rows[-1] == ["recorded_occurrences", "stream", "occurrences", "with", "any update"]


def test_json_of_a_text_has_processes_and_streams(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.kpl"
    path.write_text("source float gps; strmgen pos = gps; stream seen = pos with any change;")
    assert run(["streams", "--kpl", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "kpl": str(path),
        "processes": [{"label": "pos", "kind": "source", "made_of": "gps", "type": "float", "inputs": []}],
        "streams": [{"name": "seen", "label": "pos", "policy": "any change"}],
        "warnings": [],
    }


def test_every_kind_of_process_of_a_text_is_listed_and_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, graph = tmp_path / "a.kpl", tmp_path / "a.mmd"
    path.write_text("""source float gps; source set(string) operator; configuration follow(set(string));
    strmgen pos = gps; strmgen chosen = operator; strmgen all = collection of float with any change by chosen;
    configure followed = follow(chosen with strict order); stream seen = all;""")
    assert run(["streams", "--kpl", str(path), "--graph", str(graph)]) == 0
    rows = [re.split("  +", line) for line in capsys.readouterr().out.splitlines()]
    assert rows[3:] == [
        ["all", "collection", "collection", "collected(float)", "chosen with any update"],
        ["followed", "configuration", "follow", "chosen with any update, strict order"],
        ["seen", "stream", "all with any update"],
    ]
    drawn = graph.read_text()
    assert all(f"<br/>{what}" in drawn for what in ("source gps", "collection", "configuration follow"))
    assert "samples" not in drawn


def test_a_text_is_checked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.kpl"
    path.write_text("source float gps; strmgen pos = gsp; stream seen = pos;")
    assert run(["streams", "--kpl", str(path)]) == 3
    assert capsys.readouterr().err.startswith("error[K0202]: expected a declared source, got 'gsp'")


def test_warnings_of_a_text_are_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.kpl"
    path.write_text("source float gps; strmgen pos = gps;")
    assert run(["streams", "--kpl", str(path)]) == 0
    assert "K0601" in capsys.readouterr().err


def test_a_text_that_is_missing_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["streams", "--kpl", str(tmp_path / "none.kpl")]) == 3
    assert "none.kpl" in capsys.readouterr().err


# ---- drawn


@pytest.mark.long
def test_a_run_is_drawn_with_what_it_carried(tmp_path: Path) -> None:
    graph = tmp_path / "graph.mmd"
    assert run(["streams", run_race(tmp_path, ""), "--graph", str(graph)]) == 0
    title, *lines = graph.read_text().splitlines()
    assert title == "flowchart LR"
    assert re.findall(r'n\d+\["(\w+)<br/>', "\n".join(lines)) == LABELS
    assert lines[0] == '  n0["vision_objects<br/>source trajectories<br/>120 samples, 10.0/s, lag 0 ms"]'
    assert '  n0 -->|"any update, strict order"| n1' in lines
    assert sum("<br/>busy " in line for line in lines) >= 2


def test_graph_in_the_documentation_is_that_of_the_shipped_text(tmp_path: Path) -> None:
    graph = tmp_path / "graph.mmd"
    assert run(["streams", "--graph", str(graph)]) == 0
    page = Path(__file__).parents[4] / "docs" / "kpl.md"
    assert f"```mermaid\n{graph.read_text()}```" in page.read_text(encoding="utf-8")


def test_a_declaration_is_drawn_with_its_policies(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    graph = tmp_path / "graph.DOT"
    assert run(["streams", "--graph", str(graph)]) == 0
    assert '"frames" -> "vision_objects" [label="any update, strict order"];' in graph.read_text()
    assert capsys.readouterr().err == f"graph: {graph}\n"


def test_a_graph_of_another_kind_is_refused_before_anything_is_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["streams", str(tmp_path / "none.db"), "--graph", str(tmp_path / "graph.svg")]) == 3
    expected = "--graph: expected a path ending in .mmd (Mermaid) or .dot (Graphviz), which other programs draw, got"
    assert expected in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "wrong"), [(["--run", "r1"], "--run"), (["a.db", "--kpl", "a.kpl"], "--kpl")], ids=["run", "kpl"]
)
def test_options_that_do_not_go_together_are_refused(
    arguments: list[str], wrong: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["streams", *arguments]) == 2
    assert f"Invalid value for {wrong}" in capsys.readouterr().err


@pytest.mark.long
def test_the_summary_says_what_is_not_recorded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = shipped_kpl(TRAJECTORIES).text
    for name in ("cars", "verdicts", "occurrences"):
        (line,) = (one for one in text.splitlines() if one.startswith(f"stream recorded_{name} "))
        text = text.replace(line, "")
    kpl, race = tmp_path / "mine.kpl", write_race(tmp_path / "race.csv")
    kpl.write_text(text)
    options = ["process", str(race), "--kpl", str(kpl), "--log", str(tmp_path / "log.db")]
    assert run(options) == 0
    assert "real time): cars not recorded, events not recorded\n" in capsys.readouterr().out
    assert run([*options, "--json"]) == 0
    summary = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (summary["cars"], summary["events"]) == (None, None)


def test_warnings_of_a_text_are_shown_after_the_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kpl, race = tmp_path / "mine.kpl", write_race(tmp_path / "race.csv", frames=5)
    kpl.write_text(shipped_kpl(TRAJECTORIES).text + "strmgen spare = trajectories;\n")
    assert run(["process", str(race), "--kpl", str(kpl), "--log", str(tmp_path / "log.db")]) == 0
    lines = capsys.readouterr().err.splitlines()
    assert "warning[K0601]: label 'spare' is read by no unit and no stream" in lines


@pytest.mark.long
def test_a_sampled_run_is_that_of_the_sampled_frames(tmp_path: Path) -> None:
    """The race has ten frames a second: every fifth one is what sampling twice a second leaves."""
    race, few, kpl = write_race(tmp_path / "race.csv"), tmp_path / "few.csv", tmp_path / "mine.kpl"
    head, *rows = race.read_text().splitlines()
    few.write_text("\n".join([head, *(row for row in rows if int(row.split(",")[0]) % 500_000 == 0), ""]))
    whole = "anchoring(vision_objects with strict order)"
    text = shipped_kpl(TRAJECTORIES).text
    assert whole in text
    kpl.write_text(text.replace(whole, whole.replace("with", "with sample every 500ms, use most recent,")))
    found = []
    for path, own in ((few, None), (race, kpl)):
        url = f"sqlite:///{tmp_path / path.stem}.db"
        run_id = process(RunRequest(input=path, site=None, log_url=url, kpl_file=own)).run
        with open_log(url) as log:
            found.append((list(log.states(run_id)), list(log.relations(run_id))))
    assert found[0] == found[1]
    assert len(found[0][0]) > 20
    assert found[0][1]
