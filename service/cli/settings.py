"""Where does the value of an option come from that the command line does not give? The environment, or a file.

Typer asks an option's variable and then its `default_map` by itself; here both get their names, so an option of any
command has its setting without being listed again: `dyknow serve --port` is `port` in the table `[serve]` of
`dyknow.toml`, and `DYKNOW_SERVE_PORT`.
"""

import difflib
import os
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any  # values of options, and typer's own copy of click, whose types it does not show

import typer

from service.errors import InputError

USUAL_FILE = Path("dyknow.toml")
_PLACES = {"ENVIRONMENT": "environment", "DEFAULT_MAP": "file", "DEFAULT": "default"}


def take_settings(root: typer.Context, file: Path | None) -> None:
    """Let the options of all commands take what the environment and a file of settings say.

    Parameters
    ----------
    root : the context of `dyknow` itself.
    file : None for `dyknow.toml` in the working directory, which need not be there.

    Raises
    ------
    InputError
        If the file cannot be read or names a table or setting that there is not, or if a variable or a value of the
        command that was called is wrong.
    """
    commands = _commands(root.command)
    for name, command in commands.items():
        for setting, parameter in _settings(command).items():
            parameter.envvar, parameter.show_envvar = _variable(name, setting), False
    path = file or USUAL_FILE
    if file is not None or path.is_file():
        root.default_map = _tables(path, _read(path), root.command)
    for name in commands:
        if name.partition(" ")[0] == root.invoked_subcommand:
            _check(path, name, _context(root, name))


def values_of(called: typer.Context, name: str) -> Iterator[tuple[str, object, str]]:
    """Give the settings of a command: name, value, and where it comes from: `environment`, `file` or `default`.

    Parameters
    ----------
    called : the context of any command.

    Raises
    ------
    InputError
        If there is no such command, or it has wrong settings.
    """
    root: Any = called.find_root()
    commands = _commands(root.command)
    if name not in commands:
        raise InputError(f"command: {_unknown(name, commands)}")
    context = _context(root, name)
    _check(Path(root.params["config"] or USUAL_FILE), name, context)
    for setting, parameter in _settings(context.command).items():
        value, source = parameter.consume_value(context, {})
        yield setting, value, _PLACES[source.name]


def _commands(group: Any, before: str = "") -> dict[str, Any]:
    """Give the commands by their names, those of groups with two words."""
    found: dict[str, Any] = {}
    for word, command in group.commands.items():
        found.update(_commands(command, f"{word} ") if hasattr(command, "commands") else {before + word: command})
    return found


def _settings(command: Any) -> dict[str, Any]:
    """Give the parameters of a command by the names of their settings."""
    return {one.opts[0].lstrip("-").replace("-", "_"): one for one in command.params}


def _context(root: Any, name: str) -> Any:
    """Make the context of a command, as if it had been called without arguments."""
    context = root
    for word in name.split():
        context = typer.Context(context.command.commands[word], parent=context, info_name=word)
    return context


def _variable(*words: str) -> str:
    """Name the variable of a setting.

    Examples
    --------
    >>> _variable("why-not", "limit"), _variable("log prune", "dry_run")
    ('DYKNOW_WHY_NOT_LIMIT', 'DYKNOW_LOG_PRUNE_DRY_RUN')
    """
    return re.sub("[ -]", "_", "_".join(("dyknow", *words)).upper())


def _read(path: Path) -> dict[str, object]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except ValueError as error:
        raise InputError(f"{path}: expected TOML in UTF-8, got {error!s}") from error


def _tables(path: Path, values: Mapping[str, object], group: Any) -> dict[str, Any]:
    """Give the values by commands and their parameters, as typer's `default_map` has them."""
    found: dict[str, Any] = {}
    for word, table in values.items():
        if word not in group.commands:
            raise InputError(f"{path}: {_unknown(word, group.commands)}")
        if not isinstance(table, dict):
            raise InputError(f"{path}: {word}: expected a table [{word}], got {table!r}")
        command = group.commands[word]
        if hasattr(command, "commands"):
            found[word] = _tables(path, table, command)
            continue
        known = _settings(command)
        if unknown := [one for one in table if one not in known]:
            raise InputError(f"{path}: [{word}]: {_unknown(unknown[0], known)}")
        found[word] = {known[one].name: value for one, value in table.items()}
    return found


def _check(path: Path, name: str, context: Any) -> None:
    """Refuse variables of a command that there are not, and values that its parameters do not take."""
    settings = _settings(context.command)
    variables = [_variable(name, setting) for setting in settings]
    for variable in os.environ:
        if variable.startswith(_variable(name, "")) and variable not in variables:
            raise InputError(f"environment: {_unknown(variable, variables)}")
    for setting, parameter in settings.items():
        value, source = parameter.consume_value(context, {})
        if (kind := _PLACES[source.name]) == "default":
            continue
        try:
            parameter.process_value(context, value)
        except typer.BadParameter as error:
            place = parameter.envvar if kind == "environment" else f"{path}: [{name.replace(' ', '.')}] {setting}"
            raise InputError(f"{place}: expected a value for {parameter.opts[0]}, got {value!r}: {error}") from error


def _unknown(came: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(came, known, n=1)
    return f"expected one of {', '.join(known)}; got {came!r}{f'; did you mean {near[0]!r}?' if near else ''}"
