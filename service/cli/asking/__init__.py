"""Commands that ask an event log."""
