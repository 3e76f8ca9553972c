"""Which monitors does a user want? Texts of monitors, checked against what the pipeline knows of traffic."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

from chronicles.chronicle_set import ChronicleSet
from dyknow.monitors.features import features_of
from dyknow.monitors.kinds import check_kinds
from dyknow.monitors.monitors import Outcome, version_of
from dyknow.mtl.formula import Monitor
from dyknow.mtl.parser import parse_monitors
from dyknow.mtl.printer import print_monitors
from qsr.relations import RANK
from service.chronicle_files import read_text
from service.errors import InputError
from service.monitored_features import KINDS, NEED_ROADS, SIGNATURE
from service.records import MonitorRecord


@dataclass(frozen=True, slots=True)
class LoadedMonitors:
    """Hold checked monitors, in the order of their files.

    Attributes
    ----------
    features : what the monitors look at, relations among it.
    """

    definitions: tuple[Monitor, ...] = ()
    features: frozenset[str] = frozenset()

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

    def check_chronicles(self, chronicles: ChronicleSet) -> None:
        """Refuse chronicles that cannot run with these monitors.

        Raises
        ------
        InputError
            If a chronicle has the name of a monitor, or looks at a monitor's events with another number of objects, so
            that none would ever match.
        """
        for one in self.definitions:
            if one.name in chronicles.names:
                raise InputError(f"monitor {one.name!r}: expected a name that no chronicle has, got that of one")
        arities = {
            f"{one.name}_{outcome}": len(one.subjects) for one in self.definitions for outcome in get_args(Outcome)
        }
        for plan in chronicles.plans:
            tests = [one.test for one in plan.positions] + [one.test for one in plan.counts]
            for test in tests:
                arity = arities.get(test.name, test.arity)
                if arity != test.arity:
                    came = f"expected {arity} arguments of {test.name!r}, as the monitor has, got {test.arity}"
                    raise InputError(f"chronicle {plan.name!r}: {came}")


NO_MONITORS = LoadedMonitors()


def load_monitor_files(paths: Sequence[Path]) -> LoadedMonitors:
    """Read and check files of monitors, all in one name space.

    Raises
    ------
    InputError
        If a file cannot be read or has no monitor, or two files have one of the same name.
    FormulaError, KindError
        If a text is malformed, names what there is not, or compares what cannot be compared.
    """
    definitions: list[Monitor] = []
    file_of: dict[str, Path] = {}
    for path in paths:
        found = parse_monitors(read_text(path), name=str(path), signature=SIGNATURE)
        check_kinds(found, KINDS, name=str(path))
        if not found:
            raise InputError(f"{path}: expected at least one monitor, got none")
        for one in found:
            if one.name in file_of:
                raise InputError(
                    f"{path}: expected a new name of a monitor, got {one.name!r} as in {file_of[one.name]}"
                )
            file_of[one.name] = path
        definitions += found
    return LoadedMonitors(tuple(definitions), features_of(definitions))
