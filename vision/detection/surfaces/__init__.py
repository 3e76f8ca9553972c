"""On which plane are vehicles looked for? On the ground, or in the image of a camera low above it."""
