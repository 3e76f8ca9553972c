"""What would a road look like, and what really happened on it? Simulated traffic, drawn as video, with exact truth."""
