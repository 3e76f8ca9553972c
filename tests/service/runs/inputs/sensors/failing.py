"""A sensor of which the vision fails; it imports little, as a process of its own begins with it."""

from service.errors import InputError


class FailingSensor:
    """A sensor of which the vision fails."""

    def vision(self) -> None:
        """Fail."""
        raise InputError("fair.mp4 at 1.00 s: expected vehicles, got a fair")


class Failing:
    """What becomes such a sensor in the process that it is sent to."""

    def __reduce__(self) -> tuple[object, ...]:
        return FailingSensor, ()
