"""Where does the value of an option come from that the command line does not give? The environment, or a file.

Typer asks an option's variable and then its `default_map` by itself; here both get their names, so an option of any
command has its setting without being listed again: `dyknow serve --port` is `port` in the table `[serve]` of
`dyknow.toml`, and `DYKNOW_SERVE_PORT`.
"""

import difflib
import os
import re
import tomllib
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any  # Any: values of options, and typer's own copy of click, whose types it does not show

import typer

from service.cli.options import AsJson
from service.cli.printing import format_table, show
from service.errors import InputError
from service.store.databases.location import shown

USUAL_FILE = Path("dyknow.toml")
TITLES = ("name", "value", "from")
_PLACES = {"ENVIRONMENT": "environment", "DEFAULT_MAP": "file", "DEFAULT": "default"}


def take_settings(root: Any) -> None:
    """Let the options of all commands take what the environment and the file of settings say.

    Parameters
    ----------
    root : the context of `dyknow` itself. Its parameter `config` is the file; if None, `dyknow.toml` in the working
        directory, which need not be there.

    Raises
    ------
    InputError
        If the file cannot be read or names a table or setting that there is not, or if a variable or a value of the
        command that was called is wrong.
    """
    path = root.params["config"] or USUAL_FILE
    if root.params["config"] or path.is_file():
        try:
            root.default_map = _tables(path, tomllib.loads(path.read_text(encoding="utf-8-sig")), root.command)
        except ValueError as error:
            raise InputError(f"{path}: expected TOML in UTF-8, got {error!s}") from error
    for name, context in _contexts(root).items():
        for setting, parameter in _settings(context.command).items():
            parameter.envvar, parameter.show_envvar = _variable(name, setting), False
        if name.partition(" ")[0] == root.invoked_subcommand:
            list(values_of(root, name))


def values_of(root: Any, name: str) -> Iterator[tuple[str, object, str]]:
    """Give the settings of a command: name, value, and where it comes from: `environment`, `file` or `default`.

    Parameters
    ----------
    root : the context of `dyknow` itself, which took its settings.

    Raises
    ------
    InputError
        If there is no such command, a variable that begins as its variables do, or a wrong value.
    """
    path, contexts = root.params["config"] or USUAL_FILE, _contexts(root)
    context = contexts[_known(name, contexts, "command")]
    settings = _settings(context.command)
    variables = [_variable(name, setting) for setting in settings]
    for variable in os.environ:
        if variable.startswith(_variable(name, "")):
            _known(variable, variables, "environment")
    for setting, parameter in settings.items():
        value, source = parameter.consume_value(context, {})
        place = _PLACES[source.name]
        if place != "default":
            try:
                parameter.process_value(context, value)
            except typer.BadParameter as error:
                where = parameter.envvar if place == "environment" else f"{path}: [{name.replace(' ', '.')}] {setting}"
                raise InputError(f"{where}: expected what {parameter.opts[0]} takes, got {value!r}: {error}") from error
        yield setting, value, place


def show_config(
    context: typer.Context,
    command: Annotated[list[str] | None, typer.Argument(metavar="[COMMAND]", help="Whose. Default: serve.")] = None,
    origin: Annotated[bool, typer.Option("--origin", help="Also say where each value comes from.")] = False,
    as_json: AsJson = False,
) -> None:
    """List the settings of a command: what its options are where the command line does not give them."""
    name, columns = " ".join(command or ["serve"]), 3 if origin else 2
    values = values_of(context.find_root(), name)
    found = [(one, None if value is None else shown(str(value)), place) for one, value, place in values]
    table = format_table(TITLES[:columns], [[cell or "" for cell in row[:columns]] for row in found])
    show({"command": name, "settings": [dict(zip(TITLES, row, strict=True)) for row in found]}, table, as_json=as_json)


def _contexts(parent: Any) -> dict[str, Any]:
    """Make the context of each command, those of groups with two words, as if it had been called without arguments."""
    found: dict[str, Any] = {}
    for word, command in parent.command.commands.items():
        context = typer.Context(command, parent=parent, info_name=word)
        inner = _contexts(context) if hasattr(command, "commands") else {}
        found.update({f"{word} {one}": two for one, two in inner.items()} or {word: context})
    return found


def _settings(command: Any) -> dict[str, Any]:
    """Give the parameters of a command by the names of their settings."""
    return {one.opts[0].lstrip("-").replace("-", "_"): one for one in command.params}


def _variable(*words: str) -> str:
    """Name the variable of a setting.

    Examples
    --------
    >>> _variable("why-not", "limit"), _variable("log prune", "dry_run")
    ('DYKNOW_WHY_NOT_LIMIT', 'DYKNOW_LOG_PRUNE_DRY_RUN')
    """
    return re.sub("[ -]", "_", "_".join(("dyknow", *words)).upper())


def _tables(path: Path, values: Mapping[str, object], group: Any) -> dict[str, Any]:
    """Give the values by commands and their parameters, as typer's `default_map` has them."""
    found: dict[str, Any] = {}
    for word, table in values.items():
        command = group.commands[_known(word, group.commands, path)]
        if not isinstance(table, dict):
            raise InputError(f"{path}: {word}: expected a table [{word}], got {table!r}")
        if hasattr(command, "commands"):
            found[word] = _tables(path, table, command)
        else:
            known = _settings(command)
            found[word] = {known[_known(one, known, f"{path}: [{word}]")].name: table[one] for one in table}
    return found


def _known(came: str, known: Collection[str], place: object) -> str:
    """Give a name back; raises an `InputError` with the nearest one if it is not known."""
    if came in known:
        return came
    hint = "".join(f"; did you mean {near!r}?" for near in difflib.get_close_matches(came, known, n=1))
    raise InputError(f"{place}: expected one of {', '.join(known)}; got {came!r}{hint}")
