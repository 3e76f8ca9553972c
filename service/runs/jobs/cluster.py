"""How are jobs processed by a Ray cluster? Each is a task there, which does what a worker does with one job.

The lock of a job in the database says who is at it, and its row how it ended; Ray knows nothing that is not there. So a
task that is repeated, or placed twice, finds a job that has ended or is taken, and returns.
"""

import logging
import socket
import time
from contextlib import closing
from itertools import islice
from typing import Any  # what is Ray's: it is an extra, and may not be here
from urllib.parse import urlsplit

from service.errors import ClusterError, LogError, ServiceError
from service.runs.inputs.detectors import USUAL_DETAILS, OnnxChoice, choose_detector
from service.runs.inputs.sites.site import SiteFile
from service.runs.jobs.worker import ASKED_EVERY_S, Tell, process_job
from service.runs.machine import Interrupts, look_seldom
from service.runs.requests import LiveRequest, RunRequest, read_request
from service.store.databases.location import database_of, log_files
from service.store.entries import UNDER_WAY, JobKind
from service.store.registers.jobs import MOST_ATTEMPTS, Jobs
from service.texts.toml_tables import read_toml
from vision.errors import VisionError

MOST_RETRIES: dict[JobKind, int] = {"run": MOST_ATTEMPTS, "live": -1}
"""How often Ray repeats a task: that of a run once more than it may be begun, since the last one notes in the log that
it was begun too often; that of a live source, which has no end, always."""
MOST_PLACED = 1_000
"""Of the jobs of a kind and state; Ray gets the others as these end."""
REACHED_WITHIN_S = 5.0
ENDED_WITHIN_S = 30.0
"""A task ends between two frames; one that takes longer is left to Ray, which kills it."""


def work_on_cluster(log_url: str, address: str, *, stays: bool, tell: Tell) -> None:
    """Place the jobs of a log on a Ray cluster, and wait for them.

    Parameters
    ----------
    address : as Ray has it: ``auto``, ``HOST:PORT`` or ``ray://HOST:PORT``.
    stays : wait for more where there are none; else return then.
    tell : gets a line when a job is placed, and those of its worker when its task has ended.

    Raises
    ------
    LogError
        If there is no such log, or it cannot be read or written.
    ClusterError
        If there is no such cluster, or it cannot run DyKnow.
    KeyboardInterrupt
        If a signal came; the jobs that were under way wait again.
    """
    database = database_of(log_url)
    database.check_readable()  # a name that was mistyped makes no new log
    database.check_writable()
    files = log_files(log_url)
    everywhere = f"sqlite:///{files[0].absolute()}" if files else log_url  # tasks have another working directory
    ray = _connected(address)
    jobs = Jobs(database)
    placing = _Placing(ray, jobs, everywhere, tell)
    try:
        with Interrupts() as interrupts:
            while interrupts.came is None:
                placing.place()
                if not placing.tasks and not stays:
                    return
                time.sleep(ASKED_EVERY_S)
                placing.tell_ended()
        raise KeyboardInterrupt
    finally:
        placing.end()
        jobs.close()
        ray.shutdown()


