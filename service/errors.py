"""What can go wrong in `service`, as one exception family."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dyknow.language.diagnostics import Diagnostic


class ServiceError(Exception):
    """Base of every error that `service` raises: where, what was expected, what came."""


class InputError(ServiceError):
    """An input file that is missing, unreadable or not what it should be."""


class SiteError(InputError):
    """A site file, or another TOML file of ours, with a missing, wrong or unknown field."""


class LogError(ServiceError):
    """An event log that cannot be opened, is not one, or is too new."""


class LogBackError(LogError):
    """An event log that was away while it was written, and answers again."""


class NotInLogError(LogError):
    """Something asked for by name that an event log does not hold."""


class RunBusyError(LogError):
    """A run that somebody else is writing at this moment."""


class ClusterError(ServiceError):
    """A Ray cluster that does not answer, cannot run DyKnow, or no Ray to ask it with."""


class TruthError(InputError):
    """A truth folder that is missing or does not fit the log."""


class QueryError(ServiceError):
    """A question to the event log with a malformed parameter.

    Attributes
    ----------
    parameter : the parameter at fault, as HTTP spells it.
    """

    def __init__(self, message: str, *, parameter: str = "") -> None:  # pickling sets it afterwards
        super().__init__(message)
        self.parameter = parameter


class FilterError(QueryError):
    """Parameters that are well formed one by one, but contradict each other."""


class CursorError(QueryError):
    """A page cursor that is not one of ours, or belongs to other filters."""


class TextRefusedError(ServiceError):
    """A text with errors.

    Attributes
    ----------
    findings : all that was found in it.
    """

    def __init__(self, message: str, findings: "Sequence[Diagnostic]" = ()) -> None:
        super().__init__(message)
        self.findings = findings


class TakenError(ServiceError):
    """A name that something else has already, or a thing that something else still needs."""


class VersionError(ServiceError):
    """A change of something that somebody else has changed since it was read."""


class UnansweredError(ServiceError):
    """A question that took too long, or whose process was ended; it may be asked again."""


class CrowdedError(ServiceError):
    """More at once than a server takes; to be asked for later."""


class ExtraMissingError(ServiceError):
    """What is asked for needs a library that is not installed."""


class ExportError(ServiceError):
    """An export that cannot be made from this log, or a file of ours that cannot be read back."""
