"""What a camera sends, for all tests of live sources."""

from pathlib import Path

import pytest

from tests.service.runs.live.test_watching import sent_at


@pytest.fixture(scope="package")
def sent(scene: Path, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """What a camera sends of the first seconds of the demo's scene: its packets, in MPEG-TS."""
    return sent_at(0, scene, tmp_path_factory.mktemp("sent"))
