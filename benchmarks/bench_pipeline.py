"""How fast is the whole of `dyknow process`, and where does the time go?

One synthetic clip (rural_overtaking, seed 1, 60 s at 1280 x 720) is processed several times, turn by turn with decoding
alone, so that the ratio holds on a busy machine. The log is written as a user's would be.
"""

import statistics
import tempfile
import time
from pathlib import Path

from data_gen.scene import generate
from service.runs.processing import RunRequest, RunSummary, process
from vision.video.frames import open_video

SECONDS = 60
TURNS = 3


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene"
        started_s = time.perf_counter()
        generate("rural_overtaking", seed=1, duration_us=SECONDS * 1_000_000, out_dir=scene)
        drawn_s = time.perf_counter() - started_s
        print(f"generate      {SECONDS * 25 / drawn_s:8.1f} frames/s")
        decoding_s, summaries = [], []
        for turn in range(TURNS):
            decoding_s.append(_time_decoding(scene / "video.mp4"))
            log = f"sqlite:///{folder}/log{turn}.db"
            summaries.append(process(RunRequest(scene / "video.mp4", scene / "site.toml", log)))
        _report(decoding_s, summaries)


def _time_decoding(video: Path) -> float:
    started_s = time.perf_counter()
    for _ in open_video(video):
        pass
    return time.perf_counter() - started_s


def _report(decoding_s: list[float], summaries: list[RunSummary]) -> None:
    processing_s = statistics.median(summary.progress.elapsed_s for summary in summaries)
    middle = statistics.median(decoding_s)
    print(f"decode alone  {SECONDS / middle:8.1f} x real time")
    print(
        f"process       {SECONDS / processing_s:8.1f} x real time, {processing_s / middle:.2f} x the time of decoding"
    )
    for streams in zip(*(summary.streams for summary in summaries), strict=True):
        if streams[0].updates:
            per_frame_ms = statistics.median(one.busy_ns for one in streams) / 1e6 / (SECONDS * 25)
            print(f"  {streams[0].label:<16} {per_frame_ms:6.3f} ms a frame")


if __name__ == "__main__":
    main()
