"""One synthetic scene, made once and shared by all scenario tests."""

from pathlib import Path

import pytest

from data_gen.scene import generate

SEED, SECONDS = 3, 40


@pytest.fixture(scope="session")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scene")
    generate("rural_overtaking", seed=SEED, duration_us=SECONDS * 1_000_000, out_dir=folder)
    return folder
