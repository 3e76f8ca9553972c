"""Is what is measured a whole run? One that a signal stops half way tells fewer events, and nothing else shows it."""

from collections.abc import Callable

from service.runs.processing import Progress, RunRequest, RunSummary, process


def process_whole(request: RunRequest, on_progress: Callable[[Progress], None] = lambda _: None) -> RunSummary:
    """Process an input to its end, as `service.runs.processing.process` does.

    Raises
    ------
    SystemExit
        If the run was interrupted, or its input broke: then there is nothing to go on with.
    """
    summary = process(request, on_progress=on_progress)
    if summary.status != "finished":
        raise SystemExit(f"run {summary.run}: expected a whole run, got one that is {summary.status}; {summary.reason}")
    return summary
