"""Events and tracks as files that other programs read."""
