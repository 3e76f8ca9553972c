"""The event log in an SQL database."""
