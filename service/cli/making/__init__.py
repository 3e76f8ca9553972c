"""Commands that make something: scenes, tracks and event logs."""
