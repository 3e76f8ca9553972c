"""Does the tutorial lead from a video to an event? Its files are written and its commands run, in its order."""

import json
import re
import shlex
from pathlib import Path
from typing import Any  # JSON

import pytest

from service.api.app import create_app
from service.cli.app import run
from tests.clips import first_seconds
from tests.conftest import Demo
from tests.docs.commands import ROOT, block_commands, fenced
from tests.service.http import Client

PAGE = ROOT / "docs" / "tutorial.md"
TEXT = PAGE.read_text(encoding="utf-8")
NUMBER = re.compile(r"\d+\.\d+")
FRAME_S = 0.04


def assert_shown(printed: str) -> None:
    """Expect the block of the page that begins with the first line, but for numbers a frame off."""
    first = printed.splitlines()[0]
    (shown,) = (block for block in fenced(PAGE, "") if block.startswith(first))
    came = "".join(printed.splitlines(keepends=True)[: len(shown.splitlines())])
    assert NUMBER.sub("N", came) == NUMBER.sub("N", shown)
    numbers = [[float(one) for one in NUMBER.findall(text)] for text in (came, shown)]
    assert numbers[0] == pytest.approx(numbers[1], abs=FRAME_S)


def first_overtake(capsys: pytest.CaptureFixture[str]) -> str:
    assert run(["events", "road.db", "--type", "overtake", "--json"]) == 0
    return str(json.loads(capsys.readouterr().out)["items"][0]["id"])


def ask(client: Client, words: list[str], event: str) -> dict[str, Any]:
    """Do what a line with `curl` does."""
    *options, url = words
    path = re.sub(r"\w+\.\.\.-\d+", event, url.removeprefix("http://127.0.0.1:8420"))
    if not options:
        answer = client.get(path)
    else:
        assert options[0] == "--data-binary"
        answer = client.request("POST", path, content=Path(options[1].removeprefix("@")).read_bytes())
    assert answer.status_code == 200, answer.text
    return answer.json()  # type: ignore[no-any-return]


@pytest.mark.long
def test_the_tutorial_leads_from_a_video_to_an_event_of_its_own(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str], demo: Demo
) -> None:
    monkeypatch.chdir(tmp_path)
    files = re.findall(r"`([\w.]+)`(?: says [^`]*|):\n\n```\w+\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)
    assert [name for name, _ in files] == ["points.csv", "lanes.csv", "twice.chronicle"]
    for name, text in files:
        Path(name).write_text(text, encoding="utf-8")
    generate, *commands = [list(one.words) for one in block_commands(PAGE)]
    assert generate == ["generate", "rural_overtaking", "--seed", "3", "--seconds", "10", "--out", "mine"]
    Path("mine").mkdir()
    first_seconds(demo.scene / "video.mp4", Path("mine/video.mp4"), 10)  # it is the demo's road, with more to come
    serve = commands.pop()
    assert serve[:2] == ["serve", "road.db"]
    event = ""
    for words in commands:
        assert run([event if word == "EVENT" else word for word in words]) == 0, (words, capsys.readouterr().err)
        printed = capsys.readouterr().out
        if words[0] in ("recognise", "why-not"):
            assert_shown(printed)
        event = first_overtake(capsys) if words[0] == "process" else event
    assert all(Path(name).stat().st_size > 10_000 for name in ("still.png", "check.png", "moment.jpg"))
    asked = [shlex.split(line) for line in re.findall(r"^    curl (.*)$", TEXT, re.MULTILINE)]
    with Client(create_app(str(tmp_path / "road.db"))) as client:  # its processes may have begun elsewhere
        events, why, why_not, findings = (ask(client, words, event) for words in asked)
    assert [one["roles"]["overtaken"] for one in events["items"]] == ["car5", "car14", "car13"]
    assert why["event"] == event
    assert why_not["near_misses"] != []
    assert findings == {"findings": []}
