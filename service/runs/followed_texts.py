"""Which chronicles does a live run look for now? Those of its files and those that its log holds, as they change."""

import logging
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from operator import attrgetter
from pathlib import Path

from chronicles.errors import ChronicleError
from dyknow.errors import DyKnowError
from service.errors import ServiceError
from service.store.databases.location import database_of
from service.store.entries import ChronicleText
from service.store.log import EventLog, open_log
from service.store.registers.chronicle_texts import ChronicleTexts
from service.store.versions import read_version
from service.texts.chronicle_files import LoadedChronicles
from service.texts.monitor_files import LoadedMonitors

LOOKED_EVERY_S = 1.0
WRONG = (ServiceError, ChronicleError, DyKnowError)
"""What texts raise that are wrong."""

Text = tuple[str, str]
"""Its name, and what it says."""

_LOGGER = logging.getLogger(__name__)


class FollowedTexts:
    """Look every second whether the chronicles of a run were changed.

    Parameters
    ----------
    log, files : where they stand.
    load : reads and checks all of them.
    """

    def __init__(self, log: EventLog, files: tuple[Path, ...], load: Callable[[], LoadedChronicles]) -> None:
        self._files, self._load = files, load
        self._stored = ChronicleTexts(log)
        self._seen: list[tuple[str, int, int]] | None = None  # what changed since the run read them is not missed
        self._due_s = time.monotonic() + LOOKED_EVERY_S

    def changed(self) -> LoadedChronicles | None:
        """Read them, at first and if they were changed since; else None. What is wrong is told, and changes nothing."""
        if time.monotonic() < self._due_s:
            return None
        self._due_s = time.monotonic() + LOOKED_EVERY_S
        try:
            state = self._state()
            if state != self._seen:
                self._seen = state
                return self._load()
        except WRONG as error:
            tell_unchanged(error)
        return None

    def _state(self) -> list[tuple[str, int, int]]:
        """Tell texts from others, without reading them."""
        state = [(one.name, one.version, 0) for one in self._stored.current()]
        for file in self._files:
            with suppress(OSError):  # missing while an editor writes it, or for good, which is told when it is read
                found = file.stat()
                state.append((str(file), found.st_mtime_ns, found.st_size))
        return state


def tell_unchanged(why: Exception) -> None:
    """Tell that chronicles that were changed are not taken."""
    _LOGGER.warning("the chronicles stay as they are: %s", why)


def load_with_stored(
    load: Callable[[Sequence[Text]], tuple[LoadedChronicles, LoadedMonitors]], log_url: str
) -> tuple[LoadedChronicles, LoadedMonitors]:
    """Load chronicles with the texts of a log, without those that do not go with what was there before them.

    What somebody stores, each right by itself, must not end what is watched.

    Parameters
    ----------
    load : reads and checks chronicles, with some texts besides.

    Raises
    ------
    LogError
        If the log is there and cannot be read; besides, what `load` raises without any text.
    """
    texts = [(one.name, one.text or "") for one in sorted(stored_texts(log_url), key=attrgetter("made_us"))]
    with suppress(*WRONG):
        return load(texts)
    chronicles, monitors = load(())
    fitting, left_out = list[Text](), list[str]()
    for text in texts:
        try:
            chronicles, monitors = load([*fitting, text])
        except WRONG as error:
            why = str(error).splitlines()[0]
            left_out.append(f"chronicle text {text[0]!r} of the log: expected one that goes with the others, got {why}")
        else:
            fitting.append(text)
    return replace(chronicles, doubts=(*chronicles.doubts, *left_out)), monitors


def stored_texts(log_url: str) -> list[ChronicleText]:
    """List the chronicle texts of a log; none where there is no log yet.

    Raises
    ------
    LogError
        If it is there and cannot be read.
    """
    database = database_of(log_url)
    if not database.exists() or read_version(database) is None:
        return []
    with open_log(log_url) as log:
        return ChronicleTexts(log).current()
