"""What can be processed? Sites, videos, detections and trajectories, checked before anything runs."""
