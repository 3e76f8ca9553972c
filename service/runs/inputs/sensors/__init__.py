"""What looks at a video? Vision with its camera, its ground and its detector, here or in a process of its own."""
