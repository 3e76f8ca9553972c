"""How is an event log kept? In an SQL database."""
