"""Which processes and streams does a KPL text declare? Answered from the text alone: nothing is created."""

from pathlib import Path

from msgspec import Struct

from dyknow.kpl.checks import check_kpl
from dyknow.kpl.loader import made_of
from dyknow.kpl.model import ConfigureDeclaration, MediationDeclaration, Process, Term
from dyknow.kpl.policies import policy_of
from dyknow.kpl.vocabulary import Vocabulary
from service.records.runs import ProcessRecord, SourceText, StreamInput
from service.runs.graph.pipeline import VIDEO, shipped_kpl
from service.texts.chronicle_files import read_text


class NamedStream(Struct, frozen=True):
    """A stream that the text hands to the host, the label that it reads, and under which policy."""

    name: str
    label: str
    policy: str


class DeclaredStreams(Struct, frozen=True):
    """What a text declares.

    Attributes
    ----------
    kpl : what messages call the text.
    processes : inputs before what reads them.
    streams : in the order of the text.
    warnings : what is allowed but probably not meant, as it is shown to people.
    """

    kpl: str
    processes: tuple[ProcessRecord, ...]
    streams: tuple[NamedStream, ...]
    warnings: tuple[str, ...]


def read_declared_streams(path: Path | None = None) -> DeclaredStreams:
    """Read and check a KPL text; without a path, the shipped one for video.

    Raises
    ------
    InputError
        If the file cannot be read.
    KplError
        If the text is malformed or means nothing.

    Examples
    --------
    >>> declared = read_declared_streams()
    >>> declared.kpl, declared.processes[1].label, declared.processes[1].made_of
    ('traffic.kpl', 'vision_objects', 'vision')
    >>> declared.processes[1].inputs
    (StreamInput(label='frames', policy='any update, strict order'),)
    """
    kpl = shipped_kpl(VIDEO) if path is None else SourceText(str(path), read_text(path))
    checked = check_kpl(kpl.text, name=kpl.name)
    return DeclaredStreams(
        kpl.name,
        tuple(_process(one, checked.vocabulary) for one in checked.processes),
        tuple(
            NamedStream(name, str(one.term.label), _policy(one.term))
            for name, one in checked.vocabulary.streams.items()
        ),
        tuple(warning.render() for warning in checked.warnings),
    )


def _process(declared: Process, vocabulary: Vocabulary) -> ProcessRecord:
    is_configuration = isinstance(declared, ConfigureDeclaration)
    return ProcessRecord(
        label=str(declared.label),
        kind=_kind(declared),
        made_of=made_of(declared),
        type="" if is_configuration else str(vocabulary.output_of(vocabulary.processes[str(declared.label)])),
        inputs=tuple(StreamInput(str(term.label), _policy(term)) for term in declared.inputs),
    )


def _kind(declared: Process) -> str:
    match declared:
        case MediationDeclaration(kind=kind):
            return kind.value
        case ConfigureDeclaration():
            return "configuration"
        case _:
            return "refinement" if declared.inputs else "source"


def _policy(term: Term) -> str:
    return str(policy_of(term.constraints))
