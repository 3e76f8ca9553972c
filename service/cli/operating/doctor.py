"""`dyknow doctor`: can DyKnow do its work on this machine, and if not, what is to be done?

Each check lets a part do in small what it does at work. None changes anything: a log is looked at below `open_log`,
which would carry an older one over, and as a file that cannot be written, since SQLite tidies up what it may write.
"""

import os
import platform
import re
import shutil
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from service.cli.options import AsJson
from service.cli.printing import BROKEN, format_table, print_json
from service.errors import ServiceError

if TYPE_CHECKING:
    from service.store.databases.database import Database

LEAST_MEMORY_BYTES, LEAST_FREE_BYTES = 2**31, 2**30  # a run takes up to 0.7 GB (docs/scaling.md), beside a server
_GB = 1e9
_MOUNTS = Path("/proc/self/mountinfo")
# What Linux calls file systems whose locks may be those of one machine, which SQLite relies on.
_NETWORK: Final = ("nfs", "cifs", "smb", "9p", "afs", "ceph", "gluster", "lustre", "gpfs", "ocfs2", "gfs2", "fuse.")

Said = tuple[str, str]
"""What was found, and what to think of it; nothing if all is well. What is broken is raised."""
Check = tuple[Callable[[], Said], str]
"""How to look, and what to do about what is broken."""


def doctor(
    log: Annotated[str | None, typer.Argument(metavar="[LOG]", help="Event log: PATH.db, or a URL.")] = None,
    as_json: AsJson = False,
) -> None:
    """Look whether this machine, and a log, have what DyKnow needs, and change nothing; exit with 1 if it is broken."""
    from service.runs.inputs.detectors import named_detectors

    checks: dict[str, Check] = {
        "python": (_python, ""),
        "packages": (_packages, "pip install --upgrade dyknow, in an environment of its own"),
        "processor": (_processor, ""),
        "memory": (_memory, ""),
        "clock": (_clock, "set the clock, and let it be set: timedatectl set-ntp true"),
        "video": (_video, "pip install --force-reinstall av"),
        "sumo": (_sumo, ""),
    }
    for name, weights in named_detectors().items():
        checks[f"detector {name}"] = partial(_detector, weights), "dyknow detector add FILE --force"
    checks |= _checks_of_log(log)
    found = [{"check": name, **_looked(look, fix)} for name, (look, fix) in checks.items()]
    if as_json:
        print_json({"items": found})
    else:
        titles = ("check", "state", "found", "advice")
        print(format_table(titles, [[one[title] for title in titles] for one in found]), end="")
    if any(one["state"] == "broken" for one in found):
        raise typer.Exit(BROKEN)


def _looked(look: Callable[[], Said], fix: str) -> dict[str, str]:
    try:
        found, advice = look()
    except ServiceError as error:
        return {"state": "broken", "found": str(error), "advice": fix}
    except Exception as error:  # whatever a part raises is what is wrong with it
        return {"state": "broken", "found": f"{type(error).__name__}: {error}", "advice": fix}
    return {"state": "note" if advice else "ok", "found": found, "advice": advice}


def _python() -> Said:
    return f"{platform.python_version()} on {platform.platform(terse=True)}, {sys.executable}", ""


def _packages() -> Said:
    from importlib.metadata import PackageNotFoundError, requires, version

    from packaging.requirements import Requirement

    needed = [Requirement(text) for text in requires("dyknow") or ()]
    needed = [one for one in needed if one.marker is None or one.marker.evaluate({"extra": ""})]
    for one in needed:
        try:
            came = version(one.name)
        except PackageNotFoundError:
            came = "none"
        if came == "none" or not one.specifier.contains(came, prereleases=True):
            raise ServiceError(f"expected {one}, got {came}")
    return f"dyknow {version('dyknow')}, and the {len(needed)} packages that it needs", ""


def _processor() -> Said:
    from service.machine import cores

    return f"{cores()} of {os.cpu_count()} cores, {platform.machine()}", ""


def _memory() -> Said:
    size_bytes = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    limit = Path("/sys/fs/cgroup/memory.max")  # of a container
    if limit.exists() and (text := limit.read_text().strip()).isdigit():
        size_bytes = min(size_bytes, int(text))
    advice = "" if size_bytes >= LEAST_MEMORY_BYTES else "2 GB are better: a run takes up to 0.7, beside a server"
    return f"{size_bytes / _GB:.1f} GB", advice


