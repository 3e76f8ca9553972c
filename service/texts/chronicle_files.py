"""Which chronicles does a run look for, and is anything wrong in them? The user's files, or the shipped library."""

import os
import shutil
import sys
import tempfile
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from chronicles import library
from chronicles.chronicle_set import ChronicleSet, check_texts, load_texts
from chronicles.errors import ChronicleError
from chronicles.language import model
from chronicles.language.parser import parse
from dyknow.language.diagnostics import Diagnostic, Reporter
from qsr.relations import RANK
from service.errors import InputError
from service.records.runs import ChronicleRecord, SourceText
from service.texts.monitor_messages import NO_MESSAGES, Messages, misuses
from service.texts.text_streams import NEARLY, Stream, library_events, stream_of


@dataclass(frozen=True, slots=True)
class LoadedChronicles:
    """Hold the chronicles of a run: compiled, one by one as the log lists them, and the texts they come from.

    `stream` is what they were taken to be about, `doubts` are the warnings that `dyknow check` gives, as it shows them.
    """

    merged: ChronicleSet
    records: tuple[ChronicleRecord, ...]
    texts: tuple[SourceText, ...]
    stream: Stream = "traffic"
    doubts: tuple[str, ...] = ()


def load_chronicle_files(
    paths: Sequence[Path], stream: Stream | None = "traffic", messages: Messages = NO_MESSAGES
) -> LoadedChronicles:
    """Read and check chronicle files, as `load_chronicle_texts` does; no path means the whole library.

    Raises
    ------
    InputError
        If a file cannot be read, and what `load_chronicle_texts` raises.
    """
    return load_chronicle_texts([(str(path), read_text(path)) for path in paths], stream, messages)


def load_chronicle_texts(
    own: Sequence[tuple[str, str]],
    stream: Stream | None = "traffic",
    messages: Messages = NO_MESSAGES,
    monitored: Collection[str] = (),
    *,
    with_library: bool = False,
) -> LoadedChronicles:
    """Check chronicle texts (name, text), all in one name space; no text means the whole library.

    Parameters
    ----------
    stream : what they are about; None leaves it to the texts.
    messages : of the monitors that run with them.
    monitored : names that these monitors use: what is of the library comes with the texts.
    with_library : also the whole library.

    Raises
    ------
    InputError
        If there is no chronicle in them.
    ChronicleError
        If a text has errors, or looks at a message as no monitor gives it; it carries the diagnostics of all texts.
    """
    stream = stream or (stream_of(own) if own else "traffic")
    texts = [*library.texts(), *own] if with_library or not own else with_relations(own, stream, monitored)
    merged = load_texts(texts)
    if misused := misuses(texts, messages):
        raise ChronicleError.from_diagnostics(misused)
    if not merged.plans:
        raise InputError(f"{', '.join(name for name, _ in own)}: expected at least one chronicle, got none")
    records = tuple(_record(merged, name, text) for name, text in merged.texts)
    sources = tuple(SourceText(Path(name).name, text) for name, text in texts)
    findings = check_chronicles(own, stream, messages).findings if own else ()
    # Which names nobody gives is known better where the events are: see `idle_chronicles`.
    doubts = tuple(one.render() for one in findings if one.code != "C0901")
    return LoadedChronicles(merged, records, sources, stream, doubts)


@dataclass(frozen=True, slots=True)
class Checked:
    """Hold what was found in some texts.

    Attributes
    ----------
    findings : errors and warnings, in the order of the texts.
    empty : names of the texts that can be read and hold no chronicle.
    stream : what the texts were taken to be about.
    """

    findings: tuple[Diagnostic, ...]
    empty: tuple[str, ...]
    stream: Stream

    @property
    def errors(self) -> int:
        """Return how many findings are errors."""
        return sum(one.severity == "error" for one in self.findings)


def check_chronicles(
    texts: Sequence[tuple[str, str]], stream: Stream | None = None, messages: Messages = NO_MESSAGES
) -> Checked:
    """Check texts (name, text) in one name space.

    Parameters
    ----------
    stream : "traffic" checks them with the relations that the pipeline produces, "own" with what they declare alone;
        None leaves it to the texts.
    messages : of the monitors that are to run with them.

    Examples
    --------
    >>> checked = check_chronicles([("mine", "chronicle met[?a, ?b](t1) { event(close[?a, ?b]:(false, true), t1) }")])
    >>> checked.errors, checked.empty, checked.stream
    (0, (), 'traffic')
    >>> check_chronicles([("mine", "message met[?a, ?b]")]).empty
    ('mine',)
    """
    stream = stream or stream_of(texts)
    names = {name for name, _ in texts}
    found = check_texts(with_relations(texts, stream), {*RANK, *messages} if stream == "traffic" else None)
    unknown = {_place(one) for one in found if one.code == "C0201"}
    findings = tuple(
        one
        for one in found
        # Doubts about the relations' own file are not for the user, who has not written it; and of a name that nobody
        # declares it goes without saying that nobody gives it.
        if (one.severity == "error" or one.file in names) and not (one.code == "C0901" and _place(one) in unknown)
    )
    if not any(one.severity == "error" for one in findings):  # as where a run is refused
        findings += misuses(texts, messages)
    return Checked(findings, tuple(name for name, text in texts if chronicle_names(name, text) == ()), stream)


def _place(one: Diagnostic) -> tuple[str, int, int]:
    return one.file, one.line, one.column


def chronicle_names(name: str, text: str) -> tuple[str, ...] | None:
    """Name the chronicles that a text declares; None if it cannot be read.

    Examples
    --------
    >>> chronicle_names("mine", "message m[?a] chronicle met[?a](t1) { event(m[?a], t1) }"), chronicle_names("", "what")
    (('met',), None)
    """
    reporter = Reporter({name: text})
    declarations = parse(text, name, reporter).declarations
    named = tuple(one.name for one in declarations if isinstance(one, model.Chronicle))
    return None if reporter.errors else named


def with_relations(
    texts: Sequence[tuple[str, str]], stream: Stream = "traffic", monitored: Collection[str] = ()
) -> list[tuple[str, str]]:
    """Put our relations, and what is used of the library, before texts (name, text) about traffic that need them.

    Parameters
    ----------
    monitored : names that monitors use besides.

    Examples
    --------
    >>> twice = "chronicle twice[?a](t1, t2) { event(overtake[?a, ?, ?], t1) event(overtake[?a, ?, ?], t2) t1 < t2 }"
    >>> [name for name, _ in with_relations([("mine", twice)])]
    ['relations.chronicle', 'overtake.chronicle', 'mine']
    """
    # With what is nearly a name of the library, the message about it can say which one was meant.
    used = library_events(texts, nearly=NEARLY, monitored=monitored) if stream == "traffic" else []
    return [*(library.texts(used) if stream == "traffic" else []), *texts]


def read_text(path: Path, what: str = "text file", error_type: type[InputError] = InputError) -> str:
    """Read a UTF-8 text file; messages call it `what`.

    Raises
    ------
    InputError
        If it is missing, unreadable or not UTF-8; of the kind given.
    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise error_type(f"{path}: expected a readable {what}, got {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise error_type(f"{path}: expected UTF-8 text, got byte {error.object[error.start]:#04x}") from error


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
