"""What do vehicles look like from the camera? Sprites from straight above, solids from the side."""