class _Placing:
    """Have each job that nobody is at placed once.

    Attributes
    ----------
    tasks : those that have not ended, with the identifiers of their jobs.
    """

    def __init__(self, ray: Any, jobs: Jobs, log_url: str, tell: Tell) -> None:
        self.tasks = dict[Any, str]()
        self._ray = ray
        self._jobs = jobs
        self._log_url = log_url
        self._tell = tell
        self._works = {kind: ray.remote(max_retries=most)(_work_at) for kind, most in MOST_RETRIES.items()}
        self._has_gpu = ray.cluster_resources().get("GPU", 0) > 0

    def place(self) -> None:
        """Place the jobs that wait, and those that their workers have left."""
        placed = set(self.tasks.values())
        kinds = [(state, kind) for kind in MOST_RETRIES for state in UNDER_WAY]
        for job in [one for each in kinds for one in islice(self._jobs.in_state(*each), MOST_PLACED)]:
            if job.id in placed or (job.state == "running" and not self._jobs.is_left(job.id)):
                continue
            request = read_request(job.request, self._log_url)
            request = request.run if isinstance(request, LiveRequest) else request
            wanted = {"num_cpus": 1 + (request.workers or 0), "num_gpus": int(self._has_gpu and asks_for_gpu(request))}
            task = self._works[job.kind].options(name=f"job {job.id}", **wanted).remote(self._log_url, job.id)
            self.tasks[task] = job.id
            self._tell(f"job {job.id} is placed: {job.input}")

    def tell_ended(self) -> None:
        """Tell of the tasks that have ended."""
        ended, _ = self._ray.wait(list(self.tasks), num_returns=len(self.tasks), timeout=0) if self.tasks else ((), ())
        for task in ended:
            for line in self._lines_of(task, self.tasks.pop(task)):
                self._tell(line)

    def end(self) -> None:
        """Stop what is under way as Ctrl-C does, so that it waits again."""
        for task in self.tasks:
            self._ray.cancel(task)
        if self.tasks:
            self._ray.wait(list(self.tasks), num_returns=len(self.tasks), timeout=ENDED_WITHIN_S)

    def _lines_of(self, task: Any, job_id: str) -> list[str]:
        kinds = self._ray.exceptions
        try:
            return list(self._ray.get(task))
        except kinds.RayTaskError as error:
            if isinstance(error, LogError):  # the database may be back soon
                return [f"job {job_id} is left: {error.args[0]}"]
            wanted = f"job {job_id}: expected this version of DyKnow on all machines of the cluster"
            raise ClusterError(f"{wanted}, got {error.cause!r}") from error
        except kinds.RayError as error:  # its process was killed, or its machine is gone
            return [f"job {job_id} is left: {_first_line(error)}"]


def asks_for_gpu(request: RunRequest) -> bool:
    """Tell whether the detector of a request would be computed by CUDA first.

    What cannot be read here is told by who processes it.
    """
    try:
        said, folder = USUAL_DETAILS, request.input.parent
        if request.site is not None:
            said, folder = read_toml(request.site, SiteFile, what="a site file").detector, request.site.parent
        choice = choose_detector(request.detector, said, folder=folder, columns=request.columns)
    except (ServiceError, VisionError):
        return False
    return isinstance(choice, OnnxChoice) and choice.settings.providers[0] == "cuda"


def _work_at(log_url: str, job_id: str) -> list[str]:
    """Process a job, in a process of Ray's; give the lines that a worker would tell."""
    look_seldom()
    told = list[str]()
    with closing(Jobs(database_of(log_url))) as jobs:
        taken = jobs.take_this(job_id)
        if taken is not None:
            try:
                process_job(taken, log_url, told.append, has_free_cores=False)
            finally:
                taken.let_go()  # whatever happened: the process stays for other tasks, and its locks with it
    return told


def _connected(address: str) -> Any:
    """Connect this process to a cluster; give the module of Ray."""
    try:
        import ray
    except ModuleNotFoundError as error:
        wanted = "expected the extra 'cluster' (pip install 'dyknow[cluster]')"
        raise ClusterError(f"cluster {address!r}: {wanted}, got {str(error)!r}") from error
    try:
        place = urlsplit(address if "://" in address else f"//{address}")
        if place.port is not None:  # Ray itself tries for minutes, and tells each time
            socket.create_connection((place.hostname or "", place.port), timeout=REACHED_WITHIN_S).close()
        ray.init(address, logging_level=logging.ERROR, log_to_driver=False)
    except Exception as error:  # Ray's have no class in common
        wanted = "expected the address of a Ray cluster that answers (auto, HOST:PORT or ray://HOST:PORT)"
        raise ClusterError(f"cluster {address!r}: {wanted}, got {_first_line(error)!r}") from error
    return ray


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0]
