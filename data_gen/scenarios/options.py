"""Which knobs does a scenario have? Typed options, read from text such as `blocked=1`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from data_gen.errors import DataGenError

_FLAGS: tuple[str, ...] = ("0", "1")


@dataclass(frozen=True, slots=True)
class ScenarioOption:
    """One knob of a scenario: its values are few and named."""

    name: str
    meaning: str
    values: tuple[str, ...] = _FLAGS
    """Allowed values, the default first; a flag unless said otherwise."""


@dataclass(frozen=True, slots=True)
class OptionValues:
    """The checked options of one scenario, defaults filled in."""

    values: Mapping[str, str]

    def flag(self, name: str) -> bool:
        """Tell whether a flag is set; the option must exist."""
        return self.values[name] == "1"

    def choice(self, name: str) -> str:
        """Give the value of an option; the option must exist."""
        return self.values[name]


def read_options(scenario: str, known: Sequence[ScenarioOption], given: Mapping[str, str]) -> OptionValues:
    """Check options and fill in the defaults.

    Parameters
    ----------
    scenario : its name, for messages.
    known : the options that the scenario has.
    given : option names and values, as text.

    Returns
    -------
    A value for each known option.

    Raises
    ------
    DataGenError
        If an option is unknown or has a value that it does not know.

    Examples
    --------
    >>> lights = ScenarioOption("lights", "program of the traffic light", ("fixed", "actuated"))
    >>> read_options("junction", [lights], {}).choice("lights")
    'fixed'
    >>> read_options("junction", [lights], {"light": "off"})
    Traceback (most recent call last):
    ...
    data_gen.errors.DataGenError: scenario 'junction': expected options out of lights=fixed|actuated, got 'light'
    """
    by_name = {option.name: option for option in known}
    for name, value in given.items():
        if name not in by_name:
            raise DataGenError(f"scenario {scenario!r}: expected {_known_text(known)}, got {name!r}")
        if value not in by_name[name].values:
            expected = " or ".join(by_name[name].values)
            raise DataGenError(f"scenario {scenario!r}, option {name!r}: expected {expected}, got {value!r}")
    return OptionValues({option.name: given.get(option.name, option.values[0]) for option in known})


def _known_text(known: Sequence[ScenarioOption]) -> str:
    if not known:
        return "no options"
    return "options out of " + ", ".join(f"{option.name}={'|'.join(option.values)}" for option in known)
