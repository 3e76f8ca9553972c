"""What can go wrong in `dyknow`, as one exception family."""


class DyKnowError(Exception):
    """Base of every error that `dyknow` raises: where, what was expected, what came."""


class PolicyError(DyKnowError):
    """A policy that contradicts itself or that no stream can satisfy."""


class StreamError(DyKnowError):
    """An unknown label, a label given twice, or a use after closing."""


class ProcessError(DyKnowError):
    """A process that cannot be created, removed, or fed what came."""


class RegistryError(DyKnowError):
    """A name that no source or unit has, or that two of them claim."""
