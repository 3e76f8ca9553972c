"""Has an answer changed since a client had it? Not while the log has the same sequence number.

Whatever changes which events there are takes a number, be they written or removed. The tag names the server too, as one
that is begun anew may be of another version, or at another log.
"""

import uuid

from fastapi import Request
from starlette.responses import Response

from service.questions.queries import find_last_seq
from service.store.log import EventLog

CACHED = "private, no-cache"  # a client may keep it, and asks each time whether it still holds


class Revalidation:
    """Tells answers of one log apart."""

    def __init__(self, log: EventLog) -> None:
        self._log, self._server = log, uuid.uuid4().hex[:12]

    def headers(self, seq: int) -> dict[str, str]:
        """Give the headers of an answer that rests on events alone, as of a sequence number."""
        return {"ETag": f'W/"{self._server}-{seq}"', "Cache-Control": CACHED}

    def unchanged(self, request: Request) -> Response | None:
        """Answer 304 to who has what there is; None to all others."""
        known = request.headers.get("if-none-match")
        if known is None:
            return None
        headers = self.headers(find_last_seq(self._log))
        is_known = headers["ETag"] in [one.strip() for one in known.split(",")]
        return Response(status_code=304, headers=headers) if is_known else None
