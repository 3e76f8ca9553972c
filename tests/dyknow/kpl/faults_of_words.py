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
source set(string) names_of_labels;
compunit bool road_test(Point);
compunit float distance(Point, Point);
configuration follow(set(string));
strmgen pos[car1] = gps;
strmgen pos[car2] = gps;
strmgen chosen = names_of_labels;
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
_HINT_STATEMENTS = (
    "statements start with sort, object, feature, source, compunit, configuration, strmgen, configure, stream"
)
_HINT_UNITS = "units are us, ms, s, min, h"

WORDS = {
    "a character no word has": Fault(
        "K0101",
        "stream a = pos«{»car1];",
        "expected a word of the language, got the character '{'",
        "labels have their arguments in [ ]",
        "stream a = pos[car1];",
    ),
    "a letter that names do not have": Fault(
        "K0101",
        "strmgen f«ä»lt = gps;",
        "expected a word of the language, got the character 'ä'",
        "names are made of the letters a to z and A to Z, digits and '_'",
        "strmgen falt = gps;",
    ),
    "a name in quotes": Fault(
        "K0101",
        'stream a = «"»pos"[car1];',
        "expected a word of the language, got the character '\"'",
        "names stand without quotes",
        "stream a = pos[car1];",
    ),
    "a comment of another language": Fault(
        "K0101",
        "stream a = pos[car1]; «-»- slow\n",
        "expected a word of the language, got the character '-'",
        "names have no '-', and durations are not negative",
        "stream a = pos[car1]; // slow\n",
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
        "statements end with ';'",
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
        "constraints are joined by ','",
        "stream a = pos[car1] with any update, strict order;",
    ),
    "a comma for a decimal point": Fault(
        "K0102",
        "stream a = pos[car1] with max delay 0,«5s»;",
        "expected a constraint such as 'strict order' after ',', got '5s'",
        "decimals have a point, as in 0.5s",
        "stream a = pos[car1] with max delay 0.5s;",
    ),
    "half a constraint": Fault(
        "K0102",
        "stream a = pos[car1] with «delay» 5s;",
        "expected a constraint such as 'strict order' after 'with', got 'delay'",
        "did you mean 'max delay'?",
        "stream a = pos[car1] with max delay 5s;",
    ),
    "a constraint as one says it": Fault(
        "K0102",
        "stream a = pos[car1] with strict order, sample every 1s, «interpolate»;",
        "expected a constraint such as 'strict order' after ',', got 'interpolate'",
        "did you mean 'linear interpolation'?",
        "stream a = pos[car1] with strict order, sample every 1s, linear interpolation;",
    ),
    "infinity in full": Fault(
        "K0102",
        "stream a = pos[car1] with max delay «infinite»;",
        "expected 'oo' or a duration such as 200ms after 'delay', got 'infinite'",
        "'oo' is infinite",
        "stream a = pos[car1] with max delay oo;",
    ),
    "a statement in capitals": Fault(
        "K0102",
        "«Stream» a = pos[car1];",
        "expected a statement, got 'Stream'",
        "did you mean 'stream'?",
        "stream a = pos[car1];",
    ),
    "objects in round brackets": Fault(
        "K0102",
        "stream a = pos«(»car1);",
        "expected 'with', '[' or ';' after 'pos', got '('",
        "labels have their arguments in [ ]; units are applied by 'strmgen', which gives what comes out a label",
        "stream a = pos[car1];",
    ),
    "a mediation without a control": Fault(
        "K0102",
        "strmgen a = selection of Point«;»",
        "expected 'by' or 'with' after 'Point', got ';'",
        "",
        "strmgen a = selection of Point by chosen;",
    ),
    "a mediation with its policy behind": Fault(
        "K0102",
        "strmgen a = selection of Point by chosen «with» strict order;",
        "expected '[' or ';' after 'chosen', got 'with'",
        "a policy comes before 'by'",
        "strmgen a = selection of Point with strict order by chosen;",
    ),
    "a misspelled mediation": Fault(
        "K0102",
        "strmgen a = colection «of» Point by chosen;",
        "expected '(' or ';' after 'colection', got 'of'",
        "did you mean 'collection'?",
        "strmgen a = collection of Point by chosen;",
    ),
    "a source with a policy": Fault(
        "K0102",
        "strmgen a = gps «with» strict order;",
        "expected '(' or ';' after 'gps', got 'with'",
        "a policy belongs to a label that is read",
        "strmgen b = gps; stream a = b with strict order;",
    ),
    "a configuration of two streams": Fault(
        "K0102",
        "configure a = follow(chosen«,» pos[car1]);",
        "expected 'with', '[' or ')' after 'chosen', got ','",
        "",
        "configure a = follow(chosen);",
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
        "did you mean 's'?",
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
