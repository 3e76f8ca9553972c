"""What is to be processed, and how is that kept until somebody does? As JSON, in a log."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from hashlib import blake2b
from pathlib import Path

import msgspec

from service.records.runs import SourceText

HOUR_US = 3_600_000_000
GIGABYTE = 1_000_000_000


@dataclass(frozen=True, slots=True)
class RunRequest:
    """Say what to process.

    Attributes
    ----------
    input : a video file, or a trajectory file (``.csv``).
    site : the site file; None for trajectories without roads.
    log_url : where the event log is, or is to be created; of what is kept, empty for the log that it is in.
    chronicle_files, chronicle_texts : texts of chronicles, in files or here; none means the whole shipped library.
    columns : our trajectory column names to the file's.
    monitor_files : texts of monitors to run besides.
    kpl_file : declares the streams instead of the shipped text.
    linkage_file : classes and links of anchoring instead of the shipped text.
    detector : in the words of `service.runs.inputs.detectors`; None for that of the site file.
    rate_hz : frames of a video to look at in a second, infinite for all; None for what the site file says.
    start_utc_us : UTC time of media time zero, before what site file and video say.
    final : events are told when nothing can take them back any more.
    min_confidence : how sure events must be, instead of what chronicles ask for; what is less sure is kept as doubtful.
    again : also a run that the log has, finished.
    workers : processes beside this one to look at a video: 0, 1, or None for 1 where it is worth its start.
    is_live : its chronicles, and those that the log holds, may change while it goes on; it stays the same run. It is
        taken so where the input is a recording.
    """

    input: Path
    site: Path | None
    log_url: str
    chronicle_files: tuple[Path, ...] = ()
    columns: Mapping[str, str] | None = None
    monitor_files: tuple[Path, ...] = ()
    kpl_file: Path | None = None
    linkage_file: Path | None = None
    detector: str | None = None
    rate_hz: float | None = None
    start_utc_us: int | None = None
    final: bool = False
    min_confidence: float | None = None
    again: bool = False
    workers: int | None = 0
    chronicle_texts: tuple[SourceText, ...] = ()
    is_live: bool = False


@dataclass(frozen=True, slots=True)
class LiveRequest:
    """Say what to watch.

    Attributes
    ----------
    input : names the live source, see `service.runs.live.live_source`.
    run : how to process; each recording in turn is its input.
    recordings : folder for what arrives.
    longest_us : so long are a recording, and the run over it, at most.
    age_us, size_bytes : older recordings, and what is more than this in all, are removed once they are processed.
    is_rows : it sends rows of trajectories, not video.
    """

    input: str
    run: RunRequest
    recordings: Path
    longest_us: int = 6 * HOUR_US
    age_us: int = 24 * HOUR_US
    size_bytes: int = 50 * GIGABYTE
    is_rows: bool = False


def as_text(request: RunRequest | LiveRequest) -> str:
    """Write a request; its files are named by their whole paths, since who processes it may be elsewhere.

    Examples
    --------
    >>> import math
    >>> from dataclasses import replace
    >>> request = RunRequest(Path("/clips/a.mp4"), None, "", rate_hz=math.inf)
    >>> read_request(as_text(request), "b.db") == replace(request, log_url="b.db")
    True
    """
    # JSON's own module, since it knows infinity.
    return json.dumps(msgspec.to_builtins(request, enc_hook=lambda path: str(path.absolute())))


def read_request(text: str, log_url: str) -> RunRequest | LiveRequest:
    """Read a request for the log that it was in."""
    plain = json.loads(text)
    how = plain.get("run", plain)
    how["log_url"] = how["log_url"] or log_url
    kind: type[RunRequest | LiveRequest] = LiveRequest if "run" in plain else RunRequest
    return msgspec.convert(plain, kind, dec_hook=lambda kind, value: kind(value))


def job_id(request: RunRequest | LiveRequest) -> str:
    """Name a request: the same for the same input, as it lies there now, asked for in the same way.

    Raises
    ------
    OSError
        If a file of it is missing.
    """
    texts = [as_text(request)]
    for name, path in _files(request):
        state = path.stat()
        texts.append(f"{name} {path} {state.st_size} {state.st_mtime_ns}")
    return blake2b("\n".join(texts).encode(), digest_size=8).hexdigest()


def _files(request: RunRequest | LiveRequest) -> Iterator[tuple[str, Path]]:
    """List the files that a request names; what a live source will be recorded into is none yet."""
    run = request.run if isinstance(request, LiveRequest) else request
    for name in (one.name for one in fields(run)):
        value = getattr(run, name)
        for path in value if isinstance(value, tuple) else (value,):
            if isinstance(path, Path) and not (name == "input" and run is not request):
                yield name, path
