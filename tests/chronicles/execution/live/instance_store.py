"""The eager executor of one chronicle, for tests."""

from collections.abc import Iterator
from typing import Any

from chronicles.compilation.plan import Plan
from chronicles.execution.instances import Instance, Record
from chronicles.execution.live.eager import EagerExecutor


class InstanceStore:
    """An `EagerExecutor` of one plan; its methods leave out the chronicle's number."""

    def __init__(self, plan: Plan) -> None:
        self._executor = EagerExecutor({0: plan})
        self.names = self._executor.names
        self.sweep = self._executor.sweep
        self.state = self._executor.state
        self.restore = self._executor.restore

    def feed(self, record: Record) -> tuple[list[Instance], int]:
        complete, created = self._executor.feed(record)
        return [instance for _, instances in complete for instance in instances], created

    def waiting(self, now_us: int) -> Iterator[tuple[int, Any]]:
        return self._executor.waiting(0, now_us)
