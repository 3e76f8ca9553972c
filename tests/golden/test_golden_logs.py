"""Do a video, a file of trajectories and a file of detections still become the event logs that they became before?

`UPDATE_GOLDEN=1 pytest tests/golden` writes the golden logs anew: read the diff, and name each change in the commit.
README.md beside this file says how the inputs were made.
"""

import os
from dataclasses import dataclass
from pathlib import Path

import pytest

from service.cli.app import run
from tests.golden.comparing import compare
from tests.golden.conftest import NotPinned
from tests.golden.pinned import read_log, read_tables, write_tables

HERE = Path(__file__).parent


@dataclass(frozen=True, slots=True)
class Case:
    """One input; its files and its golden log lie in the folder of that name."""

    folder: str
    input: str
    frame_us: int
    options: tuple[str, ...] = ()

    def process(self, log: Path) -> None:
        """Make the log, by the command line."""
        folder = HERE / self.folder
        source, site = str(folder / self.input), str(folder / "site.toml")
        assert run(["process", *self.options, source, "--site", site, "--log", str(log)]) == 0


CASES = (
    Case("rural_video", "video.mp4", frame_us=80_000),
    Case("junction_tracks", "tracks.csv", frame_us=100_000),
    Case("detections", "found.csv", frame_us=80_000, options=("--detections",)),
)


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=case.folder, marks=() if case.folder == "rural_video" else pytest.mark.long)
        for case in CASES
    ],
)
def test_log_says_what_the_golden_one_says(case: Case, tmp_path: Path, not_pinned: NotPinned) -> None:
    log = tmp_path / "log.db"
    case.process(log)
    got, golden = read_log(log), HERE / case.folder / "log.txt"
    if os.environ.get("UPDATE_GOLDEN"):
        write_tables(got, golden)
    is_exact = bool(os.environ.get("EXACT_GOLDEN"))
    comparison = compare(read_tables(golden), got, frame_us=case.frame_us, is_exact=is_exact)
    not_pinned.note(case.folder, comparison.not_pinned)
    assert not comparison.differences, comparison.report()
