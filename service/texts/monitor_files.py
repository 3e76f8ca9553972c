"""Which monitors does a user want? Texts of monitors, checked against what the pipeline knows of traffic."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from chronicles.chronicle_set import ChronicleSet
from dyknow.errors import FormulaError
from dyknow.language.diagnostics import Reporter
from dyknow.language.words import normalised
from dyknow.mtl.formula import Monitor
from dyknow.mtl.monitors import version_of
from dyknow.mtl.parser import parse_monitors
from dyknow.mtl.printer import print_monitors
from dyknow.mtl.structure import features_of
from qsr.relations import RANK
from service.errors import InputError
from service.records.runs import MonitorRecord
from service.texts.chronicle_files import read_text
from service.texts.monitor_messages import Messages, messages_of
from service.texts.monitored_features import NEED_ROADS, NO_EVENTS, SIGNATURE, Given, signature_with


@dataclass(frozen=True, slots=True)
class LoadedMonitors:
    """Hold checked monitors, in the order of their files.

    Attributes
    ----------
    features : what the monitors look at, relations among it.
    events : the events of chronicles that they look at; no feature is among them.
    """

    definitions: tuple[Monitor, ...] = ()
    features: frozenset[str] = frozenset()
    events: frozenset[str] = frozenset()

    @property
    def looking_at_events(self) -> tuple[Monitor, ...]:
        """Return the monitors that look at events of chronicles."""
        return tuple(one for one in self.definitions if self.events & features_of([one]))

    @property
    def relations(self) -> frozenset[str]:
        """Return the relations that the monitors look at."""
        return self.features & RANK.keys()

    @property
    def records(self) -> tuple[MonitorRecord, ...]:
        """Return the monitors as the log lists them."""
        return tuple(
            MonitorRecord(one.name, version_of(one), print_monitors([one]).strip()) for one in self.definitions
        )

    @property
    def messages(self) -> Messages:
        """Return the messages that the monitors give to chronicles."""
        return messages_of(self.definitions)

    def check_roads(self, where: str, *, has_roads: bool) -> None:
        """Refuse monitors that ask for roads where there are none.

        Raises
        ------
        InputError
            If there is such a monitor.
        """
        asked = sorted(self.features & NEED_ROADS)
        if asked and not has_roads:
            raise InputError(f"{where}: expected roads, which the monitors need for {', '.join(asked)}, got none")

    def check_names(self, chronicles: ChronicleSet) -> None:
        """Refuse chronicles that cannot be told from these monitors in a log, or that do not feed one way only.

        Raises
        ------
        InputError
            If a chronicle has the name of a monitor, or gives what is a message of one; if it looks at a message of a
            monitor that looks at events, or at any while monitors look at what it gives.
        """
        for one in self.definitions:
            if one.name in chronicles.names:
                raise InputError(f"monitor {one.name!r}: expected a name that no chronicle has, got that of one")
        for plan in chronicles.plans:
            taken = sorted(self.messages.keys() & {plan.name, *plan.produces})
            if taken:
                raise InputError(
                    f"chronicle {plan.name!r}: expected names of events that no monitor gives, got {taken[0]!r}"
                )
        late, feeding = messages_of(self.looking_at_events), chronicles.feeding(self.events).names
        for plan in chronicles.plans:
            messages, fitting = late, "messages of monitors that look at no chronicle"
            if plan.name in feeding:
                messages, fitting = self.messages, "no message of a monitor, as it feeds monitors itself"
            taken = sorted(plan.consumes & messages.keys())
            if taken:
                raise InputError(f"chronicle {plan.name!r}: expected {fitting}, got {taken[0]!r}")


NO_MONITORS = LoadedMonitors()


def load_monitor_files(paths: Sequence[Path], given: Given | None = NO_EVENTS) -> LoadedMonitors:
    """Read and check files of monitors; as `load_monitor_texts`, with an `InputError` if a file cannot be read."""
    return load_monitor_texts([(str(path), read_text(path)) for path in paths], given)


def load_monitor_texts(texts: Sequence[tuple[str, str]], given: Given | None = NO_EVENTS) -> LoadedMonitors:
    """Check texts of monitors, all in one name space.

    Parameters
    ----------
    texts : what messages call each, and the text.
    given : the events that the monitors may look at; None if that is not known yet, and then any name may be one.

    Raises
    ------
    InputError
        If a text has no monitor.
    FormulaError
        If a text is malformed, names what there is not, compares what cannot be compared, or has a monitor with the
        name of another one.
    """
    signature = None if given is None else signature_with(given)
    definitions: list[Monitor] = []
    text_of: dict[str, str] = {}
    for name, text in texts:
        found = parse_monitors(text, name=name, signature=signature)
        if not found:
            raise InputError(f"{name}: expected at least one monitor, got none")
        _refuse_known_names(text, name, found, text_of)
        text_of |= dict.fromkeys((one.name for one in found), name)
        definitions += found
    used = features_of(definitions)
    known = SIGNATURE.features.keys()
    return LoadedMonitors(tuple(definitions), used & known, used - known)


def _refuse_known_names(text: str, name: str, found: Sequence[Monitor], text_of: Mapping[str, str]) -> None:
    reporter = Reporter({name: normalised(text)})
    for one in found:
        if one.name in text_of:
            message = f"expected a new name of a monitor, got {one.name!r} as in {text_of[one.name]}"
            reporter.error("F0206", message, one.span)
    reporter.raise_if_any(FormulaError)
