"""What can go wrong in `data_gen`, as one exception family."""


class DataGenError(Exception):
    """Base of every error that `data_gen` raises: where, what was expected, what came."""
