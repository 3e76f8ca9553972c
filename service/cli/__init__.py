"""How is DyKnow used from a terminal? One module a command, put together in `service.cli.app`."""
