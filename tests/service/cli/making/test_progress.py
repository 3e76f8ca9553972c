"""What `dyknow process` says while it works."""

import pytest

from service.cli.making import process
from service.cli.making.process import progress_bar
from service.runs.processing import Progress


@pytest.mark.parametrize(
    ("frames", "line"),
    [
        (0, "0 frames, learning the road"),
        (50, "50 frames, 100 frames/s, 4.0x real time, 2 cars, 1 events, 2 s left"),
    ],
)
def test_line_tells_how_far_the_run_is(
    frames: int, line: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(process, "REPORT_EVERY_S", 0.0)
    with progress_bar("video.mp4") as show:
        show(Progress(frames, 250, 40_000 * frames, 0.5, cars=2, events=1))
    assert capsys.readouterr().err.strip() == line
