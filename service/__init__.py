"""How are the parts wired, stored and asked? Pipeline, event log, HTTP, command line."""
