"""What does vision cost per frame, and what does it save to look at the road only?

Run from the repository: `python -m benchmarks.bench_vision`. A 720p video of a straight road, 600 m long, with twelve
cars is made on the spot and read back, so decoding is part of the figures. All rows come from the same frames in the
same process; the ratios are what to compare between machines.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np

from tests.vision.support import FloatArray, draw_boxes, make_boxes, top_view, write_video
from vision.background.settings import BackgroundSettings
from vision.camera import fixed_camera
from vision.settings import VisionSettings
from vision.video.frames import Frame, open_video

SIZE = (1280, 720)
ROAD_NORTH_M = 170.0
FRAMES = 250
WARM_UP = 60
RATE_HZ = 25


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "road.mp4"
        make_video(path)
        start_s = time.perf_counter()
        frames = list(open_video(path))
        decode_ms = 1000 * (time.perf_counter() - start_s) / len(frames)
    matrix, road = top_view(SIZE), road_polygon()
    whole = np.array([[0.0, 0.0], [600.0, 0.0], [600.0, 338.0], [0.0, 338.0]])
    rows = {
        "decode": decode_ms,
        "BGR of whole frames": per_frame_ms(frames, lambda frame: frame.to_bgr()),
        "vision, road only": vision_ms(frames, matrix, road),
        "vision, whole view": vision_ms(frames, matrix, whole),
    }
    total_ms = rows["decode"] + rows["vision, road only"]
    print(f"{'720p, 12 cars':<24}{'ms/frame':>10}")
    for name, ms in rows.items():
        print(f"{name:<24}{ms:>10.2f}")
    print(f"{'decode + vision':<24}{total_ms:>10.2f}   {1000 / RATE_HZ / total_ms:.1f} x real time")
    print(f"road only is {rows['vision, whole view'] / rows['vision, road only']:.1f} x as fast as the whole view")


def make_video(path: Path) -> None:
    rng = np.random.default_rng(0)
    field = cv2.GaussianBlur(rng.normal(100, 60, (SIZE[1], SIZE[0])), (0, 0), 3)
    pictures = []
    for k in range(FRAMES):
        luma = draw_boxes(SIZE, make_boxes(cars(k / RATE_HZ)), [60.0, 150.0, 200.0] * 4, ground=field)
        noisy = luma + rng.normal(0, 1.5, luma.shape)
        pictures.append(np.clip(noisy, 0, 255).astype(np.uint8))
    write_video(path, pictures, rate_hz=RATE_HZ)


def cars(t_s: float) -> list[tuple[float, float, float, float, float]]:
    """Six cars each way; those going east pass each other."""
    east = [((40.0 * i + (12.0 + 3 * (i % 3)) * t_s) % 600, ROAD_NORTH_M - 2, 0.0, 4.5, 1.8) for i in range(6)]
    west = [((590 - 45.0 * i - 15.0 * t_s) % 600, ROAD_NORTH_M + 2, np.pi, 4.5, 1.8) for i in range(6)]
    return east + west


def road_polygon() -> FloatArray:
    south, north = ROAD_NORTH_M - 4, ROAD_NORTH_M + 4
    return np.array([[0.0, south], [600.0, south], [600.0, north], [0.0, north]])


def vision_ms(frames: Sequence[Frame], matrix: FloatArray, polygon: FloatArray) -> float:
    vision = fixed_camera(matrix, [polygon], SIZE, VisionSettings(background=BackgroundSettings(startup_us=2_000_000)))
    for frame in frames[:WARM_UP]:
        vision.observe(frame)
    return per_frame_ms(frames[WARM_UP:], vision.observe)


def per_frame_ms(frames: Sequence[Frame], run: Callable[[Frame], object]) -> float:
    """Take the median over frames: on a shared machine the slowest ones measure the neighbours."""
    times_s = []
    for frame in frames:
        start_s = time.perf_counter()
        run(frame)
        times_s.append(time.perf_counter() - start_s)
    return 1000 * float(np.median(times_s))


if __name__ == "__main__":
    main()
