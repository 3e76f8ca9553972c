"""Which linkage does a user want? A text of classes and links, checked as it is when it runs."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from anchoring.errors import LinkageError
from anchoring.hypotheses.adapter import load_linkage
from anchoring.hypotheses.language import LinkageText, default_text
from anchoring.settings import AnchoringSettings
from dyknow.language.diagnostics import Diagnostic
from service.texts.chronicle_files import read_text


def load_linkage_file(path: Path | None, settings: AnchoringSettings) -> tuple[LinkageText | None, str]:
    """Read and check a linkage file.

    Returns
    -------
    What it says, None without a path, and the text as a run keeps it: empty for the shipped one.

    Raises
    ------
    InputError
        If the file cannot be read.
    LinkageError
        If the text has errors.
    """
    if path is None:
        return None, ""
    text = read_text(path)
    return load_linkage(text, settings, name=str(path)), "" if text == default_text() else text


def check_linkages(texts: Iterable[tuple[str, str]]) -> Iterator[Diagnostic]:
    """Give what is wrong in linkage texts (name, text), each taken alone."""
    for name, text in texts:
        try:
            load_linkage(text, AnchoringSettings(), name=name)
        except LinkageError as error:
            yield from error.diagnostics
