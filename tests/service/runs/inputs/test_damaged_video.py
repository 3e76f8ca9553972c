"""What does a run say of a video of which a part could not be decoded?"""

import math
from pathlib import Path

import numpy as np
import pytest

from service.runs.processing import RunRequest, process
from service.store.log import open_log
from tests.vision.support import draw_boxes, flip_first_picture, make_boxes, write_video

SIZE = (160, 48)
SITE = """
name = "damaged"
start_utc = 2026-05-01T08:00:00Z

[frame]
origin_lat_deg = 58.4
origin_lon_deg = 15.6

[camera]
homography = [[0.5, 0.0, 0.0], [0.0, -0.5, 24.0], [0.0, 0.0, 1.0]]
"""


@pytest.mark.long
def test_run_on_a_video_with_a_damaged_frame_finishes_and_says_so(tmp_path: Path) -> None:
    video, site = tmp_path / "v.mp4", tmp_path / "site.toml"
    rng = np.random.default_rng(5)
    grain = rng.normal(0, 6, SIZE[::-1])
    boxes = [make_boxes([(5 + k / 2, 10.0, 0.0, 4.5, 1.8)]) for k in range(40)]
    write_video(video, [np.clip(draw_boxes(SIZE, one, [200.0]) + grain, 0, 255).astype(np.uint8) for one in boxes])
    flip_first_picture(video)
    site.write_text(SITE)
    url = f"sqlite:///{tmp_path / 'log.db'}"
    summary = process(RunRequest(input=video, site=site, log_url=url, rate_hz=math.inf))
    told = "1 frame could not be decoded, the first at 0.00 s"
    assert (summary.status, summary.reason, summary.progress.frames) == ("finished", told, 39)
    assert f"v.mp4: {told}" in summary.warnings
    with open_log(url) as log:
        assert [(run.status, run.reason) for run in log.runs()] == [("finished", told)]
