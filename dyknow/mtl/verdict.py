"""What is known about a formula so far? One of three values."""

from enum import Enum


class Verdict(Enum):
    """Answer so far: TRUE and FALSE are final, whatever states may come."""

    TRUE = "true"
    FALSE = "false"
    UNKNOWN = "unknown"
