"""Finding the instances of plans in events."""
