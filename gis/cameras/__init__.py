"""How does the ground map to a picture? Cameras that stand or move, and how their lenses bend what they show."""
