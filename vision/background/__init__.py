"""What does the road look like without vehicles? Learned from the frames seen so far."""
