"""What processes of the tests do in place of an answer; it imports little, so that they are there soon."""

import os
import time
from pathlib import Path


def stay(*_: object, **__: object) -> None:
    """Take an hour."""
    time.sleep(3600.0)


def begin(*told: str) -> None:
    """Say that a process came here, by a file that is named last, and stay."""
    Path(told[-1]).touch()
    stay()


def end(_: str) -> None:
    """End the process at once."""
    os._exit(1)
