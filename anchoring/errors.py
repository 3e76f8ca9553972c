"""What can go wrong in `anchoring`, as one exception family."""


class AnchoringError(Exception):
    """Base of every error that `anchoring` raises: where, what was expected, what came."""
