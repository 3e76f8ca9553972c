"""Which chronicles does a run look for? The user's files, or the shipped library."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from chronicles import library
from chronicles.chronicle_set import ChronicleSet, load_texts
from service.errors import InputError
from service.records import ChronicleRecord


@dataclass(frozen=True, slots=True)
class LoadedChronicles:
    """Hold the chronicles of a run: compiled, and as the log remembers them."""

    merged: ChronicleSet
    records: tuple[ChronicleRecord, ...]


def load_chronicle_files(paths: Sequence[Path]) -> LoadedChronicles:
    """Read and check chronicle files, all in one name space; no path means the whole library.

    Raises
    ------
    InputError
        If a file cannot be read.
    ChronicleError
        If a text has errors; it carries the diagnostics of all files.
    """
    merged = load_texts(with_relations([(str(path), read_text(path)) for path in paths]) if paths else library.texts())
    return LoadedChronicles(merged, tuple(_record(merged, name, text) for name, text in merged.texts))


def with_relations(texts: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """Put the declarations of our relations before texts (name, text), which so need not repeat them."""
    return [("relations.chronicle", library.relations_text()), *texts]


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
        raise InputError(f"{path}: expected a readable chronicle file, got {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected UTF-8 text, got byte {error.object[error.start]:#04x}") from error


def _record(merged: ChronicleSet, name: str, text: str) -> ChronicleRecord:
    plan = merged.plan(name)
    return ChronicleRecord(name=name, version=plan.version, parameters=tuple(role for role, _ in plan.roles), text=text)
