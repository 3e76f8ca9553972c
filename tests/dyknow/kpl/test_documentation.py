"""The page on KPL is right: its examples run, and its table of errors is complete."""

import doctest
import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from lark import Lark

from dyknow.errors import KplError
from dyknow.kpl.checks import check_kpl
from dyknow.kpl.parser import parse_kpl
from dyknow.kpl.policies import parse_policy
from dyknow.kpl.printer import print_kpl
from dyknow.policies.policy_pipeline import PolicyPipeline
from dyknow.sample import Sample
from tests.dyknow.language.codes import shared_codes

PAGE = Path(__file__).parents[3] / "docs" / "kpl.md"
TEXT = PAGE.read_text(encoding="utf-8")
KPL = files("dyknow.kpl")


def blocks(kind: str) -> list[str]:
    return re.findall(rf"^```{kind}\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)


def read(item: str) -> Sample[Any]:
    """Read `valid=value@available`, times in milliseconds."""
    valid, _, rest = item.partition("=")
    value, _, available = rest.partition("@")
    return Sample(int(available or valid) * 1000, int(valid) * 1000, int(value) if value.isdigit() else value)


def write(sample: Sample[Any]) -> str:
    late = f"@{sample.available_us // 1000}" if sample.delay_us else ""
    return f"{sample.valid_us // 1000}={sample.value}{late}"


def received(policy: str, items: list[str]) -> list[str]:
    pipeline = PolicyPipeline(parse_policy(policy))
    samples: list[Sample[Any]] = []
    for item in items:
        told = item.startswith("told=")
        samples += pipeline.advance(int(item[5:]) * 1000) if told else pipeline.offer(read(item))
    return [write(sample) for sample in [*samples, *pipeline.finish()]]


def test_the_python_examples_run() -> None:
    failed, attempted = doctest.testfile(
        str(PAGE), module_relative=False, optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    )
    assert attempted > 25
    assert failed == 0


@pytest.mark.parametrize("block", blocks("policy"))
def test_policy_does_what_the_page_shows(block: str) -> None:
    policy, inputs, outputs = block.splitlines()
    assert inputs.split()[0] == "in"
    assert outputs.split() == ["out", *received(policy, inputs.split()[1:])]


def test_every_form_of_constraint_has_an_example() -> None:
    examples = "\n".join(blocks("policy"))
    forms = ("any update", "any change", "sample every", "no approximation", "use most recent", "linear interpolation")
    assert all(form in examples for form in (*forms, "max delay", "from", "to", "monotone order", "strict order"))


def test_kpl_examples_mean_something_and_leave_no_doubt() -> None:
    texts = [*blocks("kpl"), *blocks("kpl traffic")]
    assert len(texts) == 2
    for text in texts:
        assert check_kpl(text).warnings == ()
        assert parse_kpl(print_kpl(parse_kpl(text))) == parse_kpl(text)


def test_changed_sample_period_fits_into_the_pipeline() -> None:
    [traffic], [change] = blocks("kpl traffic"), blocks("kpl traffic change")
    text, count = re.subn(r"strmgen cars = .*\n", change, traffic)
    assert count == 1
    [cars] = [one for one in check_kpl(text).processes if str(one.label) == "cars"]
    assert cars.inputs[0].constraints[0].us == 200_000


def test_table_has_every_code() -> None:
    used = {code for file in KPL.iterdir() for code in re.findall(r"K0\d{3}", source_of(file))}
    listed = re.findall(r"^\| (K\d{4}) \|", TEXT, re.MULTILINE)
    assert listed == sorted(used | shared_codes("K"))


def source_of(file: Any) -> str:  # Any: a Traversable, whose module depends on the version
    return file.read_text(encoding="utf-8") if file.name.endswith(".py") else ""


def test_reserved_words_are_those_that_cannot_be_names() -> None:
    grammar = Lark(KPL.joinpath("kpl.lark").read_text("utf-8"), parser="lalr", start="file")
    words = {str(one.pattern.value) for one in grammar.terminals if re.fullmatch("[a-z]+", str(one.pattern.value))}
    [listed] = re.findall(r"Reserved are .*?: `([a-z\s]+)`", TEXT, re.DOTALL)
    assert set(listed.split()) == {word for word in words if not can_be_a_name(word)}


def can_be_a_name(word: str) -> bool:
    try:
        parse_kpl(f"stream {word} = {word}[{word}];")
    except KplError:
        return False
    return True


def test_statements_of_the_table_are_statements() -> None:
    table = re.findall(r"^\| `([a-z]+ [^`]*;)` \|", TEXT, re.MULTILINE)
    assert len(table) == 13
    assert len(parse_kpl("\n".join(table)).statements) == 13
