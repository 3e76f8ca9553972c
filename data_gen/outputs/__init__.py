"""What is made of a scenario? A scene with its video, truth and site, still pictures, and tracks."""
