"""A link that turns out to be wrong takes back what was concluded from it."""

from pathlib import Path

import pytest

from chronicles.recogniser import recognise
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.questions.observations.stored_events import chronicles_of, stored_events
from service.runs.processing import RunRequest, process
from service.store.log import open_log
from tests.service.tracks import HEADER

MET = """\
message met[?a, ?b] { ?a in Car  ?b in Car }
chronicle met[?a, ?b](t1) {
  event(close[?a, ?b]:(unknown, true), t1)
  when recognised { emit met[?a, ?b] }
}
"""
FRAME_US = 100_000
FRAMES = 60


def write_tracks(path: Path, *, jump_at: int) -> Path:
    """Write two cars that drive side by side; the tracker's second one jumps far ahead in a frame."""
    rows = []
    for frame in range(FRAMES):
        far_m = 300.0 if frame >= jump_at else 0.0
        rows.append(f"{frame * FRAME_US},a,{frame},0,0,10,4.5,1.8")
        rows.append(f"{frame * FRAME_US},b,{frame + 10 + far_m},0,0,10,4.5,1.8")
    path.write_text("\n".join([HEADER, *rows, ""]))
    return path


def met_in(folder: Path, *, jump_at: int) -> tuple[list[dict[str, str]], list[str]]:
    """Process the two cars; return the roles of what stands, and the labels of refuted links."""
    (folder / "met.chronicle").write_text(MET)
    log = str(folder / f"{jump_at}.db")
    tracks = write_tracks(folder / f"{jump_at}.csv", jump_at=jump_at)
    process(RunRequest(tracks, None, log, (folder / "met.chronicle",)))
    with open_log(log) as opened:
        run = opened.run()
        standing = [decode_event(text).roles for text in iterate_events(opened, EventFilter())]
        refuted = [one.label for one in opened.hypotheses(run.id) if one.verdict == "refuted"]
        stored = stored_events(opened, run.id)
        again = [one.roles for one in recognise(chronicles_of(run), stored.events, until_us=stored.until_us)]
    assert again == standing
    return standing, refuted


BOTH = [{"a": "car1", "b": "car2"}, {"a": "car2", "b": "car1"}]


def test_two_cars_meet_while_their_links_hold(tmp_path: Path) -> None:
    assert met_in(tmp_path, jump_at=FRAMES) == (BOTH, [])


def test_a_link_refuted_on_trial_takes_the_meeting_back(tmp_path: Path) -> None:
    assert met_in(tmp_path, jump_at=14) == ([], ["b->w2#3"])


@pytest.mark.long
def test_a_link_refuted_later_takes_nothing_back(tmp_path: Path) -> None:
    assert met_in(tmp_path, jump_at=40) == (BOTH, [])
