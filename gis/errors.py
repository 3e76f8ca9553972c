"""What can go wrong in `gis`, as one exception family."""


class GisError(Exception):
    """Base of every error that `gis` raises: where, what was expected, what came."""
