"""Whatever comes, the answer is an error with a place, three parts, and words that a reader of KPL knows."""

import re
from functools import cache
from importlib.resources import files

import pytest
from lark import Lark

from dyknow.errors import KplError
from dyknow.kpl.checks import check_kpl
from dyknow.kpl.parser import parse_kpl
from dyknow.kpl.policies import parse_policy
from dyknow.kpl.printer import print_kpl
from tests.cases import for_each
from tests.dyknow.kpl.faults_of_words import HEAD


@cache
def grammar() -> Lark:
    return Lark(files("dyknow.kpl").joinpath("kpl.lark").read_text("utf-8"), parser="lalr", start="file")


@cache
def terminals() -> set[str]:
    return {terminal.name for terminal in grammar().terminals}


HOSTILE = """stream a = chosen|stream a|stream|stream a = chosen with|stream a = chosen with ;|stream a chosen;
a = chosen;|stream a = chosen;;|stream = chosen;|stream a == chosen;|stream a := chosen;
stream a = chosen strict order;|stream a = chosen with strict;|stream a = chosen with strict, order;
stream a = chosen with any;|stream a = chosen with sample 5s;|stream a = chosen with use recent;
stream a = chosen with linear;|stream a = chosen with no;|stream a = chosen with from now to now;
stream a = chosen with to 5s from 3s;|stream a = chosen with max 5s;
stream a = chosen with max delay -5s;|stream a = chosen with max delay 1e3s;
stream a = chosen with max delay 1_000s;|stream a = chosen with max delay .5s;
stream a = chosen with max delay 5 m;|stream a = chosen with max delay 5 seconds;
stream a = chosen with max delay 99999999999999999999h;|stream a = chosen with from 5 to 6s;
stream a = chosen with oldest oo;|stream a = chosen with sample every oo;|stream a = pos[car1;
stream a = pos(car1);|stream a = pos[[car1]];|stream a = pos[];|stream a = pos[car1,];
stream a = pos;|stream a = pos[car1, car2];|stream a = pos[car9];|stream a = pos[main];
stream a = [car1];|strmgen a = distance(;|strmgen a = distance();|strmgen a = distance(pos[car1], );
strmgen a = distance(,);|strmgen a = distance(distance(pos[car1], pos[car2]), pos[car1]);
strmgen a = (gps);|strmgen gps;|strmgen a, b = gps;|strmgen a = selection;
strmgen a = selection of by by;|strmgen a = selection of Point chosen;
strmgen a = collection Point by chosen;|strmgen a = collection of Point by;
strmgen a = collection of <Point by chosen;|strmgen a = collection(of Point by chosen);
strmgen a = selection of Point with by chosen;|mediation a by chosen;|configure a = follow;
configure a = follow();|configure a = follow(chosen, chosen);|configure pos[car1] = follow(chosen);
configure a;|configuration x;|configuration float x(float);|configuration x();
configuration gps(float);|sort;|sort A = ;|sort A = <>;|sort A = <float;|sort A = float>;
sort A = set;|sort A = set();|sort A = collected();|sort A = list(float);
sort A = set(float, float);|sort A = A;|sort A = B; sort B = A;|sort float;|sort A B;|object;
object Car;|object car3;|object Car car3 car4;|object Care car3;|object Car car1;|feature float;
feature speed(Car);|feature float speed[Car];|feature float speed();|feature float speed(car1);
source gps;|source float;|source float gps, gps2;|source float a(float);|compunit float f;
compunit float f();|compunit f(float);|compunit float f(float x);|STREAM a = chosen;
sream a = chosen;|import kpl;|{|}|();|with;|oo;|,|=|5s;|any update;|/* old */ stream a = chosen;
-- old;|@a;|stream a = "chosen";|stream \u201ca\u201d = chosen;|stream \u00e5 = chosen;
stream a = chosen\uff1b|stream \u200ba = chosen;|\x00|stream a = chosen with max delay \u221e;
stream a = chosen with max delay \u0665s;|stream a\x1b[31m = chosen;|strmgen a = b; strmgen b = a;
stream a = chosen # ; the end is in a comment|\ud7ff"""
TEXTS = [one for line in HOSTILE.split("\n") for one in line.split("|")]


