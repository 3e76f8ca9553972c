"""What `dyknow demo` makes and prints, made once and shared by all tests that need a scene or its log."""

import contextlib
import io
from dataclasses import dataclass
from pathlib import Path

import pytest

from service.cli.app import run

SECONDS = 40
"""Of the demo's 60: its six overtakes are over by then, and a longer clip begins with the shorter one's pictures."""


@dataclass(frozen=True, slots=True)
class Demo:
    """The folder of a demo, and what it printed."""

    folder: Path
    printed: str

    @property
    def scene(self) -> Path:
        """Return the folder with video, site, network and truth."""
        return self.folder / "scene"

    @property
    def log(self) -> Path:
        """Return the log of the library's chronicles."""
        return self.folder / "log.db"


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Demo:
    folder, printed = tmp_path_factory.mktemp("demo"), io.StringIO()
    with contextlib.redirect_stdout(printed):
        assert run(["demo", "--out", str(folder), "--seconds", str(SECONDS)]) == 0
    return Demo(folder, printed.getvalue())


@pytest.fixture(scope="session")
def scene(demo: Demo) -> Path:
    return demo.scene
