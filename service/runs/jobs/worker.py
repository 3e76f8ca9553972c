"""How are jobs processed? One after the other, by as many workers as there are, on any machine that reaches the log."""

import logging
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from typing import TYPE_CHECKING

from chronicles.errors import ChronicleError
from dyknow.errors import DyKnowError
from service.errors import LogError, RunBusyError, ServiceError
from service.store.databases.location import database_of
from service.store.entries import JobState
from service.store.registers.jobs import Jobs, TakenJob
from vision.errors import VisionError

if TYPE_CHECKING:
    from service.runs.processing import Progress, RunSummary

TOLD_EVERY_S = 1.0
ASKED_EVERY_S = 1.0

Tell = Callable[[str], None]
_LOGGER = logging.getLogger(__name__)


def work(log_url: str, *, stays: bool, tell: Tell) -> None:
    """Process the jobs of a log.

    Parameters
    ----------
    stays : wait for more where there are none; else return then.
    tell : gets a line when a job begins and when it ends.

    Raises
    ------
    LogError
        If there is no such log, or it cannot be read or written.
    KeyboardInterrupt
        If a signal stopped a run; its job waits again.
    """
    database = database_of(log_url)
    database.check_readable()  # a name that was mistyped makes no new log
    database.check_writable()
    busy = set[str]()  # jobs of runs that somebody else processes: others go before them
    with closing(Jobs(database)) as jobs:
        while True:
            taken = jobs.take(but=busy)
            if taken is None and not busy and not stays:
                return
            if taken is None:
                busy.clear()
                time.sleep(ASKED_EVERY_S)
            elif not process_job(taken, log_url, tell):
                busy.add(taken.job.id)


def process_job(taken: TakenJob, log_url: str, tell: Tell, *, has_free_cores: bool = True) -> bool:
    """Process one job; False if somebody else, who has no job for it, is at the same run.

    Parameters
    ----------
    tell : gets a line when it begins and when it ends.
    has_free_cores : False where the other cores have jobs of their own, so that vision gets none unless asked for.

    Raises
    ------
    LogError
        If the database cannot be written.
    KeyboardInterrupt
        If a signal stopped the run; the job waits again.
    """
    # What processes takes 100 MB, which a worker that only waits for jobs does not need.
    from service.runs.processing import process
    from service.runs.requests import read_request

    request = read_request(taken.job.request, log_url)
    if request.workers is None and not has_free_cores:
        request = replace(request, workers=0)
    tell(f"job {taken.job.id}: {request.input}")
    watch = _Watch(taken)
    try:
        summary = process(request, on_progress=watch)
    except KeyboardInterrupt:  # before the run has begun to look for signals
        taken.give_back("stopped before it began")
        raise
    except RunBusyError as error:
        taken.give_back(str(error))
        return False
    except LogError as error:  # the database may be back soon
        _end(taken, "waiting", str(error), tell)
        time.sleep(ASKED_EVERY_S)
    except (ServiceError, VisionError, ChronicleError, DyKnowError) as error:
        _end(taken, "failed", str(error), tell)
    except Exception as error:
        _LOGGER.exception("job %s", taken.job.id)
        _end(taken, "failed", f"a fault of ours: {error!r}", tell)
    else:
        _conclude(taken, summary, tell, cancel_requested=watch.cancel_requested)
    return True


def _conclude(taken: TakenJob, summary: "RunSummary", tell: Tell, *, cancel_requested: bool) -> None:
    if summary.status == "finished":
        _end(taken, "finished", f"run {summary.run}", tell)
    elif cancel_requested:
        _end(taken, "cancelled", summary.reason, tell)
    elif summary.status == "interrupted":
        taken.give_back(summary.reason)
        raise KeyboardInterrupt
    else:
        _end(taken, "failed", summary.reason, tell)


def _end(taken: TakenJob, state: JobState, message: str, tell: Tell) -> None:
    taken.end(state, message)
    tell(f"job {taken.job.id} {'waits again' if state == 'waiting' else 'is ' + state}: {message}")


class _Watch:
    """Note once a second how far a job has come, and stop it once it is not wanted any more."""

    def __init__(self, taken: TakenJob) -> None:
        self.cancel_requested = False
        self._taken = taken
        self._due_s = 0.0

    def __call__(self, progress: "Progress") -> None:
        now_s = time.monotonic()
        if now_s < self._due_s:
            return
        self._due_s = now_s + TOLD_EVERY_S
        self.cancel_requested = not self._taken.tell(
            f"{progress.media_us / 1e6:.0f} s of input, {progress.frames} frames"
        )
        if self.cancel_requested:
            raise KeyboardInterrupt  # as Ctrl-C stops a run: between two frames, with what is known told
