"""How do other programs get events and tracks? As files."""
