"""Is a camera that speaks RTSP recorded, called again when it is cut, and told in a line when it refuses?"""

import signal
import threading
from pathlib import Path

import pytest

from service.cli.app import run as run_cli
from service.runs.live import live_source, receiver
from service.store.log import open_log
from tests.service.logs import kept_rows
from tests.service.runs.live.rtsp_camera import rtsp_camera
from tests.service.runs.live.test_watching import (
    PIECE,
    SENT_S,
    connection_count,
    events,
    recorded_bytes,
    recordings,
    reprocessed,
    until,
    watching,
)
from vision.video.recording import parts_so_far

LOGIN = "me:secret"


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [0, 5], ids=["as fast as it goes", "as it happens"])
def test_a_camera_that_is_cut_is_called_again_and_what_came_can_be_processed_again(
    sent: bytes, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seconds: int
) -> None:
    half = len(sent) // (2 * PIECE) * PIECE
    monkeypatch.setenv("CAMERA", LOGIN)
    with rtsp_camera(sent[:half], sent, login=LOGIN, bytes_per_s=seconds and len(sent) / seconds) as url:
        named = url.replace("//", "//$CAMERA@")
        with watching(named, scene, tmp_path) as program:
            until(lambda: connection_count(tmp_path) == 2 and recorded_bytes(tmp_path) > 1.3 * len(sent), program)
            program.send_signal(signal.SIGINT)
            _, told = program.communicate()
    assert program.returncode == 0, told
    assert f"{url}: it ended; called again".encode() in told
    assert f"{url}: is back".encode() in told
    assert b"secret" not in told
    assert b"Traceback" not in told
    (recording,) = recordings(tmp_path)
    first, second = parts_so_far(recording)
    assert (first.start_us, first.why, second.why) == (0, "", "it ended")
    assert second.start_us > 0
    live, again = tmp_path / "live.db", reprocessed(tmp_path, scene)
    assert events(live)
    assert kept_rows(live) == kept_rows(again)
    with open_log(str(live)) as log:
        lost, back = log.views(log.run().id)
    assert lost.t_us < back.t_us == second.start_us


def test_media_time_goes_on_where_a_camera_falls_silent(
    sent: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    silent_s = 0.5
    for where in (live_source, receiver):
        monkeypatch.setattr(where, "SILENT_FOR_S", silent_s)
    told = list[str]()

    def tell(line: str) -> None:
        told.append(line)
        if line.endswith("is back"):
            threading.Timer(silent_s, source.ended.set).start()

    with rtsp_camera(sent, sent, cuts_line=False) as url:
        source = live_source.LiveSource(url)
        recorder = receiver.Receiver(
            source, source.open(), tmp_path / "recordings", longest_us=10**12, most_bytes=10**12, tell=tell
        )
        recorder.record(lambda _: None)
    assert told[0] == f"{url}: it was cut (nothing in time); called again"
    _, second = parts_so_far(recordings(tmp_path)[0])
    # FFmpeg gives the last picture out as its patience ends, and waits as long again.
    assert second.start_us > 1_000_000 * (SENT_S - 0.1 + 2 * silent_s + receiver.FIRST_PAUSE_S)


@pytest.mark.parametrize(
    ("login", "path", "said"),
    [
        ("me:wrong@", "/1", "401 Unauthorized"),
        ("", "/1", "401 Unauthorized"),
        ("me:secret@", "/none", "404 Not Found"),
    ],
)
def test_a_camera_that_refuses_is_told_in_a_line(
    login: str, path: str, said: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    names = ["--log", str(tmp_path / "live.db"), "--recordings", str(tmp_path / "recordings")]
    with rtsp_camera(b"", login=LOGIN) as url:
        place = url.removeprefix("rtsp://").removesuffix("/1") + path
        assert run_cli(["watch", f"rtsp://{login}{place}", *names]) == 3
    told = capfd.readouterr().err
    assert told.startswith(f"error: rtsp://{place}: expected live video, got Server returned {said}")
    assert told.count("\n") == 1
    assert "wrong" not in told
    assert "secret" not in told
    assert not list(tmp_path.iterdir())
