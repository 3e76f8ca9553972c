"""Where was a video taken? The site file, how it begins, and how good it is."""
