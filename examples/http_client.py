"""A client of `dyknow serve`: upload a video, have it processed, ask for its events and why, and try a chronicle.

Needs `httpx` and nothing of DyKnow. With a server that takes uploads,

    dyknow serve demo.db --uploads videos
    python examples/http_client.py http://127.0.0.1:8420 crossing.mp4

uploads the video, waits until it is processed, and prints its events and why there was the first one. A server that
asks who is there gets the token in the variable DYKNOW_TOKEN.
"""

import base64
import hashlib
import json
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Self  # Any: JSON

import httpx

Json = dict[str, Any]
LOOKED_EVERY_S = 0.5
ANSWERED_WITHIN_S = 60.0


class ProblemError(Exception):
    """What a server refused, in its words; `problem` is its answer by RFC 9457."""

    def __init__(self, problem: Json) -> None:
        super().__init__(f"{problem['status']} {problem['title']}: {problem['detail']}")
        self.problem = problem


class JobError(Exception):
    """A job that did not finish; the message is what it said."""


class DyKnow:
    """Asks one server; use it in a `with` statement."""

    def __init__(self, url: str, token: str | None = None) -> None:
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        self._http = httpx.Client(base_url=f"{url}/api/v1/", headers=headers, timeout=ANSWERED_WITHIN_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._http.close()

    def ask(self, method: str, path: str, **how: Any) -> Json:  # Any: what httpx takes
        """Send a request, and read the JSON of its answer; raises a `ProblemError` if it is refused."""
        return _answered(self._http.request(method, path, **how)).json()  # type: ignore[no-any-return]  # JSON

    def upload(self, video: Path, name: str | None = None) -> str:
        """Upload a video, and return the name of the source that it is."""
        with video.open("rb") as file:
            digest = base64.b64encode(hashlib.file_digest(file, "sha256").digest()).decode()
            file.seek(0)
            headers = {"Content-Digest": f"sha-256=:{digest}:", "Content-Length": str(video.stat().st_size)}
            path = f"sources/{name or video.name}/video"
            return str(self.ask("PUT", path, content=iter(lambda: file.read(1 << 20), b""), headers=headers)["name"])

    def run(self, source: str, **options: Any) -> str:  # Any: the members of a request for a run
        """Have a source processed, and return its job; the same request is the same job."""
        return str(self.ask("POST", "runs", json={"source": source, **options})["id"])

    def wait(self, job: str) -> str:
        """Wait until a job has ended, and return its run; raises a `JobError` if it became none."""
        while True:
            told = self.ask("GET", f"jobs/{job}")
            if told["state"] == "finished":
                return str(told["run"])
            if told["state"] in ("failed", "cancelled"):
                raise JobError(f"job {job} {told['state']}: {told['message']}")
            time.sleep(LOOKED_EVERY_S)

    def events(self, **asked: Any) -> Iterator[Json]:  # Any: parameters of the path
        """Give all events that are asked for, page by page."""
        page = self.ask("GET", "events", params=asked)
        yield from page["items"]
        while page["next_cursor"]:
            page = self.ask("GET", "events", params=asked | {"cursor": page["next_cursor"]})
            yield from page["items"]

    def stream(self, last_event_id: int | None = None, **asked: Any) -> Iterator[Json]:  # Any: as above
        """Give events as they are written, for ever; behind a sequence number, or those to come."""
        known = {} if last_event_id is None else {"Last-Event-ID": str(last_event_id)}
        with self._http.stream("GET", "events/stream", params=asked, headers=known) as answer:
            if answer.is_error:
                answer.read()
            for line in _answered(answer).iter_lines():
                if line.startswith("data: "):
                    yield json.loads(line.removeprefix("data: "))

    def why(self, event: str) -> Json:
        """Explain an event."""
        return self.ask("GET", f"events/{event}/why")

    def why_not(self, chronicle: str, **asked: Any) -> Json:  # Any: as above
        """Explain why a chronicle was not recognised; roles as `{"role.overtaker": "car7"}`."""
        return self.ask("GET", f"chronicles/{chronicle}/why-not", params=asked)

    def try_text(self, text: str, **window: Any) -> Json:  # Any: members of a request for a trial
        """Say what a chronicle text would recognise, and how near it came to more."""
        return self.ask("POST", "chronicles/try", json={"text": text, **window})


def _answered(answer: httpx.Response) -> httpx.Response:
    if answer.is_error:
        raise ProblemError(answer.json())
    return answer


def main(url: str, video: str) -> None:
    """Upload a video, and print what happened in it."""
    with DyKnow(url, os.environ.get("DYKNOW_TOKEN")) as server:
        run = server.wait(server.run(server.upload(Path(video))))
        found = list(server.events(run=run))
        for one in found:
            print(one["start"], one["type"], one["roles"])
        if found:
            print(json.dumps(server.why(found[0]["id"]), indent=2))


if __name__ == "__main__":
    main(*sys.argv[1:])
