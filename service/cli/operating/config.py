"""`dyknow config`: which settings does a command have, and where does each come from?"""

from typing import Annotated

import typer

from service.cli.options import AsJson
from service.cli.printing import format_table, show
from service.cli.settings import values_of

TITLES = ("name", "value", "from")


def show_config(
    context: typer.Context,
    command: Annotated[list[str] | None, typer.Argument(metavar="[COMMAND]", help="Whose. Default: serve.")] = None,
    origin: Annotated[bool, typer.Option("--origin", help="Also say where each value comes from.")] = False,
    as_json: AsJson = False,
) -> None:
    """List the settings of a command: what its options are where the command line does not give them."""
    from service.store.databases.location import shown

    name, columns = " ".join(command or ["serve"]), 3 if origin else 2
    values = values_of(context.find_root(), name)
    found = [(one, None if value is None else shown(str(value)), place) for one, value, place in values]
    table = format_table(TITLES[:columns], [[cell or "" for cell in row[:columns]] for row in found])
    show({"command": name, "settings": [dict(zip(TITLES, row, strict=True)) for row in found]}, table, as_json=as_json)
