"""What is allowed but probably not meant comes back as warnings."""

import pytest

from dyknow.kpl.checks import check_kpl


def doubts(text: str) -> list[tuple[str, str]]:
    return [(found.code, found.message) for found in check_kpl(text).warnings]


@pytest.mark.parametrize(
    ("declared", "kind", "name"),
    [
        ("sort Unused = float;", "sort", "Unused"),
        ("sort Car; object Car car1;", "object", "car1"),
        ("feature float heading;", "feature", "heading"),
        ("source float radar;", "source", "radar"),
        ("compunit float step(float);", "unit", "step"),
        ("configuration follow(float);", "configuration", "follow"),
    ],
    ids=["sort", "object", "feature", "source", "unit", "configuration"],
)
def test_what_is_declared_and_not_used_is_doubted(declared: str, kind: str, name: str) -> None:
    text = "source float gps; strmgen pos = gps; stream seen = pos;" + declared
    assert doubts(text) == [("K0602", f"{kind} {name!r} is declared, but not used")]


def test_what_a_configuration_creates_may_read_and_name_anything() -> None:
    text = """sort Car; object Car car1; feature float pos(Car); source float gps;
    configuration follow(float); strmgen here = gps; strmgen other = gps; configure a = follow(here);"""
    assert doubts(text) == []


def test_what_a_mediation_may_pass_on_is_not_unread() -> None:
    text = """source float gps; source string names; source set(string) labels;
    strmgen pos = gps; strmgen words = names; strmgen chosen = labels;
    strmgen near = selection of float by chosen; stream seen = near;"""
    assert doubts(text) == [("K0601", "label 'words' is read by no unit and no stream")]


@pytest.mark.parametrize("constraint", ["use most recent", "linear interpolation"])
def test_approximation_without_sampling_is_doubted(constraint: str) -> None:
    text = f"source float gps; strmgen pos = gps; stream seen = pos with strict order, {constraint};"
    assert doubts(text) == [("K0603", f"{constraint!r} has no effect without 'sample every'")]


def test_oldest_is_doubted_where_everything_is_read_anyway() -> None:
    text = """source float gps; compunit float step(float); strmgen pos = gps;
    strmgen far = step(pos with oldest 2s); stream seen = far with oldest 2s;"""
    assert doubts(text) == [("K0603", "'oldest' has no effect on a process, which reads from the beginning")]
