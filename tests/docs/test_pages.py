"""Are the addresses, columns and objects that the pages show those of a log?"""

import json
import re

import pytest

from service.api.app import create_app
from service.cli.app import run
from tests.conftest import Demo
from tests.docs.commands import PAGES, ROOT
from tests.service.http import Client

DOCS = ROOT / "docs"


def first_event(demo: Demo, capsys: pytest.CaptureFixture[str]) -> dict[str, object]:
    assert run(["events", str(demo.log), "--type", "overtake", "--format", "jsonl"]) == 0
    event: dict[str, object] = json.loads(capsys.readouterr().out.splitlines()[0])
    return event


@pytest.mark.long
def test_every_address_of_the_pages_is_answered(demo: Demo, capsys: pytest.CaptureFixture[str]) -> None:
    event = str(first_event(demo, capsys)["id"])
    shown = [
        path
        for page in PAGES
        for path in re.findall(
            r"^ *(?:\$ )?curl 'http://127\.0\.0\.1:8420(/.*?)'", page.read_text("utf-8"), re.MULTILINE
        )
    ]
    assert len(shown) >= 4
    with Client(create_app(str(demo.log))) as client:
        codes = {path: client.get(re.sub(r"[0-9a-f]+\.\.\.-\d+", event, path)).status_code for path in shown}
    assert [(path, code) for path, code in codes.items() if code != 200] == []


def test_the_event_of_the_page_has_the_fields_of_an_event(demo: Demo, capsys: pytest.CaptureFixture[str]) -> None:
    (block,) = re.findall(r"## An event\n\n((?: {4}.*\n)+)", (DOCS / "event_log.md").read_text(encoding="utf-8"))
    shown, event = json.loads(block), first_event(demo, capsys)
    assert list(shown) == list(event)
    for name in ("chronicle", "place"):
        assert list(shown[name]) == list(event[name])  # type: ignore[call-overload]


def test_columns_of_tracks_are_those_of_the_page(demo: Demo, capsys: pytest.CaptureFixture[str]) -> None:
    page = (DOCS / "cli.md").read_text(encoding="utf-8")
    (columns,) = re.findall(r"^`(t_us,id,.*?)`", page, re.MULTILINE)
    assert run(["tracks", str(demo.log), "--car", "car3"]) == 0
    assert capsys.readouterr().out.splitlines()[0] == columns
    (fields,) = re.findall(r"has `(frame,id,.*?)`", page)
    assert run(["tracks", str(demo.log), "--format", "mot"]) == 0
    row = capsys.readouterr().out.splitlines()[0].split(",")
    assert (len(row), row[-3:]) == (len(fields.split(",")), ["-1", "-1", "-1"])
