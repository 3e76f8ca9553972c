"""Qualitative spatial relations between cars and places, as change events."""
