"""Do the tables of the page on calibration make a good site file?"""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from service.cli.app import run
from tests.docs.commands import ROOT, fenced
from tests.vision.support import write_video


def test_the_tables_of_the_page_make_a_camera_within_a_foot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    points, lanes = fenced(ROOT / "docs" / "calibration.md", "csv")
    (tmp_path / "points.csv").write_text(points, encoding="utf-8")
    (tmp_path / "lanes.csv").write_text(lanes, encoding="utf-8")
    clip = tmp_path / "highway_bend.mp4"
    write_video(clip, [np.full((360, 640), 120, np.uint8)] * 2)
    made = {f"--{name}": str(tmp_path / f"{name}.csv") for name in ("points", "lanes")}
    options = [word for pair in made.items() for word in pair]
    assert run(["site", "new", str(clip), *options, "--out", str(tmp_path / "bend.toml"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert len(told["points"]) == 10
    assert max(one["error_m"] for one in told["points"]) <= 0.3
    assert [re.sub(r"\d+ m", "", one) for one in told["warnings"]] == [
        "lanes lie beyond the camera's points, where distances are only extrapolated: towards_outer , away_inner "
    ]
