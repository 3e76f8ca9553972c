"""Inputs that mean harm, or come from a broken disk, are refused in words with the documented exit code."""

import os
import threading
from pathlib import Path

import av
import pytest

from service.cli.app import run
from service.errors import LogError
from service.runs.inputs.input_kind import Asked
from service.store.log import open_log
from tests.service.logs import overtake, write_log, write_small_log
from tests.service.tracks import HEADER, write_row, write_tracks

SITE = 'name = "x"\nstart_utc = 2026-05-01T08:00:00Z\n'
CAMERA = "[camera]\nhomography = [[0.1, 0.0, -3.2], [0.0, -0.1, 2.4], [0.0, 0.0, 1.0]]\n"


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """Run a command line that is refused with 3 and no trace; return the message."""
    assert run([str(argument) for argument in arguments]) == 3
    message = capsys.readouterr().err
    assert "Traceback" not in message
    return message


def refused_site(capsys: pytest.CaptureFixture[str], folder: Path, text: str) -> str:
    (folder / "site.toml").write_text(text)
    tracks = write_tracks(folder / "t.csv", frames=2)
    message = refused(capsys, "process", tracks, "--site", folder / "site.toml", "--log", folder / "a.db")
    assert not (folder / "a.db").exists()
    return message


def test_a_deeply_nested_site_file(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    message = refused_site(capsys, tmp_path, SITE + "x = " + "[" * 5000 + "]" * 5000)
    assert "site.toml: expected TOML with a few levels of nesting, got too many to read" in message


def test_a_deeply_nested_road_network(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "roads.geojson").write_text("[" * 200_000 + "]" * 200_000)
    frame = "[frame]\norigin_lat_deg = 58.0\norigin_lon_deg = 15.0\n"
    message = refused_site(capsys, tmp_path, f'{SITE}[network]\ngeojson = "roads.geojson"\n{frame}')
    assert "site.toml: network.geojson: expected a file with a few levels of nesting" in message


@pytest.mark.parametrize("start", ["9999-12-31T23:59:59Z", "0001-01-01T00:00:00+05:00", "0001-01-01T00:00:00Z"])
def test_a_start_at_the_end_of_the_calendar(capsys: pytest.CaptureFixture[str], tmp_path: Path, start: str) -> None:
    message = refused_site(capsys, tmp_path, f'name = "x"\nstart_utc = {start}\n')
    assert f"start_utc: expected a time from 1900-01-01 to 9900-01-01, got '{start[:10]}" in message


def test_a_file_name_that_is_no_text(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"t\xff.csv")
    write_tracks(path, frames=2)
    message = refused(capsys, "process", path, "--log", tmp_path / "a.db")
    assert "input: expected a file name in UTF-8, got 't\\udcff.csv'" in message


def test_an_input_that_may_not_be_read(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def forbidden(asked: Asked) -> None:
        raise PermissionError(13, "Permission denied", str(asked.path))

    tracks = write_tracks(tmp_path / "t.csv", frames=2)
    monkeypatch.setattr("service.runs.processing.open_input", forbidden)
    message = refused(capsys, "process", tracks, "--log", tmp_path / "a.db")
    assert "t.csv: expected a path that can be used, got 'Permission denied'" in message


@pytest.mark.parametrize("address", ["rtsp://user@10.0.0.7:554/1", "https://example.org/cam.mp4", "/dev/zero"])
def test_live_input_is_refused_in_one_true_sentence(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, address: str
) -> None:
    message = refused(capsys, "process", address, "--log", tmp_path / "a.db")
    came = "a device" if address.startswith("/dev") else "an address"
    expected = "expected a file (dyknow watch reads live video)"
    assert message == f"error: {address}: {expected}, got {came}\n"


def test_what_must_be_read_twice_is_refused_as_a_pipe(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    site = tmp_path / "site.toml"
    os.mkfifo(site)
    writer = threading.Thread(target=site.write_text, args=(SITE,))
    writer.start()
    tracks = write_tracks(tmp_path / "t.csv", frames=2)
    message = refused(capsys, "process", tracks, "--site", site, "--log", tmp_path / "a.db")
    writer.join()
    assert "site.toml: expected a file that can be read twice, got a pipe" in message


@pytest.mark.parametrize("text", ["", "# only a comment\n", "message honk[?car]\n"])
def test_a_chronicle_file_without_a_chronicle(capsys: pytest.CaptureFixture[str], tmp_path: Path, text: str) -> None:
    chronicle = tmp_path / "empty.chronicle"
    chronicle.write_text(text)
    tracks = write_tracks(tmp_path / "t.csv", frames=2)
    message = refused(capsys, "process", tracks, "--log", tmp_path / "a.db", "--chronicles", chronicle)
    assert "empty.chronicle: expected at least one chronicle, got none" in message


@pytest.mark.long
def test_a_video_with_a_header_and_no_frame_is_broken(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "site.toml").write_text(SITE + CAMERA)
    with av.open(str(tmp_path / "none.avi"), "w") as container:
        stream = container.add_stream("mjpeg", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuvj420p"
        container.start_encoding()
    log = tmp_path / "a.db"
    message = refused(capsys, "process", tmp_path / "none.avi", "--site", tmp_path / "site.toml", "--log", log)
    assert "none.avi" in message
    with open_log(str(log)) as opened:
        assert opened.run().status == "broken"


@pytest.mark.parametrize(
    ("truth", "events", "expected"),
    [
        (b"\xff\xfe", b"", "truth.csv: expected UTF-8 text, got byte 0xff"),
        (b"t_us,id,x_m,y_m\n0,a,0,0\n", b"\xff\n", "truth_events.jsonl: expected UTF-8 text, got byte 0xff"),
        (b"t_us,id,x_m,y_m\n0,a,0,0\n", b"[" * 200_000, "truth_events.jsonl:1: expected a truth event"),
        (b"", b"", "truth.csv:1: expected columns t_us, id, x_m, y_m, got no 't_us'"),
        (b"t_us,id,x_m,y_m\n", b"", "truth.csv: expected at least one row, got none"),
    ],
    ids=["binary truth", "binary events", "nested events", "empty truth", "truth without rows"],
)
def test_a_truth_that_cannot_be_read(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, truth: bytes, events: bytes, expected: str
) -> None:
    log = write_log(tmp_path / "a.db", [overtake()])
    (tmp_path / "truth.csv").write_bytes(truth)
    (tmp_path / "truth_events.jsonl").write_bytes(events)
    assert expected in refused(capsys, "evaluate", log, tmp_path)


@pytest.mark.parametrize("seconds", ["inf", "nan", "1e300", "-5"])
def test_a_length_that_no_video_has(capsys: pytest.CaptureFixture[str], tmp_path: Path, seconds: str) -> None:
    assert run(["generate", "rural_overtaking", "--out", str(tmp_path / "g"), "--seconds", seconds]) == 2
    assert run(["demo", "--out", str(tmp_path / "d"), "--seconds", seconds]) == 2
    assert list(tmp_path.iterdir()) == []


def test_tracks_of_a_car_that_is_not_there(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    log = write_small_log(tmp_path / "a.db")
    assert "run 'r1': expected one of its 2 cars (car7, car10), got 'nosuch'" in refused(
        capsys, "tracks", log, "--car", "nosuch"
    )


def test_a_suffix_in_capitals_is_a_suffix(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    log = write_small_log(tmp_path / "a.db")
    message = refused(capsys, "draw", tmp_path / "none.mp4", log, "--out", tmp_path / "X.MP4")
    assert "none.mp4" in message


def test_a_video_in_which_nothing_moves_is_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    video = tmp_path / "still.mp4"
    with av.open(str(video), "w") as container:
        stream = container.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for _ in range(3):
            container.mux(stream.encode(av.VideoFrame(64, 48, "yuv420p")))
        container.mux(stream.encode(None))
    message = refused(capsys, "process", video, "--log", tmp_path / "a.db")
    assert "still.mp4: no camera is known: scale: expected" in message


def test_a_camera_that_sees_no_ground_is_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "site.toml").write_text(
        SITE + "[camera]\nhomography = [[10.0, 0.0, 32.0], [0.0, -10.0, 24.0], [0.0, 0.0, 1.0]]\n"
    )
    video = tmp_path / "far.mp4"
    with av.open(str(video), "w") as container:
        stream = container.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        container.mux(stream.encode(av.VideoFrame(64, 48, "yuv420p")))
        container.mux(stream.encode(None))
    message = refused(capsys, "process", video, "--site", tmp_path / "site.toml", "--log", tmp_path / "a.db")
    assert "far.mp4: with the camera and roads of its site: camera: expected ground" in message
    assert not (tmp_path / "a.db").exists()


def test_a_log_on_a_trajectory_line_out_of_range_is_not_created(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = write_row(tmp_path / "t.csv", t_us="-5")
    assert HEADER.startswith("t_us")
    assert "t.csv:2: column t_us: expected 0 to 1e+15, got '-5'" in refused(
        capsys, "process", path, "--log", tmp_path / "a.db"
    )
    with pytest.raises(LogError):
        open_log(str(tmp_path / "a.db"))


def test_drawing_from_a_time_to_an_earlier_one_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    where = "--from", "5s", "--to", "4s"
    for name in ("moment.png", "clip.mp4"):
        message = refused(capsys, "draw", tmp_path / "a.mp4", tmp_path / "a.db", "--out", tmp_path / name, *where)
        assert "--to: expected a time after --from, got '4s' and '5s'" in message
        assert not (tmp_path / name).exists()
