"""Texts of KPL with one fault in their words each: what is said about it, and how it is mended."""

from dataclasses import dataclass

HEAD = """sort Point = <float, float>;
sort Car;
sort Road;
object Car car1, car2;
object Road main;
feature Point pos(Car);
feature bool on_road(Car);
feature bool on(Car, Road);
source Point gps;
source string names;
compunit bool road_test(Point);
compunit float distance(Point, Point);
strmgen pos[car1] = gps;
strmgen pos[car2] = gps;
"""


@dataclass(frozen=True)
class Fault:
    """The end of a text, where `«` and `»` stand around the place of the error, and how it is mended."""

    code: str
    bad: str
    message: str
    hint: str
    good: str


_HINT_CONSTRAINTS = "constraints start with any, sample, no, use, linear, max, from, to, oldest, monotone, strict"
_HINT_STATEMENTS = "statements start with sort, object, feature, source, compunit, strmgen, stream"
_HINT_UNITS = "units are us, ms, s, min, h"

WORDS = {
    "a character no word has": Fault(
        "K0101",
        "stream a = pos«{»car1];",
        "expected a word of the language, got the character '{'",
        "labels have their arguments in [ ]",
        "stream a = pos[car1];",
    ),
    "a misspelled statement": Fault(
        "K0102",
        "«strmgne» d = gps;",
        "expected a statement, got 'strmgne'",
        "did you mean 'strmgen'?",
        "strmgen d = gps;",
    ),
    "an empty statement": Fault("K0102", "«;»", "expected a statement, got ';'", _HINT_STATEMENTS, ""),
    "a reserved word as a name": Fault(
        "K0102",
        "strmgen «sample» = gps;",
        "expected a name after 'strmgen', got 'sample'",
        "'sample' is a word of the language; choose another name",
        "strmgen ordered = gps;",
    ),
    "a missing type": Fault("K0102", "sort A = «;»", "expected a type after '=', got ';'", "", "sort A = set(Point);"),
    "an open type": Fault(
        "K0102", "sort A = <float«;»", "expected ',' or '>' after 'float', got ';'", "", "sort A = <float>;"
    ),
    "a unit without inputs": Fault(
        "K0102", "compunit bool x«;»", "expected '(' after 'x', got ';'", "", "compunit bool x(Point);"
    ),
    "a missing semicolon": Fault(
        "K0103",
        "stream a = pos[car1«]»\nstream b = pos[car2];",
        "expected 'with' or ';' after ']', got the end of the statement",
        "",
        "stream a = pos[car1];\nstream b = pos[car2];",
    ),
    "an open parenthesis": Fault(
        "K0102",
        "strmgen d = distance(pos[car1], pos[car2]«;»",
        "expected 'with', ',' or ')' after ']', got ';'",
        "",
        "strmgen d = distance(pos[car1], pos[car2]);",
    ),
    "a misspelled 'with'": Fault(
        "K0102",
        "stream a = pos[car1] «wiht» any update;",
        "expected 'with' or ';' after ']', got 'wiht'",
        "did you mean 'with'?",
        "stream a = pos[car1] with any update;",
    ),
    "a forgotten 'with'": Fault(
        "K0102",
        "stream a = pos[car1] «any» update;",
        "expected 'with' or ';' after ']', got 'any'",
        "constraints come after 'with'",
        "stream a = pos[car1] with any update;",
    ),
    "an empty policy": Fault(
        "K0102",
        "stream a = pos[car1] with«;»",
        "expected a constraint such as 'strict order' after 'with', got ';'",
        _HINT_CONSTRAINTS,
        "stream a = pos[car1];",
    ),
    "a misspelled constraint": Fault(
        "K0102",
        "stream a = pos[car1] with any update, «stirct» order;",
        "expected a constraint such as 'strict order' after ',', got 'stirct'",
        "did you mean 'strict'?",
        "stream a = pos[car1] with any update, strict order;",
    ),
    "a misspelled constraint among arguments": Fault(
        "K0102",
        "strmgen d = distance(pos[car1] with any update, stirct «order», pos[car2]);",
        "expected 'with', ',', '[' or ')' after 'stirct', got 'order'",
        "did you mean 'strict'?",
        "strmgen d = distance(pos[car1] with any update, strict order, pos[car2]);",
    ),
    "a misspelled second word": Fault(
        "K0102",
        "stream a = pos[car1] with any «chnage»;",
        "expected 'change', 'order' or 'update' after 'any', got 'chnage'",
        "did you mean 'change'?",
        "stream a = pos[car1] with any change;",
    ),
    "constraints without a comma": Fault(
        "K0102",
        "stream a = pos[car1] with any update «strict» order;",
        "expected ',' or ';' after 'update', got 'strict'",
        "",
        "stream a = pos[car1] with any update, strict order;",
    ),
    "a missing duration": Fault(
        "K0102",
        "stream a = pos[car1] with max delay«;»",
        "expected 'oo' or a duration such as 200ms after 'delay', got ';'",
        "",
        "stream a = pos[car1] with max delay oo;",
    ),
    "an unknown unit of time": Fault(
        "K0102",
        "stream a = pos[car1] with max delay 5 «sec»;",
        "expected ',' or ';' after '5', got 'sec'",
        _HINT_UNITS,
        "stream a = pos[car1] with max delay 5 s;",
    ),
    "a duration without a unit": Fault(
        "K0104",
        "stream a = pos[car1] with max delay «5»;",
        "expected a duration with a unit, got '5'",
        _HINT_UNITS,
        "stream a = pos[car1] with max delay 5us;",
    ),
    "a part of a microsecond": Fault(
        "K0105",
        "stream a = pos[car1] with max delay «0.5us»;",
        "expected a whole number of microseconds up to 35 years, got '0.5us'",
        "",
        "stream a = pos[car1] with max delay 0.5ms;",
    ),
    "types inside each other without end": Fault(
        "K0106",
        "sort A = " + "<" * 21 + "«float»" + ">" * 21 + ";",
        "expected at most 20 types inside each other, got more",
        "name the inner ones by 'sort'",
        "sort A = " + "<" * 20 + "float" + ">" * 20 + ";",
    ),
}
