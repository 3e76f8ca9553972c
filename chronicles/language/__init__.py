"""The chronicle language: from text to a tree, and back."""
