"""How is what takes long computed without holding up anything else? By a process beside the server, for a time.

In a thread it would take the interpreter from all other answers, and nothing could end it. A process can be ended where
it only reads.
"""

from collections.abc import Callable
from typing import TypeVar, TypeVarTuple

from anyio import BrokenWorkerProcess, CapacityLimiter, fail_after, to_process

from service.errors import CrowdedError, UnansweredError
from service.runs.machine import cores

ANSWERED_WITHIN_S = 10.0
"""An answer, with the time that it waits for a process."""

WAITING_PER_CORE = 8
"""More would wait longer than they may, if each before them takes what it may."""

_Arguments = TypeVarTuple("_Arguments")
_Answer = TypeVar("_Answer")


class ProcessPool:
    """Processes that answer questions to one log, as many as there are cores; they stay for the questions to come.

    Parameters
    ----------
    log : its URL.
    """

    def __init__(self, log: str) -> None:
        self._log = log
        self._limiter = CapacityLimiter(cores())

    @property
    def waiting(self) -> int:
        """Count the questions that wait for a process."""
        return self._limiter.statistics().tasks_waiting

    async def ask(self, function: Callable[[str, *_Arguments], _Answer], *arguments: *_Arguments) -> _Answer:
        """Call a function of a module with the log and more, in a process; what it takes, gives or raises is pickled.

        Raises
        ------
        CrowdedError
            If too many wait already.
        UnansweredError
            If it takes too long; besides, what the function raises.
        """
        most = WAITING_PER_CORE * int(self._limiter.total_tokens)
        if self.waiting >= most:
            raise CrowdedError(f"questions: expected at most {most} that wait, got one more; ask again later")
        try:
            with fail_after(ANSWERED_WITHIN_S):
                return await to_process.run_sync(
                    function, self._log, *arguments, cancellable=True, limiter=self._limiter
                )
        except TimeoutError as error:
            wanted = f"answer: expected one within {ANSWERED_WITHIN_S:g} s, got none"
            raise UnansweredError(f"{wanted}; ask about less time, or later if much else is asked") from error
        except BrokenWorkerProcess as error:
            raise UnansweredError("answer: expected one, got a process that was ended; ask again") from error
