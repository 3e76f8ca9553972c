"""Where is it on the ground, on which road, and how far along? Roads and cameras."""
