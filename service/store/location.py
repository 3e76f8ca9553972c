"""Where does an event log lie?

A log is named by `sqlite:///path` or by a plain path that ends in `.db`. Other schemes are refused here, in words,
before anything is touched.
"""

import os
import re
from pathlib import Path

from service.errors import LogError

_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://")
_SQLITE = "sqlite:///"


def parse_log_url(url: str) -> Path:
    """Turn the name of a log into the path of its SQLite file.

    Raises
    ------
    LogError
        If the scheme is unknown, or the name has no scheme and does not end in `.db`.

    Examples
    --------
    >>> parse_log_url("sqlite:///out/demo.db").as_posix()
    'out/demo.db'
    >>> parse_log_url("sqlite:////data/demo.db").as_posix()
    '/data/demo.db'
    >>> parse_log_url("ftp://a")
    Traceback (most recent call last):
        ...
    service.errors.LogError: log 'ftp://a': expected sqlite:///PATH or a path ending in .db, got scheme 'ftp'
    """
    wanted = "expected sqlite:///PATH or a path ending in .db"
    scheme = _SCHEME.match(url)
    if scheme and not url.startswith(_SQLITE):
        raise LogError(f"log {url!r}: {wanted}, got scheme {scheme[1]!r}")
    path = url.removeprefix(_SQLITE)
    if not path or path == ":memory:" or (not scheme and not path.endswith(".db")):
        raise LogError(f"log {url!r}: {wanted}, got {path!r}")
    return Path(path)


def is_log_name(name: str) -> bool:
    """Tell whether a name is meant as that of a log, rather than of another file.

    Examples
    --------
    >>> is_log_name("sqlite:///a"), is_log_name("a.db"), is_log_name("a.csv")
    (True, True, False)
    """
    return _SCHEME.match(name) is not None or name.endswith(".db")


def check_writable(path: Path) -> None:
    """Refuse a place where a log cannot be written, without touching it.

    Raises
    ------
    LogError
        If the folder is missing, or the folder or file may not be written.
    """
    folder = path.parent
    if not folder.is_dir():
        came = "a file" if folder.exists() else "no such folder"
        raise LogError(f"log {str(path)!r}: expected an existing folder {str(folder)!r}, got {came}")
    target = path if path.exists() else folder
    if path.is_dir():
        raise LogError(f"log {str(path)!r}: expected a file, got a folder")
    if not (os.access(target, os.W_OK) and os.access(folder, os.W_OK)):
        raise LogError(
            f"log {str(path)!r}: expected a writable folder and file, got {str(target)!r} without permission"
        )
