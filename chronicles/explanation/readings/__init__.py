"""What was seen where a chronicle asks for an absence, a number of events or a value."""
