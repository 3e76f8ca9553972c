"""Stored events: columns and their joins."""
