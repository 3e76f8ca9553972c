"""What may a client have processed? Videos that it uploads, files in folders, and cameras, that the operator allows.

What is uploaded has no name until it is whole and was found to be a video. FFmpeg opens playlists and session
descriptions as videos too, which lead to other files and hosts; only what holds its own pictures is taken.
"""

import base64
import fcntl
import hashlib
import os
import re
import tempfile
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from anyio import CapacityLimiter, to_thread
from fastapi import HTTPException
from starlette.requests import ClientDisconnect

from service.errors import CrowdedError, QueryError, TakenError
from service.store.entries import Source
from service.store.registers.sources import Sources
from service.texts.csv_table import ROW_SUFFIXES

MOST_UPLOADS = 4
OTHER_SUFFIXES = (*ROW_SUFFIXES, ".toml")
"""Of files that are read as something else than a video, or found beside one."""
_UNNAMED = ".upload-"
_DIGEST = re.compile(r"sha-256=:([A-Za-z0-9+/]{43}=):")


@dataclass(frozen=True, slots=True)
class SourceFolders:
    """Where sources may lie.

    Attributes
    ----------
    uploads : gets what clients upload; None refuses that.
    upload_gb : size of an upload at most.
    allowed : files in these, and in folders of them, may be named by their whole paths.
    cameras : live sources by name, as `kept_name` has them; no other address is ever called for a client.
    recordings : has a folder for what each of them sends.
    """

    uploads: Path | None = None
    upload_gb: float = 20.0
    allowed: tuple[Path, ...] = ()
    cameras: Mapping[str, str] = field(default_factory=dict)
    recordings: Path = Path()

    def hold(self) -> None:
        """Be at the folder of uploads until the process ends; who comes there alone removes what others left half."""
        if self.uploads is not None:
            folder = os.open(self.uploads, os.O_RDONLY)  # never closed: the system drops the lock with the process
            with suppress(BlockingIOError):
                fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
                for left in self.uploads.glob(f"{_UNNAMED}*"):
                    left.unlink()
            fcntl.flock(folder, fcntl.LOCK_SH)

    def path_of(self, source: Source) -> Path:
        """Say where the file of a source is."""
        return ((self.uploads or Path()) / source.file).absolute()

    def permitted(self, text: str, parameter: str = "file") -> Path:
        """Check a path that a client names; links are followed first.

        Raises
        ------
        QueryError
            If it is no file in an allowed folder; whether there is something elsewhere is not told.
        """
        try:
            path = Path(text).resolve()
            is_inside = any(path.is_relative_to(one.resolve()) for one in self.allowed)
            is_permitted = Path(text).is_absolute() and is_inside and path.is_file()
        except (OSError, ValueError, RuntimeError):  # too long, a NUL character, links in a circle
            is_permitted = False
        if not is_permitted:
            expected = f"{parameter}: expected the whole path of a file in a folder that the operator allows"
            raise QueryError(f"{expected}, got {text!r}", parameter=parameter)
        return path


NO_FOLDERS = SourceFolders()


class Uploads:
    """Receives uploads, a few at a time.

    Parameters
    ----------
    folder : gets them.
    sources : of the log.
    unfit : says why a file is no video; empty if it is one.
    """

    def __init__(self, folder: Path, sources: Sources, unfit: Callable[[str], Awaitable[str]]) -> None:
        self._folder, self._sources, self._unfit = folder, sources, unfit
        self._limiter = CapacityLimiter(MOST_UPLOADS)

    async def receive(self, name: str, parts: AsyncIterator[bytes], content_digest: str) -> Source:
        """Receive a video and make it a source; nothing is left of one that is refused, or not sent to its end.

        Raises
        ------
        HTTPException
            If it is cut (400), no video (415), or there is no room for it (507).
        QueryError
            If the name is that of another kind of file, or the digest that of another content.
        TakenError
            If there is a source of that name.
        CrowdedError
            If others are being received, as many as may be.
        """
        if name.lower().endswith(OTHER_SUFFIXES):
            raise QueryError(
                f"name: expected one that does not end in {OTHER_SUFFIXES}, got {name!r}", parameter="name"
            )
        expected = _read_digest(content_digest)
        if not self._limiter.available_tokens:
            raise CrowdedError(f"uploads: expected fewer than {MOST_UPLOADS} at once, got one more; ask again later")
        async with self._limiter:
            self._check_free(name)
            # FFmpeg looks at how a name ends, so that the file has the same end as long as it has no name.
            handle, path = tempfile.mkstemp(prefix=_UNNAMED, suffix=Path(name).suffix, dir=self._folder)
            try:
                digest, size = await _write(handle, parts)
                if expected not in (None, digest):
                    came = base64.b64encode(digest).decode()
                    message = f"Content-Digest: expected that of the body, sha-256=:{came}:, got {content_digest!r}"
                    raise QueryError(message, parameter="Content-Digest")
                if reason := await self._unfit(path):
                    raise HTTPException(415, f"body: expected a video, got {reason.replace(path, name)}")
                source = Source(name, name, digest.hex(), size, time.time_ns() // 1_000)
                await to_thread.run_sync(self._add, source, path)
                return source
            finally:
                Path(path).unlink(missing_ok=True)

    def _check_free(self, name: str) -> None:
        """Refuse the name of a file in the folder, which may be a source of another log."""
        if (self._folder / name).exists():
            raise TakenError(f"source: expected a new name, got {name!r}, which is taken")

    def _add(self, source: Source, path: str) -> None:
        def place() -> None:
            self._check_free(source.name)
            os.replace(path, self._folder / source.file)

        self._sources.add(source, place)


async def _write(handle: int, parts: AsyncIterator[bytes]) -> tuple[bytes, int]:
    """Write what comes to a file, and close it; give its digest and its size."""
    digest, size = hashlib.sha256(), 0
    with open(handle, "wb", buffering=0) as file:

        def keep(part: bytes) -> None:
            file.write(part)
            digest.update(part)

        try:
            async for part in parts:
                await to_thread.run_sync(keep, part)
                size += len(part)
            await to_thread.run_sync(os.fsync, handle)
        except ClientDisconnect as error:
            raise HTTPException(400, f"body: expected it to its end, got {size} bytes") from error
        except OSError as error:
            raise HTTPException(507, f"body: expected room for it, got {error.strerror}") from error
    return digest.digest(), size


def _read_digest(text: str) -> bytes | None:
    """Read the SHA-256 of a header by RFC 9530, which may give others beside it."""
    found = _DIGEST.search(text)
    if found is None and "sha-256=" in text:
        message = f"Content-Digest: expected sha-256=:BASE64:, got {text!r}"
        raise QueryError(message, parameter="Content-Digest")
    return base64.b64decode(found[1]) if found else None
