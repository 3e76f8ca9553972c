"""Synthetic traffic: simulated, drawn as video, with exact truth."""
