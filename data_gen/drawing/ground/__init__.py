"""What does the scene look like when nobody is on it? Painted once."""
