"""Do the relations of qsr, the declarations for chronicles, the monitors' features and docs/qsr.md name the same?"""

import re
from typing import get_args

from dyknow.mtl.kinds import Kind
from gis.roads.turns import TurnDirection
from qsr.relations import RELATIONS
from service.texts.monitored_features import CAR_FEATURES, KINDS, NEED_ROADS, PLACE_RELATIONS, SIGNATURE, WORDS
from tests.contracts.tables import LIBRARY, declared, page, table, terms

TEXT = (LIBRARY / "relations.chronicle").read_text(encoding="utf-8")
ATTRIBUTES = declared(TEXT, "attribute")
ROWS = [(terms(row[0]), row[2], row[3]) for row in table("qsr.md", "relation")]
DOCUMENTED = {name: arguments for row, _, _ in ROWS for name, arguments in row.items()}

DOMAINS = {"a": "Car", "b": "Car", "car": "Car", "road": "Road", "lane": "Lane", "junction": "Junction"}
DOMAINS |= {"from": "Road", "to": "Road"}


def test_names_and_arities_are_the_same_in_all_four() -> None:
    arities = {one.name: one.arity for one in RELATIONS}
    assert {name: len(arguments) - 1 for name, arguments in ATTRIBUTES.items()} == arities
    assert {name: len(arguments) for name, arguments in DOCUMENTED.items()} == arities
    monitored = {name: arity for name, arity in SIGNATURE.features.items() if name not in CAR_FEATURES}
    assert monitored == arities


def test_every_declaration_of_the_text_was_read() -> None:
    assert len(ATTRIBUTES) == len(re.findall(r"^attribute", TEXT, re.MULTILINE))
    assert len(DOCUMENTED) == len(RELATIONS) == len(set(RELATIONS))


def test_arguments_of_the_page_have_the_domains_of_the_declarations() -> None:
    domains = {name: tuple(domain for _, domain in arguments[:-1]) for name, arguments in ATTRIBUTES.items()}
    assert {name: tuple(DOMAINS[one] for one in arguments) for name, arguments in DOCUMENTED.items()} == domains


def test_values_are_the_same_in_text_monitors_and_map() -> None:
    values = dict(re.findall(r"^domain (\w+) = \{(.*)\}", TEXT, re.MULTILINE))
    assert tuple(values["Turn"].split(", ")) == get_args(TurnDirection) == WORDS["turn"]
    assert set(values["Truth"].split(", ")) == {"true", "false"}
    of_text = {name: arguments[-1][1] for name, arguments in ATTRIBUTES.items()}
    of_monitors = {name: "Truth" if KINDS[name] is Kind.TRUTH else "Turn" for name in ATTRIBUTES}
    assert of_text == of_monitors
    assert {word for row, _, _ in ROWS if "turn" in row for word in WORDS["turn"] if f"`{word}`" in page("qsr.md")} == {
        *WORDS["turn"]
    }


def test_converses_are_those_of_the_page_and_go_both_ways() -> None:
    converse = {one.name: one.converse for one in RELATIONS}
    documented = {name: _converse(name, cell) for row, _, cell in ROWS for name in row}
    assert documented == converse
    assert all(converse[other] == name for name, other in converse.items() if other)


def test_what_is_measured_on_the_map_is_so_on_the_page_and_for_monitors() -> None:
    on_map = {one.name for one in RELATIONS if one.frame == "map"}
    assert {name for row, frame, _ in ROWS if frame == "map" for name in row} == on_map
    on_road = {one.name for one in RELATIONS if one.frame == "road"}
    assert {name for name in NEED_ROADS if name not in CAR_FEATURES} == on_map | on_road
    places = {name for name, arguments in ATTRIBUTES.items() if {"Road", "Lane", "Junction"} & {arguments[1][1]}}
    assert places - {"turn"} == PLACE_RELATIONS


def test_monitors_page_has_every_feature_and_no_other() -> None:
    rows = table("monitors.md", "feature")
    named = {name for row in rows for name in re.findall(r"`(\w+)\[\?c\]`", row[0])}
    assert named - set(ATTRIBUTES) == CAR_FEATURES.keys()
    (classes,) = (row[1] for row in rows if "`class" in row[0])
    assert tuple(re.findall(r'"(\w+)"', classes)) == WORDS["class"]


def _converse(name: str, cell: str) -> str:
    """Read the cell: another relation with its arguments exchanged, itself, or words that say there is none."""
    if cell == "itself":
        return name
    assert cell in ("", "none", "told once") or terms(cell), cell
    assert all(arguments == ("b", "a") for arguments in terms(cell).values()), cell
    return next(iter(terms(cell)), "")
