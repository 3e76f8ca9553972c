"""What happens to a run whose disk is full? On a small file system of its own, where one may be mounted."""

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from service.errors import LogError
from service.runs.jobs.worker import work
from service.runs.processing import RunRequest, process
from service.runs.requests import as_text, job_id
from service.store.databases.location import database_of
from service.store.log import open_log
from service.store.registers.jobs import MOST_ATTEMPTS, Jobs
from service.store.upkeep import damage
from tests.service.logs import kept_rows

pytestmark = pytest.mark.long

TOO_SMALL, LARGE_ENOUGH = "368k", "16m"


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[tuple[Path, Callable[[str], None]]]:
    """Give a folder, and how to change the size of its disk."""

    def mount(*options: str) -> None:
        subprocess.run(["mount", *options, str(tmp_path)], check=True, capture_output=True)

    try:
        mount("-t", "tmpfs", "-o", f"size={TOO_SMALL}", "tmpfs")
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"no file system may be mounted here: {error}")
    yield tmp_path, lambda size: mount("-o", f"remount,size={size}")
    subprocess.run(["umount", "--lazy", str(tmp_path)], check=True)


def test_a_run_on_a_full_disk_says_so_and_is_made_again(
    disk: tuple[Path, Callable[[str], None]], tracks: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder, resize = disk
    url, whole = f"sqlite:///{folder / 'log.db'}", f"sqlite:///{tmp_path_factory.mktemp('whole') / 'log.db'}"
    request = RunRequest(tracks, tracks.parent / "site.toml", url)
    with pytest.raises(LogError, match="expected a log that can be written, got 'database or disk is full'"):
        process(request)
    with open_log(url) as log:
        assert list(damage(log)) == []
    resize(LARGE_ENOUGH)
    process(request)
    process(RunRequest(tracks, tracks.parent / "site.toml", whole))
    assert kept_rows(url) == kept_rows(whole)


@pytest.mark.slow
def test_a_job_on_a_full_disk_fails_with_the_reason_and_can_be_repeated(
    disk: tuple[Path, Callable[[str], None]], tracks: Path
) -> None:
    folder, resize = disk
    url = f"sqlite:///{folder / 'log.db'}"
    jobs = Jobs(database_of(url))
    request = RunRequest(tracks, tracks.parent / "site.toml", "")
    name = jobs.add(job_id(request), as_text(request)).id
    work(url, stays=False, tell=lambda _: None)
    job = jobs.find(name)
    assert (job.state, job.attempts) == ("failed", MOST_ATTEMPTS)
    assert job.message.endswith("expected a log that can be written, got 'database or disk is full'")
    resize(LARGE_ENOUGH)
    jobs.retry(name)
    work(url, stays=False, tell=lambda _: None)
    assert jobs.find(name).state == "finished"
    jobs.close()
