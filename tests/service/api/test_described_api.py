"""Does the server do what its OpenAPI description says, whatever a client that believes it sends?"""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from service.api.app import create_app
from service.api.source_files import SourceFolders
from tests.conftest import Demo
from tests.service.http import serving

CONFIG = Path(__file__).with_name("schemathesis.toml")
EXAMPLES = 100


@pytest.mark.slow
def test_schemathesis_finds_nothing(demo: Demo, tmp_path: Path) -> None:
    program = Path(sys.executable).with_name("schemathesis")
    options = ["--phases", "examples,coverage,fuzzing", "--max-examples", str(EXAMPLES), "--seed", "1", "--no-color"]
    # All that an operator may allow, since a route that is closed is not looked at.
    log = shutil.copy(demo.log, tmp_path)
    folders = SourceFolders(uploads=tmp_path, upload_gb=0.001, allowed=(demo.scene,))
    with serving(create_app(log, folders=folders, media_folders=[demo.scene])) as (_, address):
        command = [program, "--config-file", CONFIG, "run", f"{address}/openapi.json", *options]
        ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout
