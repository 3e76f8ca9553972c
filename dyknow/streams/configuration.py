"""Which processes should exist now? A configuration process keeps the node as a stream says."""

from collections.abc import Callable, Hashable, Iterable
from contextlib import ExitStack
from typing import Any

from dyknow.policies.policy import Policy
from dyknow.sample import Sample
from dyknow.streams.process import Process
from dyknow.streams.stream import StreamGenerator

Wanted = Callable[[Any], Iterable[Hashable]]  # Any: takes the values of the stream that is followed


class Configuration(Process):
    """Create processes for keys that appear in a stream, and remove them when the keys are gone.

    What was created for a key is known, so it is removed as a whole, last things first; with the configuration itself
    everything goes that it created.

    Parameters
    ----------
    wanted : the keys for which processes should exist, read off a value of the input.
    build : creates the processes of a key; returns their labels in the order of creation.
    tear_down : removes a process by label.
    """

    def __init__(
        self,
        output: StreamGenerator,
        *,
        wanted: Wanted,
        build: Callable[[Hashable], tuple[str, ...]],
        tear_down: Callable[[str], None],
    ) -> None:
        super().__init__(output, kind="configuration")
        self._wanted = wanted
        self._build = build
        self._tear_down = tear_down
        self._built: dict[Hashable, tuple[str, ...]] = {}

    @property
    def built(self) -> dict[Hashable, tuple[str, ...]]:
        """Return the labels of the processes that exist for each key."""
        return dict(self._built)

    def follow(self, stream: StreamGenerator, policy: Policy) -> None:
        """Begin to read the stream that says which processes should exist."""
        self.read(stream, self.consume, policy)

    def consume(self, sample: Sample[Any]) -> None:
        """Remove what is not wanted any more, then create what is newly wanted, each in the order of the keys."""
        self.updates += 1
        wanted = dict.fromkeys(self._wanted(sample.value))
        for key in [key for key in self._built if key not in wanted]:
            self._remove(key)
        for key in wanted:
            if key not in self._built and not self.output.is_closed:
                self._built[key] = self._build(key)
        if self.output.is_closed:  # what was built has removed its builder
            self._remove_all()

    def close(self) -> None:
        """Stop to read, and remove everything that was created."""
        with ExitStack() as steps:  # both are done, also when one fails; the last sample may still create something
            steps.callback(self._remove_all)
            super().close()

    def _remove_all(self) -> None:
        with ExitStack() as steps:
            for key in reversed(self._built):
                steps.callback(self._remove, key)

    def _remove(self, key: Hashable) -> None:
        """Remove what was created for a key; what cannot be removed is remembered, and so tried again."""
        while self._built.get(key):
            self._tear_down(self._built[key][-1])
            self._built[key] = self._built[key][:-1]
        self._built.pop(key, None)
