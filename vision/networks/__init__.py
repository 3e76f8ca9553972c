"""What do others say is in the picture? Trained networks and files of boxes."""
