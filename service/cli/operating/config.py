"""`dyknow config`: which settings does a command have, and where does each come from?"""

from pathlib import Path
from typing import Annotated

import typer

from service.cli.options import AsJson
from service.cli.printing import format_table, show
from service.cli.settings import values_of


def show_config(
    context: typer.Context,
    command: Annotated[list[str] | None, typer.Argument(metavar="[COMMAND]", help="Whose. Default: serve.")] = None,
    origin: Annotated[bool, typer.Option("--origin", help="Also say where each value comes from.")] = False,
    as_json: AsJson = False,
) -> None:
    """List the settings of a command: what its options are where the command line does not give them."""
    from service.store.databases.location import shown

    name = " ".join(command or ["serve"])
    found = [
        (setting, shown(str(value)) if isinstance(value, (str, Path)) else value, place)
        for setting, value, place in values_of(context, name)
    ]
    rows = [[setting, "" if value is None else str(value), place] for setting, value, place in found]
    columns = 3 if origin else 2
    table = format_table(("setting", "value", "from")[:columns], [row[:columns] for row in rows])
    records = [{"name": setting, "value": value, "from": place} for setting, value, place in found]
    show({"command": name, "settings": records}, table, as_json=as_json)
