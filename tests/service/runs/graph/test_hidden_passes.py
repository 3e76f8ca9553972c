"""A car passes another one while nobody sees it: is what the log tells in the end what its stored changes amount to?"""

from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from chronicles.events import Occurrence
from service.cli.app import run
from service.questions.recognition.stored_recognition import recognise_stored
from service.records.events import EventRecord
from tests.service.logs import read_all, read_rows
from tests.service.tracks import HEADER

pytestmark = pytest.mark.long

PASSES = """
chronicle passes[?a, ?b](t1, t2) {
  event(behind[?a, ?b]:(true, false), t1) event(ahead[?a, ?b]:(false, true), t2) t2 - t1 in [0s, 30s]
}
chronicle alone[?a, ?b](t1, t2) {
  event(behind[?a, ?b]:(true, false), t1) event(behind[?b, ?a]:(false, true), t2) t2 - t1 in [0s, 30s]
  noevent(close[?a, ?b]:(?, unknown), (t1 - 9s, t2 + 5s))
}
"""


def rows() -> Iterator[str]:
    """Let a pass b, and c pass d 60 m beside; nobody sees a from 5 s to 9 s, nor ever again c from 7 s on."""
    for frame in range(100):
        t_s = frame / 5
        a = "a" if t_s < 5 else "" if t_s < 9 else "a2"
        c = "c" if t_s < 7 else ""
        for name, x_m, y_m, speed_mps in (
            (a, 19 * t_s, 0.0, 19.0),
            ("b", 30 + 15 * t_s, 3.0, 15.0),
            (c, 19 * t_s, 60.0, 19.0),
            ("d", 20 + 15 * t_s, 63.0, 15.0),
        ):
            if name:
                yield f"{frame * 200_000},{name},{x_m:.2f},{y_m},0.0,{speed_mps},4.5,1.8"


@pytest.mark.parametrize("options", [[], ["--final"]], ids=["early", "final"])
def test_the_log_tells_in_the_end_what_its_stored_changes_amount_to(tmp_path: Path, options: list[str]) -> None:
    tracks, chronicles, log = tmp_path / "t.csv", tmp_path / "passes.chronicle", tmp_path / "a.db"
    tracks.write_text("\n".join([HEADER, *rows(), ""]))
    chronicles.write_text(PASSES)
    assert run(["process", str(tracks), "--chronicles", str(chronicles), "--log", str(log), *options]) == 0
    told = told_of((one.type, one) for one in read_all(str(log)))
    assert told == told_of((one.type, one) for one, _ in recognise_stored(str(log), [chronicles]).events)
    assert [one for one in told if one[0] == "passes" and 5_000_000 < one[1] < 9_000_000]
    states = [(one.status, one.revises) for one in read_rows(str(log))]
    assert not options or set(states) == {("recognised", None)}


def told_of(found: Iterable[tuple[str, EventRecord | Occurrence]]) -> list[tuple[str, int, int, list[str]]]:
    return sorted((name, one.start_us, one.end_us, list(one.roles.values())) for name, one in found)
