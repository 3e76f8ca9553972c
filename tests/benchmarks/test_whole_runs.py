"""Does a benchmark end when its run is cut, in place of counting what it told until then?"""

import os
import signal
from pathlib import Path

import pytest

import benchmarks
from benchmarks.whole_runs import process_whole
from service.runs.processing import Progress, RunRequest
from tests.service.tracks import write_tracks


@pytest.mark.long
def test_a_benchmark_ends_with_its_run(tmp_path: Path) -> None:
    def stop(progress: Progress) -> None:
        if progress.frames == 5:
            os.kill(os.getpid(), signal.SIGTERM)

    request = RunRequest(write_tracks(tmp_path / "t.csv", frames=20), None, str(tmp_path / "a.db"))
    with pytest.raises(SystemExit, match=r"expected a whole run, got one that is interrupted; input at .* got SIGTERM"):
        process_whole(request, stop)
    assert process_whole(request).progress.frames == 20


def test_no_benchmark_goes_on_with_a_part_of_a_run() -> None:
    sources = {path.name: path.read_text(encoding="utf-8") for path in Path(benchmarks.__file__).parent.glob("*.py")}
    assert [name for name, text in sources.items() if " process(" in text] == ["whole_runs.py"]
