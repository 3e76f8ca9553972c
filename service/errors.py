"""What can go wrong in `service`, as one exception family."""


class ServiceError(Exception):
    """Base of every error that `service` raises: where, what was expected, what came."""
