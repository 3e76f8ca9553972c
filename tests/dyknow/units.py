"""Small computational units for tests."""

from collections.abc import Iterable
from typing import Any

from dyknow.sample import Sample


class Doubling:
    """Answer a number with its double."""

    def update(self, sample: Sample[int]) -> Iterable[Sample[int]]:
        return (Sample(sample.available_us, sample.valid_us, 2 * sample.value),)

    def finish(self) -> Iterable[Sample[int]]:
        return ()


class Pairing:
    """Answer every second sample with the last two values; hold an odd one until the end."""

    def __init__(self) -> None:
        self.held: list[Sample[int]] = []

    def update(self, sample: Sample[int]) -> Iterable[Sample[list[int]]]:
        self.held.append(sample)
        return self.finish() if len(self.held) == 2 else ()

    def finish(self) -> Iterable[Sample[list[int]]]:
        if not self.held:
            return ()
        last = self.held[-1]
        values = [sample.value for sample in self.held]
        self.held = []
        return (Sample(last.available_us, last.valid_us, values),)


class Latest:
    """Answer a sample of several inputs with the newest value of each."""

    def __init__(self) -> None:
        self.values: dict[int, int] = {}

    def update(self, index: int, sample: Sample[int], /) -> Iterable[Sample[dict[int, int]]]:
        self.values[index] = sample.value
        return (Sample(sample.available_us, sample.valid_us, dict(self.values)),)

    def finish(self) -> Iterable[Sample[dict[int, int]]]:
        return ()


class Silence:
    """Say how long nothing came, when told the time."""

    def __init__(self) -> None:
        self.last_us = 0

    def update(self, sample: Sample[int]) -> Iterable[Sample[int]]:
        self.last_us = sample.available_us
        return ()

    def advance(self, available_us: int) -> Iterable[Sample[int]]:
        return (Sample(available_us, available_us, available_us - self.last_us),)

    def finish(self) -> Iterable[Sample[int]]:
        return ()


class Recorder:
    """Keep the samples that a subscription delivers."""

    def __init__(self) -> None:
        self.samples: list[Sample[Any]] = []

    def __call__(self, sample: Sample[Any]) -> None:
        """Keep a sample."""
        self.samples.append(sample)

    @property
    def values(self) -> list[Any]:
        """Return the values that came, in order."""
        return [sample.value for sample in self.samples]
