"""Does the server do what its OpenAPI description says, whatever a client that believes it sends?"""

import subprocess
import sys
from pathlib import Path

import pytest

from service.api.app import create_app
from tests.conftest import Demo
from tests.service.http import serving

CONFIG = Path(__file__).with_name("schemathesis.toml")
EXAMPLES = 100


@pytest.mark.slow
def test_schemathesis_finds_nothing(demo: Demo, tmp_path: Path) -> None:
    program = Path(sys.executable).with_name("schemathesis")
    options = ["--phases", "examples,coverage,fuzzing", "--max-examples", str(EXAMPLES), "--seed", "1", "--no-color"]
    with serving(create_app(str(demo.log))) as (_, address):
        command = [program, "--config-file", CONFIG, "run", f"{address}/openapi.json", *options]
        ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout
