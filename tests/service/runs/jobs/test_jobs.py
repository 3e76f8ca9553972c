"""Is each job processed once, whatever happens to its workers?"""

import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path

import msgspec
import pytest

from service.cli.app import run as run_cli
from service.errors import NotInLogError, QueryError, RunBusyError, TakenError
from service.runs.jobs.worker import work
from service.runs.processing import RunRequest, process
from service.runs.requests import LiveRequest, as_text, job_id
from service.store.databases.location import database_of
from service.store.entries import Job
from service.store.log import open_log
from service.store.registers.jobs import MOST_ATTEMPTS, Jobs, TakenJob
from tests.service.conftest import NewLog, in_a_file
from tests.service.logs import kept_rows
from tests.service.store.databases.test_databases import end_all_connections

TAKE_AND_STAY = """
import signal, sys
from service.store.registers.jobs import Jobs
from service.store.databases.location import database_of
assert Jobs(database_of(sys.argv[1])).take() is not None
print("taken", flush=True)
signal.pause()
"""
WORK = [sys.executable, "-c", "from service.cli.app import main; main()", "worker"]


@contextmanager
def opened(url: str) -> Iterator[Jobs]:
    jobs = Jobs(database_of(url))
    yield jobs
    jobs.close()


def add(jobs: Jobs, source: Path, **options: object) -> str:
    request = RunRequest(source, source.parent / "site.toml", "", **options)  # type: ignore[arg-type]  # by name
    return jobs.add(job_id(request), as_text(request)).id


def until(is_so: Callable[[], bool]) -> None:
    while not is_so():
        time.sleep(0.01)


def is_free(url: str, name: str) -> bool:
    """Tell whether nobody is at a job; a server needs a moment to see that a process is gone."""
    try:
        database_of(url).lock(f"job-{name}").release()
    except RunBusyError:
        return False
    return True


def test_jobs_are_processed_in_their_order_and_once(new_log: NewLog, brief: Path) -> None:
    url, told = new_log(), list[str]()
    with opened(url) as jobs:
        first, second = add(jobs, brief), add(jobs, brief, final=True)
        assert add(jobs, brief) == first
        assert [(one.id, one.state) for one in jobs.listed()] == [(first, "waiting"), (second, "waiting")]
        work(url, stays=False, tell=told.append)
        work(url, stays=False, tell=told.append)
        assert [(one.state, one.attempts) for one in jobs.listed()] == [("finished", 1)] * 2
    assert [line.split(":")[0] for line in told] == [
        f"job {first}", f"job {first} is finished", f"job {second}", f"job {second} is finished",
    ]  # fmt: skip
    with open_log(url) as log:
        assert len(log.runs()) == 2


def test_a_job_is_taken_by_one(new_log: NewLog, brief: Path) -> None:
    with opened(url := new_log()) as one, opened(url) as other:
        ids = [add(one, brief), add(one, brief, final=True)]
        taken = [one.take(), other.take()]
        assert [each.job.id for each in taken if each] == ids
        assert other.take() is None
        assert taken[0] is not None
        taken[0].give_back("somebody else is at it")
        again = other.take()
        assert again is not None
        assert (again.job.id, again.job.attempts) == (ids[0], 0)
        again.end("finished", "")
        assert taken[1] is not None
        taken[1].end("failed", "")


def test_a_job_behind_many_that_others_have_is_found(new_log: NewLog, tmp_path: Path) -> None:
    names = [f"{number:016x}" for number in range(50)]
    with opened(new_log()) as jobs:
        for name in names:
            jobs.add(name, as_text(RunRequest(tmp_path, None, "")))
        assert [one.id for one in jobs.in_state("waiting", "run")] == names
        taken = jobs.take(but=names[:45])
        assert taken is not None
        assert taken.job.id == names[45]
        taken.let_go()
        assert [one.id for one in jobs.in_state("waiting", "run")] == [*names[:45], *names[46:]]


def test_a_lock_that_a_server_dropped_is_taken_anew_or_left_to_who_has_it(postgres: NewLog, brief: Path) -> None:
    with opened(url := postgres()) as one, opened(url) as other:
        name = add(one, brief)
        taken = one.take()
        assert taken is not None
        end_all_connections(url)  # as a restart does
        assert taken.tell("goes on")
        assert other.take() is None
        end_all_connections(url)
        second = other.take()
        assert second is not None
        assert not taken.tell("goes on")
        taken.end("finished", "by the one that lost it")
        assert (other.find(name).state, other.find(name).attempts, other.find(name).message) == (
            "running",
            2,
            "goes on",
        )
        second.end("finished", "")
        assert other.find(name).state == "finished"


def test_a_folder_of_recordings_is_that_of_one_live_source(new_log: NewLog, tmp_path: Path) -> None:
    run = RunRequest(tmp_path, None, "")
    here, there = (LiveRequest("rtsp://a/1", run, tmp_path / name) for name in ("here", "there"))

    def add_live(name: str, request: LiveRequest = here) -> bool:
        with opened(url) as jobs, suppress(TakenError):
            return jobs.add(name, as_text(request), "live").state == "waiting"
        return False

    url = new_log()
    with ThreadPoolExecutor(8) as pool:
        assert sum(pool.map(add_live, "abcdefgh")) == 1
    assert add_live("i", there)
    with opened(url) as jobs:
        first = jobs.listed()[0].id
        assert jobs.cancel(first).state == "cancelled"
        assert add_live("j")
        with pytest.raises(TakenError, match="whose folder of recordings no other job has, got that of job 'j'"):
            jobs.retry(first)
        jobs.cancel("j")
        assert jobs.retry(first).state == "waiting"


@pytest.mark.long
def test_a_job_whose_worker_was_killed_is_taken_again_but_not_for_ever(new_log: NewLog, brief: Path) -> None:
    url = new_log()
    with opened(url) as jobs:
        name = add(jobs, brief)
        for attempt in range(1, MOST_ATTEMPTS + 1):
            with subprocess.Popen([sys.executable, "-c", TAKE_AND_STAY, url], stdout=subprocess.PIPE) as worker:
                assert worker.stdout is not None
                assert worker.stdout.readline() == b"taken\n"
                assert jobs.take() is None
                worker.kill()
            assert (jobs.find(name).state, jobs.find(name).attempts) == ("running", attempt)
            until(lambda: is_free(url, name))
        assert jobs.take() is None
        assert (jobs.find(name).state, jobs.find(name).message[:23]) == ("failed", "begun 3 times without a")
        assert jobs.retry(name).state == "waiting"
        last = jobs.take()
        assert last is not None
        last.end("finished", "")


@pytest.mark.long
@in_a_file
def test_a_worker_that_is_killed_leaves_nothing_half_and_nothing_twice(new_log: NewLog, tracks: Path) -> None:
    url = new_log()
    with opened(url) as jobs:
        name = add(jobs, tracks)
        worker = subprocess.Popen([*WORK, url, "--once"], stderr=subprocess.DEVNULL)
        until(lambda: " s of input" in jobs.find(name).message)
        worker.kill()
        worker.wait()
        until(lambda: is_free(url, name))
        work(url, stays=False, tell=lambda _: None)
        assert jobs.find(name).state == "finished"
    whole = new_log()
    process(RunRequest(tracks, tracks.parent / "site.toml", whole))
    again, once = kept_rows(url), kept_rows(whole)
    assert [row[1:] for row in again.pop("events")] == [row[1:] for row in once.pop("events")]
    assert again == once


@pytest.mark.slow
def test_fifty_kills_at_any_moment_lose_nothing_and_double_nothing(new_log: NewLog, tracks: Path) -> None:
    url, whole, rng = new_log(), new_log(), random.Random(1)
    floors = (0.0, 0.1, 0.2, 0.3)
    for floor in floors:
        process(RunRequest(tracks, tracks.parent / "site.toml", whole, min_confidence=floor))
    with opened(url) as jobs:
        names = [add(jobs, tracks, min_confidence=floor) for floor in floors]
        for _ in range(50):
            worker = subprocess.Popen([*WORK, url, "--once"], stderr=subprocess.DEVNULL)
            with suppress(subprocess.TimeoutExpired):
                worker.wait(rng.uniform(0.3, 1.5))  # loading takes half of it, and a job as long again
            worker.kill()
            worker.wait()
            for name in names:
                until(lambda name=name: is_free(url, name))
                jobs.change(name, ("waiting", "running"), attempts=0)
        work(url, stays=False, tell=lambda _: None)
        assert [jobs.find(name).state for name in names] == ["finished"] * len(names)
    check_same(url, whole)


def check_same(log: str, other: str) -> None:
    """Check that two logs have the same runs, which may have begun in another order."""
    again, once = kept_rows(log), kept_rows(other)
    assert {row[1] for row in again["events"]} == {row[1] for row in once["events"]}
    assert len(again.pop("events")) == len(once.pop("events"))
    for kind, rows in once.items():
        assert sorted(map(repr, again[kind])) == sorted(map(repr, rows)), kind


@in_a_file
def test_what_cannot_be_processed_fails_and_the_next_is_processed(new_log: NewLog, brief: Path) -> None:
    url, broken = new_log(), brief.parent / "broken.csv"
    broken.write_text("t_us,id\n0,a\n")
    with opened(url) as jobs:
        bad, good = add(jobs, broken), add(jobs, brief)
        work(url, stays=False, tell=lambda _: None)
        assert [jobs.find(one).state for one in (bad, good)] == ["failed", "finished"]
        assert "broken.csv" in jobs.find(bad).message


@pytest.mark.long
@in_a_file
def test_a_job_is_cancelled_before_and_while_it_runs(new_log: NewLog, small_scene: Path, brief: Path) -> None:
    url = new_log()
    with opened(url) as jobs:
        waiting = add(jobs, brief)
        assert jobs.cancel(waiting).state == "cancelled"
        with pytest.raises(QueryError, match="expected one that waits or runs, got one that is cancelled"):
            jobs.cancel(waiting)
        running = add(jobs, small_scene / "truth.csv")
        worker = threading.Thread(target=work, args=(url,), kwargs={"stays": False, "tell": lambda _: None})
        worker.start()
        until(lambda: jobs.find(running).state == "running")
        jobs.cancel(running)
        worker.join()
        assert jobs.find(running).state == "cancelled"
        finished = add(jobs, brief, final=True)
        work(url, stays=False, tell=lambda _: None)
        with pytest.raises(QueryError, match="expected one that failed or was cancelled, got one that is finished"):
            jobs.retry(finished)
        with pytest.raises(NotInLogError, match="expected the id of one of its jobs, got 'none'"):
            jobs.cancel("none")


@pytest.mark.long
@in_a_file
def test_a_run_that_somebody_processes_by_hand_holds_up_no_others(new_log: NewLog, brief: Path) -> None:
    url, whole = new_log(), new_log()
    process(RunRequest(brief, brief.parent / "site.toml", whole))
    with open_log(whole) as log:
        record = msgspec.structs.replace(log.run(), status="running")
    with opened(url) as jobs, open_log(url, "w") as by_hand:
        writer = by_hand.begin_run(record)
        first, second = add(jobs, brief), add(jobs, brief, final=True)
        worker = threading.Thread(target=work, args=(url,), kwargs={"stays": False, "tell": lambda _: None})
        worker.start()
        until(lambda: jobs.find(second).state == "finished")
        assert jobs.find(first).state in ("waiting", "running")
        writer.finish("interrupted")
        worker.join()
        assert jobs.find(first).state == "finished"


@pytest.mark.long
@in_a_file
@pytest.mark.parametrize(
    "has_come",
    [lambda job: job.state == "running", lambda job: " s of input" in job.message],
    ids=["as it begins", "later"],
)
def test_a_signal_gives_the_job_back(new_log: NewLog, small_scene: Path, has_come: Callable[[Job], bool]) -> None:
    url = new_log()
    with opened(url) as jobs:
        name = add(jobs, small_scene / "truth.csv")
        worker = subprocess.Popen([*WORK, url], stderr=subprocess.PIPE)
        until(lambda: has_come(jobs.find(name)))
        worker.send_signal(signal.SIGTERM)
        worker.communicate()
        assert worker.returncode == 130
        assert (jobs.find(name).state, jobs.find(name).attempts) == ("waiting", 0)


@pytest.mark.long
@in_a_file
@pytest.mark.parametrize("during", ["requests.read_request", "processing.load_chronicle_texts"])
def test_a_signal_before_the_run_has_begun_gives_the_job_back(
    new_log: NewLog, brief: Path, monkeypatch: pytest.MonkeyPatch, during: str
) -> None:
    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    url = new_log()
    with opened(url) as jobs:
        name = add(jobs, brief)
        with monkeypatch.context() as patched:
            patched.setattr(f"service.runs.{during}", stop)
            with pytest.raises(KeyboardInterrupt):
                work(url, stays=False, tell=lambda _: None)
        assert (jobs.find(name).state, jobs.find(name).attempts) == ("waiting", 0)
        work(url, stays=False, tell=lambda _: None)
        assert (jobs.find(name).state, jobs.find(name).attempts) == ("finished", 1)


def test_a_signal_as_a_job_is_taken_gives_it_back(
    new_log: NewLog, brief: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin = TakenJob.begin

    def stop(taken: TakenJob) -> bool:
        assert begin(taken)
        raise KeyboardInterrupt

    with opened(new_log()) as jobs:
        name = add(jobs, brief)
        monkeypatch.setattr(TakenJob, "begin", stop)
        with pytest.raises(KeyboardInterrupt):
            jobs.take()
        assert (jobs.find(name).state, jobs.find(name).attempts) == ("waiting", 0)
        assert jobs.is_left(name)


def test_the_commands_queue_and_list(tmp_path: Path, brief: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = str(tmp_path / "a.db")
    assert [run_cli([*command, log]) for command in (["jobs", "list"], ["worker"])] == [3, 3]
    assert not (tmp_path / "a.db").exists()
    assert run_cli(["process", str(tmp_path / "none.mp4"), "--log", log, "--queue"]) == 3
    assert "none.mp4: expected a file" in capsys.readouterr().err
    assert run_cli(["process", str(brief), "--log", log, "--queue", "--final"]) == 0
    name = capsys.readouterr().out.split()[1]
    assert run_cli(["jobs", "cancel", log, name]) == 0
    assert run_cli(["jobs", "retry", log, name]) == 0
    assert run_cli(["worker", log, "--once"]) == 0
    assert run_cli(["jobs", "list", log]) == 0
    shown = capsys.readouterr().out
    assert f"job {name} is cancelled\njob {name} is waiting\n" in shown
    assert f"{name}  finished  1         {brief}  run " in shown
