"""`dyknow` refuses to start with somebody else's package in place of one of its own."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from service.cli.app import PACKAGES, foreign_package

ROOT = Path(__file__).parents[3]


def started(folder: Path) -> "subprocess.CompletedProcess[str]":
    """Start `dyknow` with a folder in front of all others that Python looks into."""
    command = [sys.executable, "-P", "-c", "from service.cli.app import main; main()", "--version"]
    environment = os.environ | {"PYTHONPATH": str(folder)}
    return subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True, check=False)


def test_our_packages_lie_together() -> None:
    assert foreign_package() == ""


@pytest.mark.parametrize("name", ["gis", "vision"])
def test_a_package_of_the_same_name_elsewhere_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / name).mkdir()
    (tmp_path / name / "__init__.py").write_text("raise SystemError('imported')")
    refused = started(tmp_path)
    assert refused.returncode == 3
    assert f"error: package '{name}': expected '{ROOT / name / '__init__.py'}', got '{tmp_path}" in refused.stderr
    assert "install dyknow anew, into an environment of its own" in refused.stderr


@pytest.mark.parametrize(
    ("left", "came"),
    [("import os\n", "expected our names in"), (None, "")],
    ids=["overwritten", "removed"],
)
def test_a_package_that_another_program_overwrote_is_refused(tmp_path: Path, left: str | None, came: str) -> None:
    for name in set(PACKAGES) - {"service"}:
        (tmp_path / name).symlink_to(ROOT / name)
    shutil.copytree(ROOT / "service", tmp_path / "service", ignore=shutil.ignore_patterns("__pycache__"))
    init = tmp_path / "service" / "__init__.py"
    init.unlink() if left is None else init.write_text(left)
    refused = started(tmp_path)
    assert refused.returncode == 3
    assert "error: package '" in refused.stderr
    assert came in refused.stderr
