"""What is still to be processed into a log, and who is at it? Jobs, kept in the log itself.

A worker that has a job holds a lock of the database, which goes with its process: whoever finds a job that is said to
run, and can take its lock, knows that its worker is gone, and takes it up again. No clock is asked, so none is wrong.
"""

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from msgspec.structs import astuple
from sqlalchemy import ColumnElement, Connection, Select, func, select, update

from service.errors import NotInLogError, QueryError, RunBusyError, TakenError
from service.store import schema
from service.store.databases.database import Database, Lock
from service.store.entries import UNDER_WAY, Job, JobKind, JobState
from service.store.log import EventLog
from service.store.versions import create_schema
from service.store.writer import insert_rows, lock_seqs

MOST_ATTEMPTS = 3
"""A run that was begun so many times without an end is not tried again by itself."""
_AGAIN = {"state": "waiting", "attempts": 0, "cancel_requested": False}
_ANEW = {**_AGAIN, "message": ""}
_PAGE = 20


class Jobs:
    """The jobs of one log; close it after use.

    Parameters
    ----------
    database : of the log; its tables are made, or carried over, if need be.

    Raises
    ------
    LogError
        If the database refuses.
    """

    def __init__(self, database: Database) -> None:
        self._log = EventLog(database, "w")
        with self._log.change() as connection:
            create_schema(connection)

    def close(self) -> None:
        """Close all connections."""
        self._log.close()

    def add(self, job_id: str, request: str, kind: JobKind = "run") -> Job:
        """Add a job at the end; one that is here already is given as it is.

        Raises
        ------
        TakenError
            If it is a live source, and another job that has not ended is recorded into the same folder.
        """
        with self._log.change() as connection:
            lock_seqs(connection)  # one at a time takes a number
            known = connection.execute(_jobs(schema.jobs.c.id == job_id)).one_or_none()
            if known is not None:
                return Job(*known)
            last = connection.scalar(select(func.max(schema.jobs.c.number))) or 0
            job = Job(last + 1, job_id, request, kind=kind)
            _check_alone(connection, job)
            insert_rows(connection, schema.jobs, [astuple(job)])
            return job

    def listed(self, *, after: int = 0, most: int | None = None) -> list[Job]:
        """List all jobs in their order, or so many at most behind a number."""
        return self._log.rows(Job, _jobs(schema.jobs.c.number > after).limit(most))

    def take(self, kind: JobKind = "run", *, but: Collection[str] = ()) -> "TakenJob | None":
        """Begin the first job of a kind that waits, or where none does one that was left; None if there is none.

        Parameters
        ----------
        but : identifiers of jobs that are not to be taken.
        """
        for state in UNDER_WAY:
            for job in self.in_state(state, kind):
                taken = None if job.id in but else self._begun(job)
                if taken is not None:
                    return taken
        return None

    def take_this(self, job_id: str) -> "TakenJob | None":
        """Begin one job; None if somebody is at it, or if it has ended; raises as `find`."""
        return self._begun(self.find(job_id))

    def in_state(self, state: JobState, kind: JobKind) -> Iterator[Job]:
        """Stream the jobs of a kind that are in a state, in their order; who wants the first one reads few."""
        jobs, last = schema.jobs.c, 0
        while page := self._log.rows(
            Job, _jobs(jobs.state == state, jobs.kind == kind, jobs.number > last).limit(_PAGE)
        ):
            yield from page
            last = page[-1].number

    def is_left(self, job_id: str) -> bool:
        """Tell whether nobody is at a job."""
        lock = self.lock(job_id)
        if lock is not None:
            lock.release()
        return lock is not None

    def cancel(self, job_id: str) -> Job:
        """Ask for the end of a job: one that waits is not begun, one that runs is stopped by its worker.

        Raises
        ------
        NotInLogError
            If there is no such job.
        QueryError
            If it has ended.
        """
        is_kept_away = self.change(job_id, ("waiting",), state="cancelled")
        is_asked_for = not is_kept_away and self.change(job_id, ("running",), cancel_requested=True)
        return self._found(job_id, "one that waits or runs", is_right=is_kept_away or is_asked_for)

    def retry(self, job_id: str) -> Job:
        """Let a job wait again that failed or was cancelled; raises as `cancel` and `add`."""
        job = self.find(job_id)
        with self._log.change() as connection:
            lock_seqs(connection)
            _check_alone(connection, job)
            is_right = _change(connection, job_id, ("failed", "cancelled"), _ANEW)
        return self._found(job_id, "one that failed or was cancelled", is_right=is_right)

    def repeat(self, job_id: str) -> None:
        """Let a job wait again if it has ended; a run that the log has, finished, is only looked for.

        What such a run found stays in the message until then.
        """
        self.change(job_id, ("failed", "cancelled"), **_ANEW)
        self.change(job_id, ("finished",), **_AGAIN)

    def change(self, job_id: str, states: tuple[JobState, ...], **values: object) -> bool:
        """Change a job if it is in one of these states; tell whether it was."""
        with self._log.change() as connection:
            return _change(connection, job_id, states, values)

    def find(self, job_id: str) -> Job:
        """Find a job.

        Raises
        ------
        NotInLogError
            If there is none.
        """
        found = self._log.rows(Job, _jobs(schema.jobs.c.id == job_id))
        if not found:
            raise NotInLogError(f"log {self._log.place.name!r}: expected the id of one of its jobs, got {job_id!r}")
        return found[0]

    def _found(self, job_id: str, expected: str, *, is_right: bool) -> Job:
        job = self.find(job_id)
        if not is_right:
            raise QueryError(f"job {job_id!r}: expected {expected}, got one that is {job.state}", parameter="job")
        return job

    def _begun(self, job: Job) -> "TakenJob | None":
        lock = self.lock(job.id)
        if lock is None:
            return None
        taken = TakenJob(self, job, lock)
        is_begun = False
        try:
            is_begun = taken.begin()
        except KeyboardInterrupt:  # it may have been noted by then
            taken.give_back("")
            raise
        finally:
            if not is_begun:
                taken.let_go()
        return taken if is_begun else None

    def lock(self, job_id: str) -> Lock | None:
        """Take the right to be at a job; None if somebody is."""
        try:
            return self._log.place.lock(f"job-{job_id}")
        except RunBusyError:
            return None


class TakenJob:
    """A job that this process is at.

    Attributes
    ----------
    job : as it was taken.
    """

    def __init__(self, jobs: Jobs, job: Job, lock: Lock) -> None:
        self.job = job
        self._jobs = jobs
        self._lock = lock

    def begin(self) -> bool:
        """Note that it runs; False if it has ended meanwhile, or is a run that was begun too often without an end."""
        job = self.job = self._jobs.find(self.job.id)
        if job.state not in UNDER_WAY:
            return False
        if job.cancel_requested:
            return self._end_without("cancelled", "")
        if job.kind == "run" and job.attempts >= MOST_ATTEMPTS:
            return self._end_without("failed", f"begun {job.attempts} times without an end; {job.message}")
        return self._jobs.change(job.id, UNDER_WAY, state="running", attempts=job.attempts + 1)

    def tell(self, message: str) -> bool:
        """Note how far it has come; False if it is not wanted any more, or somebody else is at it."""
        if not self._lock.is_held():
            return False
        self._jobs.change(self.job.id, ("running",), message=message)
        return not self._jobs.find(self.job.id).cancel_requested

    def end(self, state: JobState, message: str) -> None:
        """Note how it ended, or that it waits again, and let it go; what waits is still to be cancelled if it was."""
        asked = {} if state == "waiting" else {"cancel_requested": False}
        self._note_end(state=state, message=message, **asked)

    def give_back(self, message: str) -> None:
        """Let it wait again as if it had not been begun."""
        self._note_end(state="waiting", attempts=self.job.attempts, message=message)

    def let_go(self) -> None:
        """Let others have it, as it stands in the log; a second time changes nothing."""
        self._lock.release()

    def _note_end(self, **values: object) -> None:
        if self._lock.is_held():
            self._jobs.change(self.job.id, ("running",), **values)
        self._lock.release()

    def _end_without(self, state: JobState, message: str) -> bool:
        self._jobs.change(self.job.id, UNDER_WAY, state=state, message=message)
        return False


def count_jobs(log: EventLog) -> dict[str, int]:
    """Count the jobs of a log that is open, by state."""
    state = schema.jobs.c.state
    with log.connect() as connection:
        return {one: count for one, count in connection.execute(select(state, func.count()).group_by(state))}  # noqa: C416


def _change(connection: Connection, job_id: str, states: tuple[JobState, ...], values: Mapping[str, object]) -> bool:
    is_it = (schema.jobs.c.id == job_id) & schema.jobs.c.state.in_(states)
    return connection.execute(update(schema.jobs).where(is_it).values(values)).rowcount > 0


def _check_alone(connection: Connection, job: Job) -> None:
    """Refuse a live source whose recordings are another job's; numbers are locked, so nobody adds one meanwhile."""
    if job.kind == "run":
        return
    jobs = schema.jobs.c
    others = _jobs(jobs.kind == job.kind, jobs.state.in_(UNDER_WAY), jobs.id != job.id)
    for other in (Job(*row) for row in connection.execute(others)):
        if other.recordings == job.recordings:
            wanted = "expected a live source whose folder of recordings no other job has"
            raise TakenError(f"source: {wanted}, got that of job {other.id!r}")


def _jobs(*conditions: ColumnElement[bool]) -> Select[Any]:  # Any: rows have the types of the table's columns
    return select(schema.jobs).where(*conditions).order_by(schema.jobs.c.number)
