"""How is a request for a run kept until somebody processes it? As JSON, without the log that it is in."""

import json
from dataclasses import fields, replace
from hashlib import blake2b
from pathlib import Path
from typing import Any  # what JSON has

import msgspec

from service.runs.processing import RunRequest


def as_text(request: RunRequest) -> str:
    """Write a request; its files are named by their whole paths, since who processes it may be elsewhere.

    Examples
    --------
    >>> import math
    >>> request = RunRequest(Path("/clips/a.mp4"), None, "a.db", rate_hz=math.inf)
    >>> read_request(as_text(request), "b.db") == replace(request, log_url="b.db")
    True
    """
    plain = msgspec.to_builtins(replace(request, log_url=""), enc_hook=_absolute)
    return json.dumps(plain)  # which knows infinity


def read_request(text: str, log_url: str) -> RunRequest:
    """Read a request for the log that it was in."""
    return replace(msgspec.convert(json.loads(text), RunRequest, dec_hook=_made), log_url=log_url)


def job_id(request: RunRequest) -> str:
    """Name a request: the same for the same input, as it lies there now, asked for in the same way.

    Raises
    ------
    OSError
        If a file of it is missing.
    """
    texts = [as_text(request)]
    for name in (one.name for one in fields(request)):
        value = getattr(request, name)
        for path in value if isinstance(value, tuple) else (value,):
            if isinstance(path, Path):
                state = path.stat()
                texts.append(f"{name} {path} {state.st_size} {state.st_mtime_ns}")
    return blake2b("\n".join(texts).encode(), digest_size=8).hexdigest()


def _absolute(path: Any) -> str:  # Any: what msgspec does not know; paths are all there is
    return str(path.absolute())


def _made(kind: type[Any], value: Any) -> Any:  # Any: as above
    return kind(value)
