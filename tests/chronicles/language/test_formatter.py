"""One layout for every text, in which no word and no comment is lost."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chronicles import library
from chronicles.errors import ChronicleError
from chronicles.language.formatter import format_text
from chronicles.language.model import ChronicleFile
from chronicles.language.parser import parse, words_and_comments
from dyknow.language.diagnostics import Reporter
from dyknow.language.words import COMMENT, Word
from tests.cases import for_each
from tests.chronicles.execution.random_cases import CaseMaker
from tests.chronicles.language.texts.everything import EVERYTHING

BREAKS = (" ", " ", "  ", "\n", "\n\n", "\n\n\n  ", " # a\n", "\n  // b, ( {\n", "\n#c\n\n# d\n", '  # "e\n')


def words_of(text: str) -> list[Word]:
    return words_and_comments(text, "text", Reporter({"text": text}))


def tree(text: str) -> ChronicleFile:
    reporter = Reporter({"text": text})
    file = parse(text, "text", reporter)
    assert not reporter.diagnostics
    return file


def scattered(text: str, breaks: list[str]) -> str:
    """Write the words of a text with other things between them."""
    words = [word.text for word in words_of(text) if word.kind != COMMENT]
    return "".join(word + breaks[index % len(breaks)] for index, word in enumerate(words))


def assert_formatted(text: str) -> None:
    once = format_text(text)
    assert format_text(once) == once
    assert tree(once) == tree(text)
    before, after = ([one.text.rstrip() for one in words_of(each) if one.kind == COMMENT] for each in (text, once))
    assert after == before
    assert "\n\n\n" not in once
    assert not any(line != line.rstrip() for line in once.split("\n"))
    assert all(len(line) <= 120 for line in once.split("\n") if "#" not in line and "//" not in line)


@pytest.mark.long
@for_each("seed", range(60))
def test_random_text_keeps_its_words_and_comments_and_its_layout_is_final(seed: int) -> None:
    pick = random.Random(seed)
    text = CaseMaker(seed).text() if seed % 3 else EVERYTHING
    assert_formatted(scattered(text, [pick.choice(BREAKS) for _ in range(pick.randint(1, 200))]))


@pytest.mark.long
@given(st.lists(st.sampled_from(BREAKS) | st.text(" \n\t", min_size=1, max_size=4), min_size=1, max_size=40))
@settings(max_examples=30, deadline=None)
def test_any_blanks_and_comments_between_words_are_laid_out_for_good(breaks: list[str]) -> None:
    assert_formatted(scattered(EVERYTHING, breaks))


@for_each("name", library.names())
def test_library_is_laid_out_for_good(name: str) -> None:
    assert_formatted(library.text(name))


def test_comments_stay_behind_their_line_or_before_the_next() -> None:
    text = """# head

domain Car=symbol;# cars
chronicle one[?a](t1) {# body
      // first

   event(enter[?a],t1);event(enter[?b],   # the second
       t2)


 t2-t1 in[1s ,5s]
 # last
}# end"""
    assert (
        format_text(text)
        == """# head

domain Car = symbol  # cars
chronicle one[?a](t1) {  # body
  // first

  event(enter[?a], t1)
  event(enter[?b],  # the second
      t2)

  t2 - t1 in [1s, 5s]
  # last
}  # end
"""
    )


def test_short_bodies_of_declarations_and_single_actions_take_one_line() -> None:
    text = """attribute p[?a] {
 ?a in Car ; value in {x}
 default x }
chronicle c(t1) { event(p[?]:(?, x), t1) when recognized { emit m[] } }
chronicle d(t1) { event(p[?]:(?, x), t1) when recognised { emit m[] report "a" } }"""
    assert (
        format_text(text)
        == """attribute p[?a] { ?a in Car  value in {x}  default x }
chronicle c(t1) {
  event(p[?]:(?, x), t1)
  when recognized { emit m[] }
}
chronicle d(t1) {
  event(p[?]:(?, x), t1)
  when recognised {
    emit m[]
    report "a"
  }
}
"""
    )


def test_body_of_a_declaration_with_a_comment_takes_a_line_for_each_item() -> None:
    assert format_text("message m[?a] { # why\n?a in Car }") == "message m[?a] {  # why\n  ?a in Car\n}\n"


def test_long_statement_is_broken_at_commas() -> None:
    values = [f"value_number_{index}" for index in range(12)]
    formatted = format_text(f"domain D = {{{','.join(values)}}}")
    first, second, _ = formatted.split("\n")
    assert len(first) <= 120 < len(first) + len(", value_number_8")
    assert second.startswith("    value_number_")


def test_semicolon_is_kept_only_before_a_sign_that_would_join_the_line_before() -> None:
    text = "chronicle c { t1 < t2; -2s < t3 - t1 <= 1s; t1 < t2 + 1s; -2s < t3 - t1 <= 1s; }"
    assert [line for line in format_text(text).split("\n") if ";" in line] == ["  t1 < t2;"]


def test_spacing_of_marks_follows_their_meaning() -> None:
    text = 'example "x" { 1s p[ a , -3 ]:( b,c ) expect d[ r = -3 ] 1s .. 2s }'
    assert format_text(text) == 'example "x" {\n  1s p[a, -3]:(b, c)\n  expect d[r=-3] 1s..2s\n}\n'
    text = "chronicle c { t2-t1 in ]-oo,3[ t1=t2-5 occurs((1 ,oo),m[?],( t1,t2+1 )) select first ( t1 ) ?a==-3 }"
    assert format_text("timeunit 1us " + text).split("\n")[2:-2] == [
        "  t2 - t1 in ]-oo, 3[",
        "  t1 = t2 - 5",
        "  occurs((1, oo), m[?], (t1, t2 + 1))",
        "  select first(t1)",
        "  ?a == -3",
    ]


def test_text_with_a_syntax_error_is_refused_with_its_place() -> None:
    with pytest.raises(ChronicleError) as caught:
        format_text("chronicle a {\n evnt(b[], t1) }", "a.chronicle")
    assert [(one.code, one.file, one.line) for one in caught.value.diagnostics] == [("C0102", "a.chronicle", 2)]


def test_one_blank_line_is_kept_between_statements_and_none_inside_a_brace() -> None:
    text = "chronicle a { }\n\n\nchronicle b {\n\n event(c[], t1)\n\n\n event(c[], t2) event(c[], t3)\n\n}\nmessage d[]"
    assert format_text(text) == (
        "chronicle a { }\n\nchronicle b {\n  event(c[], t1)\n\n  event(c[], t2)\n  event(c[], t3)\n}\nmessage d[]\n"
    )


def test_empty_text_stays_empty() -> None:
    assert format_text(" \n\n") == ""
    assert format_text("# only this") == "# only this\n"
