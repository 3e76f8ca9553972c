"""Does the README show what there is? Its commands are run in order, and what they print is compared."""

import json
import re
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from service.api.app import create_app
from service.cli.app import run
from tests.clips import first_seconds
from tests.conftest import Demo
from tests.docs.commands import README, ROOT, block_commands, fenced
from tests.service.http import Client

TEXT = README.read_text(encoding="utf-8")
FRAME_S, PLACE_M = 0.04, 0.05
# Digests, and what counts the events of the rest of the demo, which is not made here.
MASKED = {"id", "run", "version", "next_cursor", "as_of_seq", "spans_us"}
GOLDEN_CLIP = ROOT / "tests" / "golden" / "rural_video"
# What a reader would wait for, and where a test need not.
SHORTER = {"240": ["2"], "drawn.mp4": ["drawn.mp4", "--to", "1s"]}
JUNCTION_S = 7  # with the first overtake
# The test of the answer over HTTP asks the same application as `serve`; `watch` has tests with a camera of their own.
NOT_RUN = {"serve", "watch"}


def masked(value: object, name: str = "") -> object:
    """Put the type in place of a digest, and cut calendar times to the minute: the microseconds say the rest."""
    if name in MASKED:
        return type(value).__name__
    if isinstance(value, dict):
        return {key: masked(one, key) for key, one in value.items()}
    if isinstance(value, list):
        return [masked(one, name) for one in value]
    return str(value)[:16] if name in ("start", "end") else value


def near(value: object, name: str = "") -> object:
    """Expect times within a frame, and places as near as vision is."""
    if isinstance(value, dict):
        return {key: near(one, key) for key, one in value.items()}
    if isinstance(value, list):
        return [near(one, name) for one in value]
    if name.endswith("_us"):
        return pytest.approx(value, abs=FRAME_S * 1e6)
    return pytest.approx(value, abs=PLACE_M) if isinstance(value, float) else value


