"""What do the golden logs not know yet? Said at the end of the test run; it is no failure."""

from collections.abc import Sequence

import pytest


class NotPinned:
    """Tables, columns and fields of a log that its golden log does not have, by input."""

    def __init__(self) -> None:
        self.noted: dict[str, Sequence[str]] = {}

    def note(self, folder: str, names: Sequence[str]) -> None:
        """Remember what to tell at the end."""
        if names:
            self.noted[folder] = names


_NOTED = pytest.StashKey[NotPinned]()


def pytest_configure(config: pytest.Config) -> None:
    config.stash[_NOTED] = NotPinned()


@pytest.fixture
def not_pinned(request: pytest.FixtureRequest) -> NotPinned:
    return request.config.stash[_NOTED]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    for folder, names in config.stash[_NOTED].noted.items():
        terminalreporter.write_line(f"golden log {folder}: not pinned yet (UPDATE_GOLDEN=1): {', '.join(names)}")
