"""What does the camera see? Ground, traffic and light as pictures of a video."""
