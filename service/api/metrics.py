"""What is counted of a server, and told to Prometheus?"""

from collections.abc import Callable, Mapping

from prometheus_client import CollectorRegistry, Gauge, Histogram, ProcessCollector, generate_latest

# A page of events takes some milliseconds, an explanation ten seconds at most.
BUCKETS_S = (0.01, 0.05, 0.2, 1.0, 5.0, 20.0)
METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})


class Metrics:
    """The counts of one server.

    Parameters
    ----------
    streams : tells how many streams of events are open.
    waiting : tells how many questions wait for a process.
    """

    def __init__(self, streams: Callable[[], int], waiting: Callable[[], int]) -> None:
        registry = self._registry = CollectorRegistry()
        ProcessCollector(registry=registry)
        labels, about = ("route", "method", "status"), "Seconds until an answer begins."
        self._seconds = Histogram("dyknow_http_request_seconds", about, labels, registry=registry, buckets=BUCKETS_S)
        Gauge("dyknow_streams_open", "Streams of events that are open.", registry=registry).set_function(streams)
        Gauge("dyknow_questions_waiting", "Questions that wait for a process.", registry=registry).set_function(waiting)
        self._jobs = Gauge("dyknow_jobs", "Jobs of the log.", ("state",), registry=registry)
        self._last_seq = Gauge("dyknow_last_seq", "Newest sequence number of the log.", registry=registry)

    def count(self, route: str, method: str, status: int, seconds: float) -> None:
        """Count an answer; `route` is the template of its path, so that there are few."""
        self._seconds.labels(route, method if method in METHODS else "other", status).observe(seconds)

    def note_log(self, last_seq: int, jobs: Mapping[str, int]) -> None:
        """Note what the log holds by now."""
        self._last_seq.set(last_seq)
        self._jobs.clear()
        for state, count in jobs.items():
            self._jobs.labels(state).set(count)

    def text(self) -> bytes:
        """Give all, in Prometheus' text form."""
        return generate_latest(self._registry)
