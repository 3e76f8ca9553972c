"""The network: what it decodes, what it learns in a step, and what its ONNX file says."""

import math
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the extra `train` is not installed")
pytest.importorskip("onnx", reason="the extra `train` is not installed")

from training.centre_net import CentreNet, Decoded, write_onnx
from training.train import train


def slow_rows(maps: np.ndarray, *, is_oriented: bool) -> list[list[float]]:  # type: ignore[type-arg]
    """Every cell that no neighbour tops, the best first."""
    height, width = maps.shape[1:]
    rows = []
    for y in range(height):
        for x in range(width):
            around = maps[0, max(0, y - 1) : y + 2, max(0, x - 1) : x + 2]
            if maps[0, y, x] < around.max():
                continue
            score = 1 / (1 + math.exp(-maps[0, y, x]))
            dx, dy, log_length, log_width, *rest = maps[1:, y, x].tolist()
            centre, size = np.array([4 * (x + dx) - 0.5, 4 * (y + dy) - 0.5]), 4 * np.exp([log_length, log_width])
            kind = float(np.argmax(rest[:5]))
            if is_oriented:
                rows.append([*centre, *size, score, kind, math.atan2(rest[6], rest[5]) / 2])
            else:
                rows.append([*(centre - size / 2), *(centre + size / 2), score, kind])
    return sorted(rows, key=lambda row: -row[4])


@pytest.mark.parametrize("is_oriented", [True, False], ids=["oriented", "upright"])
def test_peaks_are_decoded_as_a_slow_look_at_each_cell_does(is_oriented: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    network = CentreNet(is_oriented=is_oriented)
    shape = (1, 12 if is_oriented else 10, 24, 32)
    maps = torch.from_numpy(np.random.default_rng(3).normal(size=shape).astype(np.float32))
    monkeypatch.setattr(network, "forward", lambda _: maps)
    rows = Decoded(network)(torch.zeros(1, 3, 96, 128)).numpy()
    expected = np.array(slow_rows(maps[0].numpy(), is_oriented=is_oriented))[:60]
    np.testing.assert_allclose(rows[:60], expected, rtol=1e-4, atol=1e-4)


@pytest.mark.filterwarnings("ignore")  # torch announces another way of writing ONNX
def test_a_step_of_training_changes_the_weights_and_ends_in_a_file_that_runs(tmp_path: Path) -> None:
    import onnxruntime

    frames = np.lib.format.open_memmap(tmp_path / "frames.npy", "w+", np.uint8, (1, 64, 96, 3))
    frames[0] = np.random.default_rng(0).integers(0, 255, (64, 96, 3))
    np.savez(tmp_path / "boxes.npz", **{"0": np.array([[40.0, 30.0, 30.0, 14.0, 0.3, 1.0, 1.0]])})
    torch.manual_seed(1)
    before = CentreNet(is_oriented=True).state_dict()["out.weight"]
    after = train([tmp_path], "above", tmp_path / "w.pt", steps=1, batch=2)
    assert not torch.equal(before, after.state_dict()["out.weight"])
    write_onnx(after, tmp_path / "w.onnx")
    session = onnxruntime.InferenceSession(str(tmp_path / "w.onnx"))
    [rows] = session.run(None, {"pictures": np.zeros((1, 3, 128, 224), np.float32)})
    assert rows.shape == (200, 7)
    assert np.isfinite(rows).all()