def _clock() -> Said:
    now, installed = datetime.now(UTC), datetime.fromtimestamp(Path(__file__).stat().st_mtime, UTC)
    if now < installed:
        raise ServiceError(f"expected a time after {installed:%Y-%m-%d}, when DyKnow was installed, got {now:%Y-%m-%d}")
    return f"{now:%Y-%m-%dT%H:%M:%SZ}, {time.tzname[0]} here", ""


def _video() -> Said:
    """Write two pictures as every video of ours is written, and read them."""
    from tempfile import TemporaryDirectory

    import av
    import numpy as np

    from data_gen.drawing.video import VideoWriter

    with TemporaryDirectory(prefix="dyknow-") as folder:
        path = Path(folder) / "two.mp4"
        with VideoWriter(path, (64, 48), 25) as writer:
            for grey in (40, 200):
                writer.write(np.full((72, 64), grey, np.uint8))
        with av.open(str(path)) as container:
            count = sum(1 for _ in container.decode(video=0))
    if count != 2:
        raise ServiceError(f"expected to read 2 pictures of H.264, got {count}")
    return f"H.264 is written and read by PyAV {av.__version__}; no ffmpeg program is needed", ""


def _sumo() -> Said:
    try:
        import libsumo
    except ImportError as error:
        # Its wheel expects what every desktop has.
        missing = "libx11-6 libxext6 libxrender1 libgl1 libatomic1 libexpat1"
        return str(error), f"no scene can be generated, all else works; Debian: apt install {missing}"
    return f"{libsumo.getVersion()[1]}, for generated scenes", ""


def _detector(weights: Path) -> Said:
    from service.cli.making.detector import TRIAL_SIZE_PX
    from service.runs.inputs.detectors import read_recipe

    return f"{weights}, {read_recipe(weights).open(TRIAL_SIZE_PX).runtime}", ""


def _checks_of_log(log: str | None) -> dict[str, Check]:
    from service.store.databases.location import database_of
    from service.store.databases.sqlite_file import SqliteFile

    if log is None:
        return {"disk": (partial(_disk, Path.cwd()), "")}
    database = database_of(log)
    checks: dict[str, Check] = {
        "log": (partial(_log, database), "name a log that DyKnow made, or a folder that can be written")
    }
    if isinstance(database, SqliteFile):
        folder = database.path.absolute().parent
        checks["disk"] = partial(_disk, folder), "make the folder"
        checks["file system"] = partial(_file_system, folder), "put the log on a disk of this machine, or on PostgreSQL"
    return checks


def _disk(folder: Path) -> Said:
    free_bytes = shutil.disk_usage(folder).free
    advice = (
        "" if free_bytes >= LEAST_FREE_BYTES else "make room: an hour of a camera adds up to 23 MB, recordings more"
    )
    return f"{free_bytes / _GB:.1f} GB free at {folder}", advice


def _file_system(folder: Path) -> Said:
    if not _MOUNTS.exists():
        return "unknown, as only Linux tells", "see to it that it is no network file system"
    here, kinds = folder.resolve(), {}
    for line in _MOUNTS.read_text().splitlines():
        of_mount, _, of_kind = line.partition(" - ")
        # The kernel writes blanks and the like in octal.
        place = re.sub(r"\\(\d{3})", lambda found: chr(int(found[1], 8)), of_mount.split()[4])
        kinds[Path(place)] = of_kind.split()[0]
    nearest = next(one for one in (here, *here.parents) if one in kinds)
    if kinds[nearest].startswith(_NETWORK):
        raise ServiceError(f"expected a file system of this machine, got {kinds[nearest]} at {nearest}")
    return f"{kinds[nearest]} at {nearest}", ""


def _log(database: "Database") -> Said:
    from service.store.databases.location import shown
    from service.store.databases.sqlite_file import SqliteFile
    from service.store.schema import SCHEMA_VERSION
    from service.store.versions import read_version

    if not database.exists():
        database.check_writable()
        return f"{database.name} is not there yet, and can be made", ""
    database.check_readable()
    version = read_version(
        SqliteFile(database.path, is_left_alone=True) if isinstance(database, SqliteFile) else database
    )
    found = f"{shown(database.name)}, schema {version or 'not made yet'}"
    if version not in (None, SCHEMA_VERSION):
        advice = (
            f"it is carried over to schema {SCHEMA_VERSION} when it is opened: take a backup before (dyknow log backup)"
        )
        return found, advice
    return found, "" if database.can_write() else "it can only be read, so no run is written and no worker begun"