@pytest.mark.long
def test_the_commands_of_the_readme_run_in_order(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    first_seconds(GOLDEN_CLIP / "video.mp4", Path("junction.mp4"), JUNCTION_S)
    shutil.copy(GOLDEN_CLIP / "network.net.xml", "network.net.xml")
    shutil.copy(GOLDEN_CLIP / "site.toml", "junction.toml")
    shutil.copytree(ROOT / "examples", "examples")
    shown = block_commands(README)
    assert {one.words[0] for one in shown} >= {
        "process",
        "events",
        "draw",
        "recognise",
        "explain",
        "why-not",
        "evaluate",
    }
    event = ""
    for one in shown:
        if one.words[0] in NOT_RUN:
            continue
        words = [part for word in one.words for part in SHORTER.get(word, [word])]
        words = [event if word == "EVENT" else word for word in words]
        code = run(words)
        captured = capsys.readouterr()
        assert code == 0, (one, captured.err)
        if words[0] == "process" and "junction.db" in words:
            assert run(["events", "junction.db", "--type", "overtake", "--format", "jsonl"]) == 0
            event = json.loads(capsys.readouterr().out.splitlines()[0])["id"]
        if words[0] == "explain":
            assert re.match(
                r"overtake\[overtaker=car3, overtaken=\w+, road=eastbound\] from .* was recognised", captured.out
            )
    assert Path("drawn.mp4").stat().st_size > 10_000


def assert_shown(came: Sequence[str], shown: Sequence[str]) -> None:
    """Expect the same lines, but for times within a frame."""
    times = re.compile(r"\d\d:(\d\d\.\d{3})|(\d\.\d{3})(?= s)")
    assert [times.sub("T", line) for line in came] == [times.sub("T", line) for line in shown]
    found_s, shown_s = ([_seconds(one) for line in lines for one in times.finditer(line)] for lines in (came, shown))
    assert found_s == pytest.approx(shown_s, abs=FRAME_S)


def table_of(printed: str) -> list[str]:
    """Give what the demo prints of its overtakes."""
    lines = printed.splitlines()
    return lines[next(number for number, line in enumerate(lines) if line.startswith("recognised ")) :]


def test_the_demo_prints_what_the_readme_shows(demo: Demo) -> None:
    """The rows of the overtakes that are over when the demo of the tests ends, and that they are all."""
    (shown,) = (block.splitlines() for block in fenced(README, "") if block.startswith("recognised"))
    came = table_of(demo.printed)
    count = came.index("") - 1
    assert count >= 4
    assert_shown(came[: count + 1], shown[: count + 1])
    assert came[count + 2] == f"overtake: {count} right, 0 wrong, 0 missed, 0 at the border"
    assert [line.split()[0] for line in came[count + 2 : count + 6]] == [line.split()[0] for line in shown[-4:]]


@pytest.mark.slow
def test_the_whole_demo_prints_all_that_the_readme_shows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (shown,) = (block.splitlines() for block in fenced(README, "") if block.startswith("recognised"))
    assert run(["demo", "--out", str(tmp_path), "--seconds", "36"]) == 0
    assert_shown(table_of(capsys.readouterr().out)[: len(shown)], shown)


def test_the_answer_over_http_is_what_the_readme_shows(demo: Demo) -> None:
    (block,) = fenced(README, "json")
    (path,) = re.findall(r"curl 'http://127\.0\.0\.1:8420(.*?)'", TEXT)
    shown = json.loads(block)
    with Client(create_app(str(demo.log))) as client:
        came = client.get(path).json()
    assert masked(came) == near(masked(shown))
    assert list(came["items"][0]) == list(shown["items"][0])


def test_the_chronicle_of_the_readme_is_checked_tested_and_asked_of_a_log_of_the_library(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, demo: Demo
) -> None:
    monkeypatch.chdir(tmp_path)
    (block,) = (block for block in fenced(README, "") if "chronicle follow[" in block)
    Path("follow.chronicle").write_text(block, encoding="utf-8")
    assert block.strip() in (ROOT / "examples" / "follow.chronicle").read_text(encoding="utf-8")
    assert run(["check", "follow.chronicle"]) == 0
    assert run(["test", str(ROOT / "examples" / "follow.chronicle")]) == 0
    capsys.readouterr()
    assert run(["recognise", str(demo.log), "--chronicles", "follow.chronicle", "--format", "jsonl"]) == 0
    assert {json.loads(line)["chronicle"]["name"] for line in capsys.readouterr().out.splitlines()} == {"follow"}


def test_site_columns_chronicle_and_monitor_of_the_readme_go_together(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    (site,) = fenced(README, "toml")
    (chronicle,) = (block for block in fenced(README, "") if "chronicle follow[" in block)
    (rules,) = (block for block in fenced(README, "") if block.startswith("monitor "))
    for name, text in (("site.toml", site), ("follow.chronicle", chronicle), ("rules.monitors", rules)):
        Path(name).write_text(text, encoding="utf-8")
    (columns,) = re.findall(r"A CSV file with `(t_s, id, .*?)`", TEXT)
    (renamed,) = re.findall(r"`--columns (t_s=time,x_m=x)`", TEXT)
    names = [dict(part.split("=") for part in renamed.split(",")).get(one, one) for one in columns.split(", ")]
    row: Mapping[str, object] = {"heading_rad": 1.5708, "length_m": 4.5, "width_m": 1.8}
    lines = [",".join(names)]
    for step in range(100):
        for car, from_m, speed_mps in (("a", -180.0, 26.0), ("b", -146.0, 24.0)):  # a closes up to b
            moved = {"y_m": from_m + speed_mps * step / 10, "speed_mps": speed_mps}
            cells = row | moved | {"time": step / 10, "id": car, "x": 1.75}
            lines.append(",".join(str(cells[name]) for name in names))
    Path("tracks.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    words = ["process", "tracks.csv", "--site", "site.toml", "--log", "log.db", "--columns", renamed]
    assert run([*words, "--chronicles", "follow.chronicle", "--monitors", "rules.monitors"]) == 0
    capsys.readouterr()
    assert run(["events", "log.db", "--format", "jsonl"]) == 0
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert {(event["type"], *event["roles"].values()) for event in events} >= {
        ("follow", "car1", "car2"),
        ("limit_violated", "car1"),
        ("limit_violated", "car2"),
    }


def test_every_file_that_the_readme_links_to_is_there() -> None:
    links = re.findall(r"\]\(([\w./]+)\)", TEXT)
    assert len(links) > 20
    assert [link for link in links if not (ROOT / link).exists()] == []


def _seconds(found: re.Match[str]) -> float:
    return float(found[1] or found[2])