def refused(text: str) -> KplError:
    with pytest.raises(KplError) as caught:
        check_kpl(text, name="a.kpl")
    return caught.value


@pytest.mark.long
@for_each("text", TEXTS)
def test_hostile_text_is_refused_in_three_parts_at_its_place(text: str) -> None:
    error = refused(HEAD + text)
    lines = (HEAD + text).split("\n")
    for found in error.diagnostics:
        assert re.match(r"expected \S.*, got \S", found.message)
        assert found.line == len(lines)
        assert 1 <= found.column < found.end_column <= len(lines[-1]) + 2
        assert not (terminals() & set(re.findall(r"\w+", found.message + found.hint))) - set(re.findall(r"\w+", text))
        shown = found.render().split("\n")
        assert shown[1] == f"  --> a.kpl:{found.line}:{found.column}"
        assert len([row for row in shown if set(row.partition("|")[2]) == {" ", "^"}]) == 1
    assert str(error).isprintable() or all(line.isprintable() for line in str(error).split("\n"))


def test_there_are_many_hostile_texts() -> None:
    assert len(set(TEXTS)) > 120


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"], ids=["unix", "windows", "old mac"])
@pytest.mark.parametrize("mark", ["", "\ufeff"], ids=["plain", "byte order mark"])
def test_ends_of_lines_and_byte_order_marks_change_nothing(end: str, mark: str) -> None:
    text = f"{mark}source float gps; # a comment{end}strmgen pos = gps;{end}{end}stream seen = poss;{end}"
    [found] = refused(text).diagnostics
    assert (found.line, found.column, found.source_line) == (4, 15, "stream seen = poss;")
    assert print_kpl(parse_kpl(text)) == "source float gps;\nstrmgen pos = gps;\nstream seen = poss;\n"
    assert str(parse_policy(f"{mark}any change,{end}strict order")) == "any change, strict order"


@for_each("text", ["", "\ufeff", "\n\n", "# only\n// comments", "#\r# two\r\n", " \t\f\v"])
def test_text_without_statements_declares_nothing(text: str) -> None:
    assert check_kpl(text).processes == ()


def test_long_lines_and_words_are_shown_in_part() -> None:
    text = f"source float gps; strmgen c = gps; stream {'a' * 9000} = {'b' * 9000}; "
    text += f"stream d = c with max delay {'9' * 9000}s;"
    shown = str(refused(text))
    assert max(map(len, shown.split("\n"))) < 250
    assert f"expected a declared label, got '{'b' * 57}...'" in shown
    assert f"up to 35 years, got '{'9' * 57}...'" in shown


@pytest.mark.long
def test_hundreds_of_errors_are_counted_and_the_first_ones_shown() -> None:
    text = "source int s;\n" + "\n".join(f"strmgen label{i} = s; stream s{i} = labell{i};" for i in range(300))
    error = refused(text)
    assert len(error.diagnostics) == 300
    assert str(error).count("error[") == 50
    assert str(error).endswith("\n\nand 250 more errors")
    assert [bool(found.hint) for found in error.diagnostics[:51]] == [True] * 50 + [False]


def test_brackets_without_end_are_refused() -> None:
    for text in ("sort A = " + "<" * 20_000, "sort A = " + "set(" * 5_000 + "float" + ")" * 5_000 + ";"):
        [found] = refused(text).diagnostics
        assert found.code in ("K0103", "K0106")


def test_twenty_thousand_lines_are_read() -> None:
    chain = [f"strmgen a{i} = f(a{i - 1});{'  # a comment' * 9}\n" + "\n" * 19 for i in range(1, 1000)]
    text = "source int s;\ncompunit int f(int);\nstrmgen a0 = s;\n" + "".join(chain) + "stream z = a999;"
    assert text.count("\n") > 19_900
    assert len(check_kpl(text).processes) == 1000
