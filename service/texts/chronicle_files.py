"""Which chronicles does a run look for? The user's files, or the shipped library."""

import os
import shutil
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from chronicles import library
from chronicles.chronicle_set import ChronicleSet, load_texts
from service.errors import InputError
from service.monitoring.monitor_messages import NO_MESSAGES, Messages, check_uses
from service.records import ChronicleRecord, RunRecord, SourceText
from service.texts.text_streams import Stream, stream_of


@dataclass(frozen=True, slots=True)
class LoadedChronicles:
    """Hold the chronicles of a run: compiled, one by one as the log lists them, and the texts they come from.

    `stream` is what they were taken to be about.
    """

    merged: ChronicleSet
    records: tuple[ChronicleRecord, ...]
    texts: tuple[SourceText, ...]
    stream: Stream = "traffic"


def load_chronicle_files(
    paths: Sequence[Path], stream: Stream | None = "traffic", messages: Messages = NO_MESSAGES
) -> LoadedChronicles:
    """Read and check chronicle files, all in one name space; no path means the whole library.

    Parameters
    ----------
    stream : what they are about; None leaves it to the texts.
    messages : of the monitors that run with them.

    Raises
    ------
    InputError
        If a file cannot be read, or there is no chronicle in them.
    ChronicleError
        If a text has errors, or looks at a message as no monitor gives it; it carries the diagnostics of all files.
    """
    own = [(str(path), read_text(path)) for path in paths]
    stream = stream or (stream_of(own) if own else "traffic")
    texts = with_relations(own, stream) if own else library.texts()
    merged = load_texts(texts)
    check_uses(texts, messages)
    if not merged.plans:
        raise InputError(f"{', '.join(map(str, paths))}: expected at least one chronicle, got none")
    records = tuple(_record(merged, name, text) for name, text in merged.texts)
    return LoadedChronicles(merged, records, tuple(SourceText(Path(name).name, text) for name, text in texts), stream)


def chronicles_of(run: RunRecord) -> ChronicleSet:
    """Compile the chronicles of a run again, from the texts that the log holds."""
    return load_texts([(one.name, one.text) for one in run.texts])


def with_relations(texts: Sequence[tuple[str, str]], stream: Stream = "traffic") -> list[tuple[str, str]]:
    """Put the declarations of our relations before texts (name, text) about traffic, which so need not repeat them."""
    relations = [("relations.chronicle", library.relations_text())] if stream == "traffic" else []
    return [*relations, *texts]


def read_text(path: Path) -> str:
    """Read a UTF-8 text file.

    Raises
    ------
    InputError
        If it is missing, unreadable or not UTF-8.
    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: expected a readable text file, got {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected UTF-8 text, got byte {error.object[error.start]:#04x}") from error


def read_text_or_input(name: str) -> str:
    """Read a UTF-8 text file, or standard input for the name `-`.

    Raises
    ------
    InputError
        If it is missing, unreadable or not UTF-8.
    """
    if name != "-":
        return read_text(Path(name))
    try:
        return sys.stdin.read()
    except UnicodeDecodeError as error:
        raise InputError(f"-: expected UTF-8 text, got byte {error.object[error.start]:#04x}") from error


def replace_text(path: Path, text: str) -> None:
    """Write a text in place of a file in one step, so that nobody ever reads half of it; links stay links.

    Raises
    ------
    InputError
        If the file or its folder may not be written.
    """
    target = path.resolve()
    try:
        with tempfile.NamedTemporaryFile("w", encoding="utf-8", dir=target.parent, delete=False) as file:
            file.write(text)
        shutil.copymode(target, file.name)
        os.replace(file.name, target)
    except OSError as error:
        raise InputError(f"{path}: expected a file that can be written, got {error.strerror or error}") from error


def _record(merged: ChronicleSet, name: str, text: str) -> ChronicleRecord:
    plan = merged.plan(name)
    return ChronicleRecord(name=name, version=plan.version, parameters=tuple(role for role, _ in plan.roles), text=text)
