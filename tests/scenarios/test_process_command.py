"""`dyknow process` as a user meets it, above all with wrong input."""

import json
from pathlib import Path

import pytest

from service.cli.app import run
from service.store.log import open_log
from tests.conftest import Demo
from tests.service.conftest import first_seconds

GOLDEN_CLIP = Path(__file__).parents[1] / "golden" / "rural_video"


def process(*arguments: object) -> int:
    return run(["process", *(str(argument) for argument in arguments)])


def refused(capsys: pytest.CaptureFixture[str], folder: Path, *arguments: object) -> str:
    """Run with a log that must not come to be; return the message."""
    log = folder / "log.db"
    code = process(*arguments, "--log", log)
    assert code == 3
    assert not log.exists()
    return capsys.readouterr().err


def test_missing_video(capsys: pytest.CaptureFixture[str], tmp_path: Path, small_scene: Path) -> None:
    message = refused(capsys, tmp_path, tmp_path / "none.mp4", "--site", small_scene / "site.toml")
    assert "none.mp4: expected a video or trajectory file, got no such file" in message


@pytest.mark.parametrize("content", [b"", b"not a video at all\n" * 50], ids=["empty", "text"])
def test_file_that_is_no_video(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, small_scene: Path, content: bytes
) -> None:
    video = tmp_path / "broken.mp4"
    video.write_bytes(content)
    message = refused(capsys, tmp_path, video, "--site", small_scene / "site.toml")
    assert "broken.mp4" in message
    assert "expected" in message


@pytest.mark.long
def test_truncated_video_without_an_index(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, small_scene: Path
) -> None:
    video = tmp_path / "short.mp4"
    video.write_bytes((small_scene / "video.mp4").read_bytes()[:500])
    assert "short.mp4" in refused(capsys, tmp_path, video, "--site", small_scene / "site.toml")


@pytest.mark.long
def test_video_that_breaks_half_way_keeps_its_events(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    whole = (GOLDEN_CLIP / "video.mp4").read_bytes()
    video, log = tmp_path / "half.mp4", tmp_path / "log.db"
    video.write_bytes(whole[: len(whole) * 4 // 5])
    code = process(video, "--site", GOLDEN_CLIP / "site.toml", "--log", log, "--workers", 0)
    assert code == 3
    assert "the events up to there are kept" in capsys.readouterr().err
    with open_log(str(log)) as opened:
        (record,) = opened.runs()
        assert record.status == "broken"
        assert "half.mp4" in record.reason
        assert opened.cars(record.id)
    assert run(["events", str(log), "--type", "overtake", "--format", "jsonl"]) == 0
    assert capsys.readouterr().out.count("\n") >= 1


def test_site_with_a_misspelt_field(capsys: pytest.CaptureFixture[str], tmp_path: Path, small_scene: Path) -> None:
    site = tmp_path / "site.toml"
    site.write_text((small_scene / "site.toml").read_text().replace("homography", "homografy"))
    (tmp_path / "network.net.xml").write_bytes((small_scene / "network.net.xml").read_bytes())
    message = refused(capsys, tmp_path, small_scene / "video.mp4", "--site", site)
    assert "homografy" in message
    assert "did you mean homography?" in message


def test_missing_site(capsys: pytest.CaptureFixture[str], tmp_path: Path, small_scene: Path) -> None:
    message = refused(capsys, tmp_path, small_scene / "video.mp4", "--site", tmp_path / "none.toml")
    assert "none.toml: expected a readable site file" in message


def test_chronicle_with_an_error(capsys: pytest.CaptureFixture[str], tmp_path: Path, small_scene: Path) -> None:
    chronicle = tmp_path / "mine.chronicle"
    chronicle.write_text("chronicle near[?a, ?b](t1) { event(besid[?a, ?b]:(false, true), t1) }")
    message = refused(
        capsys, tmp_path, small_scene / "video.mp4", "--site", small_scene / "site.toml", "--chronicles", chronicle
    )
    assert "mine.chronicle:1:" in message
    assert "did you mean 'beside'?" in message


def test_unknown_log_url(capsys: pytest.CaptureFixture[str], small_scene: Path) -> None:
    code = process(small_scene / "truth.csv", "--site", small_scene / "site.toml", "--log", "mongodb://host/db")
    assert code == 3
    assert "got scheme 'mongodb'" in capsys.readouterr().err


def test_trajectory_file_without_its_columns(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    tracks = tmp_path / "tracks.csv"
    tracks.write_text("time,car\n0,1\n")
    assert "map other names with --columns" in refused(capsys, tmp_path, tracks)


def test_json_progress_ends_with_a_summary(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, small_scene: Path
) -> None:
    tracks = first_seconds(small_scene, tmp_path, 4)
    assert process(tracks, "--site", small_scene / "site.toml", "--log", tmp_path / "log.db", "--json") == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert {line["type"] for line in lines[:-1]} <= {"progress"}
    assert (lines[-1]["type"], lines[-1]["status"], lines[-1]["frames"]) == ("summary", "finished", 25 * 4)


@pytest.mark.long
def test_own_chronicle_file_is_used(capsys: pytest.CaptureFixture[str], tmp_path: Path, small_scene: Path) -> None:
    chronicle, log = tmp_path / "mine.chronicle", tmp_path / "log.db"
    chronicle.write_text(
        "message met[?a, ?b] { ?a in Car ?b in Car }\n"
        "chronicle met[?a, ?b](t1) { event(close[?a, ?b]:(false, true), t1) when recognised { emit met[?a, ?b] } }"
    )
    tracks = first_seconds(small_scene, tmp_path, 4)
    assert process(tracks, "--site", small_scene / "site.toml", "--log", log, "--chronicles", chronicle) == 0
    capsys.readouterr()
    assert run(["events", str(log), "--format", "jsonl", "--limit", "1"]) == 0
    assert json.loads(capsys.readouterr().out)["type"] == "met"


@pytest.mark.long
def test_evaluate_and_draw_work_on_the_log(capsys: pytest.CaptureFixture[str], tmp_path: Path, demo: Demo) -> None:
    log, scene, picture = str(demo.log), demo.scene, tmp_path / "picture.png"
    assert run(["evaluate", log, str(scene), "--min-f1", "0.9"]) == 0
    assert "precision 1.000" in capsys.readouterr().out
    assert run(["evaluate", log, str(scene), "--type", "nosuch"]) == 3
    assert run(["draw", str(scene / "video.mp4"), log, "--out", str(picture), "--from", "10s"]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
def test_interrupt_keeps_what_was_found(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, small_scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from service.runs import processing as runs

    frames = iter(range(100))

    def count(meter: runs._Meter, t_us: int) -> None:
        if next(frames, None) is None:
            raise KeyboardInterrupt

    monkeypatch.setattr(runs._Meter, "count", count)
    log = tmp_path / "log.db"
    assert process(small_scene / "truth.csv", "--site", small_scene / "site.toml", "--log", log) == 130
    assert "got an interrupt; the events up to there are kept" in capsys.readouterr().err
    with open_log(str(log)) as opened:
        (record,) = opened.runs()
        assert record.status == "interrupted"
        assert opened.cars(record.id)


@pytest.mark.slow
def test_video_without_a_site_file_runs_on_the_image_plane_and_says_so(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, scene: Path
) -> None:
    log = tmp_path / "log.db"
    assert process(scene / "video.mp4", "--log", log) == 0
    assert "no camera is known, so the image plane is taken for the ground" in capsys.readouterr().err
    with open_log(str(log)) as opened:
        (record,) = opened.runs()
        assert "no camera is known" in record.warnings[0]
        assert opened.cars(record.id)
