"""What is told of an instance? Occurrences, how sure they are, and in which order they come."""
