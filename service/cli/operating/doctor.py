"""`dyknow doctor`: can DyKnow do its work on this machine, and if not, what is to be done?

Each check lets a part do in small what it does at work. None changes anything: a log is looked at below `open_log`,
which would carry an older one over, and as a file that cannot be written, since SQLite tidies up what it may write.
"""

import os
import platform
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from service.cli.options import AsJson
from service.cli.printing import BROKEN, format_table, show
from service.errors import ServiceError
from service.runs.machine import cores
from service.store.databases.location import database_of

if TYPE_CHECKING:
    from service.store.databases.database import Database

LEAST_MEMORY_BYTES, LEAST_FREE_BYTES = 2**31, 2**30  # a run takes up to 0.7 GB (docs/scaling.md), beside a server
# What the system calls file systems whose locks may be those of one machine, which SQLite relies on.
_NETWORK: Final = ("nfs", "cifs", "smb", "9p", "afs", "ceph", "gluster", "lustre", "gpfs", "ocfs2", "gfs2", "fuse.")
TITLES = ("check", "state", "found", "advice")

Said = tuple[str, str]
"""What was found, and what to think of it; nothing if all is well. What is broken is raised."""


def doctor(
    log: Annotated[str | None, typer.Argument(metavar="[LOG]", help="Event log: PATH.db, or a URL.")] = None,
    as_json: AsJson = False,
) -> None:
    """Look whether this machine, and a log, have what DyKnow needs, and change nothing; exit with 1 if it is broken."""
    from service.runs.inputs.detectors import named_detectors
    from service.store.databases.sqlite_file import SqliteFile

    # How to look, and what to do about what is broken.
    checks: dict[str, tuple[Callable[[], Said], str]] = {
        "packages": (_packages, "pip install --upgrade dyknow, in an environment of its own"),
        "machine": (_machine, ""),
        "clock": (_clock, "set the clock, and let it be set: timedatectl set-ntp true"),
        "video": (_video, "pip install --force-reinstall av"),
        "sumo": (_sumo, ""),
    }
    for name, weights in named_detectors().items():
        checks[f"detector {name}"] = partial(_detector, weights), "dyknow detector add FILE --force"
    if log is not None:
        database = database_of(log)
        checks["log"] = partial(_log, database), "name a log that DyKnow made, or a folder that can be written"
        if isinstance(database, SqliteFile):
            checks["disk"] = partial(_disk, database.path), "use a disk of this machine, or PostgreSQL"
    rows = [(name, *_looked(look, fix)) for name, (look, fix) in checks.items()]
    show({"items": [dict(zip(TITLES, row, strict=True)) for row in rows]}, format_table(TITLES, rows), as_json=as_json)
    if any(state == "broken" for _, state, *_ in rows):
        raise typer.Exit(BROKEN)


def _looked(look: Callable[[], Said], fix: str) -> tuple[str, str, str]:
    """Give state, what was found, and advice."""
    try:
        found, advice = look()
    except Exception as error:  # whatever a part raises is what is wrong with it
        kind = "" if isinstance(error, ServiceError) else f"{type(error).__name__}: "
        return "broken", f"{kind}{error}", fix
    return "note" if advice else "ok", found, advice


def _packages() -> Said:
    from importlib.metadata import requires, version

    from packaging.requirements import Requirement

    needed = [one for one in map(Requirement, requires("dyknow") or ()) if not one.marker or one.marker.evaluate()]
    for one in needed:
        if not one.specifier.contains(came := version(one.name), prereleases=True):
            raise ServiceError(f"expected {one}, got {came}")
    return f"Python {platform.python_version()}, dyknow {version('dyknow')}, all {len(needed)} that it needs", ""


def _machine() -> Said:
    import psutil

    size_bytes = psutil.virtual_memory().total
    advice = "" if size_bytes >= LEAST_MEMORY_BYTES else "2 GB are better: a run takes up to 0.7, beside a server"
    return f"{platform.platform(terse=True)}, {cores()} of {os.cpu_count()} cores, {size_bytes / 1e9:.1f} GB", advice


def _clock() -> Said:
    now, installed = datetime.now(UTC), datetime.fromtimestamp(Path(__file__).stat().st_mtime, UTC)
    if now < installed:
        raise ServiceError(f"expected a time after {installed:%Y-%m-%d}, when DyKnow was installed, got {now:%Y-%m-%d}")
    return f"{now:%Y-%m-%dT%H:%M:%SZ}", ""


def _video() -> Said:
    """Write two pictures as every video of ours is written, and read them."""
    from tempfile import TemporaryDirectory

    import av
    import numpy as np

    from data_gen.drawing.video import VideoWriter

    with TemporaryDirectory(prefix="dyknow-") as folder:
        path = Path(folder) / "two.mp4"
        with VideoWriter(path, (64, 48), 25) as writer:
            writer.write(np.full((72, 64), 40, np.uint8))
            writer.write(np.full((72, 64), 200, np.uint8))
        with av.open(str(path)) as container:
            _, _ = container.decode(video=0)  # neither more nor less
    return f"H.264 is written and read by PyAV {av.__version__}; no ffmpeg program is needed", ""


def _sumo() -> Said:
    import data_gen.simulation  # noqa: F401  # keeps SUMO from printing

    try:
        import libsumo
    except ImportError as error:
        # Its wheel expects what every desktop has.
        return str(error), "no scene can be generated, all else works; Debian: apt install libx11-6 libgl1 libatomic1"
    return f"{libsumo.getVersion()[1]}, for generated scenes", ""


def _detector(weights: Path) -> Said:
    from service.cli.making.detector import TRIAL_SIZE_PX
    from service.runs.inputs.detectors import read_recipe

    return f"{weights}, {read_recipe(weights).open(TRIAL_SIZE_PX).runtime}", ""


def _log(database: "Database") -> Said:
    from service.store.databases.sqlite_file import SqliteFile
    from service.store.schema import SCHEMA_VERSION
    from service.store.versions import read_version

    read = SqliteFile(database.path, is_left_alone=True) if isinstance(database, SqliteFile) else database
    version = read_version(read) if database.exists() else None
    if version is None:
        database.check_writable()
        return f"{database.name} is empty or not there yet, and can be made", ""
    advice = "" if database.can_write() else "it can only be read, so no run is written and no worker begun"
    if version != SCHEMA_VERSION:
        advice = f"take a backup before it is opened, and carried over to schema {SCHEMA_VERSION}: dyknow log backup"
    return f"{database.name}, schema {version}", advice


def _disk(log: Path) -> Said:
    import psutil

    folder = log.resolve().parent
    kinds = {Path(one.mountpoint): one.fstype for one in psutil.disk_partitions(all=True)}
    free_bytes = psutil.disk_usage(str(folder)).free
    mount = next(one for one in (folder, *folder.parents) if one in kinds)
    found = f"{free_bytes / 1e9:.1f} GB free, {kinds[mount]} at {mount}"
    if kinds[mount].startswith(_NETWORK):
        raise ServiceError(f"expected a file system of this machine, got {found}")
    advice = "make room: an hour of a camera adds up to 23 MB, recordings more"
    return found, "" if free_bytes >= LEAST_FREE_BYTES else advice
