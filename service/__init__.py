"""The service: pipeline wiring, event log, HTTP, command line."""
