"""Do the pages list the commands, exit codes, site fields and tables that there are, and no others?"""

import re
import signal

from anchoring.hypotheses.language import FLUENTS, default_text
from service.cli import printing
from service.cli.app import COMMANDS, GROUPS
from service.runs.inputs.sites.site import SiteFile
from service.store.schema import metadata
from service.texts.toml_tables import tables_of
from tests.contracts.tables import ROOT, page, table
from tests.docs.commands import all_commands, program

WORDS = rf"dyknow ((?:(?:{'|'.join(GROUPS)}) )?[\w-]+)"


def test_command_line_page_lists_every_command() -> None:
    listed = [re.findall(rf"^`{WORDS}", row[0])[0] for row in table("cli.md", "command")]
    assert sorted(listed) == sorted(COMMANDS)


def test_command_line_page_shows_every_command_at_work() -> None:
    shown = set(re.findall(rf"^    {WORDS}", page("cli.md"), re.MULTILINE))
    assert set(COMMANDS) - shown == set()


def test_command_line_page_has_no_option_that_does_not_exist() -> None:
    commands = (program(), *all_commands().values())
    options = {word for command in commands for one in command.params for word in one.opts}
    named = set(re.findall(r"(?<![\w-])--[a-z][\w-]*", page("cli.md"))) - {"--help"}
    assert named - options == set()


def test_exit_codes_are_those_of_the_page() -> None:
    codes = {value for name, value in vars(printing).items() if name.isupper() and name != "SIGNALLED"}
    codes |= {printing.SIGNALLED + number for number in (signal.SIGTERM, signal.SIGHUP)}
    listed = [int(code) for row in table("cli.md", "code") for code in row[0].split(",")]
    assert sorted(listed) == sorted(codes)


def test_site_fields_are_those_of_the_page() -> None:
    rows = [re.findall(r"`(.*?)`", cell) for row in table("site_file.md", "field") for cell in row[0::2]]
    named = {part for row in rows for name in row for part in re.findall(r"[a-z]\w+", name)}
    of_engines = ("anchoring", "relations", "vision")  # their numbers are told elsewhere
    tables = ((place.partition(".")[0], names) for place, names in tables_of(SiteFile))
    fields = {name for place, names in tables if place not in of_engines for name in names}
    assert fields - named == set()
    heads = {part for names in rows[0::2] for name in names for part in re.findall(r"[a-z]\w+", name)}
    assert heads - fields == set()


def test_tables_are_those_of_the_page_on_the_event_log() -> None:
    listed = [name for row in table("event_log.md", "table") for name in re.findall(r"`(\w+)`", row[0])]
    assert sorted(listed) == sorted(metadata.tables)


def test_fluents_are_those_of_the_page_on_linkage() -> None:
    listed = [name for row in table("linkage.md", "fluent") for name in re.findall(r"`(\w+)`", row[0])]
    assert sorted(listed) == sorted(FLUENTS)


def test_codes_of_linkage_are_those_of_the_page() -> None:
    source = (ROOT / "anchoring" / "hypotheses" / "language.py").read_text(encoding="utf-8")
    listed = re.findall(r"L\d{4}", " ".join(row[0] for row in table("linkage.md", "code")))
    assert {*listed} == {*re.findall(r"\"(L\d{4})\"", source), "L0101", "L0102", "L0103"}


def test_excerpts_of_the_page_on_linkage_are_in_the_default_text() -> None:
    blocks = re.findall(r"^```text\n((?:class|link) .*?)^```$", page("linkage.md"), re.MULTILINE | re.DOTALL)
    shown = [line for block in blocks for line in block.splitlines() if "maintain" not in line]
    assert len(shown) > 5
    assert [line for line in shown if line not in default_text().splitlines()] == []
