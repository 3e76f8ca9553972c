"""What does the exit code of `dyknow` mean? Scripts rely on these numbers; docs/cli.md lists them."""

from typing import Final

OK: Final = 0
INTERNAL: Final = 1  # a fault of ours
USAGE: Final = 2  # the command line itself is wrong
INVALID: Final = 3  # a file, chronicle or log is wrong
NOTHING_FOUND: Final = 4  # only with --fail-empty
BELOW_THRESHOLD: Final = 5  # an evaluation below the wanted score, or an example that fails
BUSY: Final = 6  # another process is writing the same run
SIGNALLED: Final = 128  # and the number of the signal, as shells have it
INTERRUPTED: Final = 130  # by Ctrl-C
