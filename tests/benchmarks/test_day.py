"""What a camera costs: one real row, from a short scene."""

from pathlib import Path

import pytest

from benchmarks import bench_day
from data_gen.outputs.scene import generate


@pytest.mark.slow
def test_row_adds_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "rural_overtaking_vertical_sunny_720p_seed1_60s"
    generate("rural_overtaking", seed=1, duration_us=4_000_000, out_dir=scene, width_px=960, height_px=540)
    monkeypatch.setattr(bench_day, "SECONDS", 4)
    monkeypatch.setattr(bench_day, "made_scene", lambda *_, **__: scene)
    bench_day.main(["--only", "rural", "--turns", "1", "--folder", str(tmp_path)])
    titles, row = (line.split("  ") for line in capsys.readouterr().out.splitlines())
    cells = dict(zip(filter(None, map(str.strip, titles)), filter(None, map(str.strip, row)), strict=True))
    assert cells["scene"] == "rural"
    parts = [int(cells[one]) for one in ("decode", "vision", "anchoring", "relations", "chronicles", "rest")]
    assert sum(parts) == pytest.approx(int(cells["all CPU s"]), abs=5)
    assert float(cells["ms a frame"]) == pytest.approx(int(cells["all CPU s"]) * 1e3 / (3600 * 25), rel=0.01)
    assert int(cells["RSS MB"]) > 50
